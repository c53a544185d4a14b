"""`polyfield sample`: writes the sample capture."""

import argparse
from pathlib import Path

from service.commands.progress_bar import ProgressBar


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    parser = subparsers.add_parser("sample", help="render a sample capture to try things with")
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--seed", type=int, default=0)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    from core.sample import write_sample_capture  # late, because it loads the renderer

    with ProgressBar() as bar:
        write_sample_capture(arguments.folder, seed=arguments.seed, progress=bar)
    print(f"written to {arguments.folder}")
    return 0
