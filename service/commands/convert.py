"""`polyfield convert`: a capture to a .glb, in this process."""

import argparse
from pathlib import Path

from service.commands.common import add_options, options_of
from service.commands.progress_bar import ProgressBar

CHECKPOINT = ".checkpoint"


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    parser = subparsers.add_parser("convert", help="turn photos into a .glb")
    parser.add_argument("capture", type=Path, help="folder of photos, with poses or without; pose file; or .zip")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="where the results go")
    add_options(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Exit status 1 where a format could not be made; the others are there.

    Stopped with Ctrl-C, it goes on from its checkpoint when started again the same way.
    """
    options = options_of(arguments)
    from service.conversion import convert  # late, because it loads PyTorch

    with ProgressBar() as bar:
        report = convert(
            arguments.capture,
            arguments.out,
            **options.as_json(),
            progress=bar,
            on_report=lambda found: bar.say(found.as_table()),
            checkpoint_dir=arguments.out / CHECKPOINT,
        )
    print(report.as_table())
    print(f"written to {arguments.out}")
    return 1 if any(row.problem for row in report.formats.values()) else 0
