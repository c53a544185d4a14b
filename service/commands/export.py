"""`polyfield export`: a scene that is there already to other formats, without training."""

import argparse
from pathlib import Path

from service.commands.progress_bar import ProgressBar
from service.formats import FORMATS, formats_of
from service.options import photo_choices

SOURCES = ".glb, .gltf or USD file; folder or .zip of one, or of MobileNeRF's layout"


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    parser = subparsers.add_parser("export", help="write a scene that is there already in other formats")
    parser.add_argument("scene", type=Path, help=SOURCES)
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="where the results go")
    parser.add_argument("--formats", default="all", metavar="LIST", help=f"all, or some of {','.join(FORMATS)}")
    parser.add_argument("--capture", type=Path, help="to measure on its held-out photos: folder, pose file or .zip")
    parser.add_argument("--device", default="auto", help="auto, cpu, cuda or cuda:N")
    for name in ("downscale", "max-size-px"):
        text = "how the capture's photos were read; default: as report.json beside the scene says"
        parser.add_argument(f"--{name}", default="", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Exit status 1 where a format could not be made; the others are there."""
    formats = formats_of(arguments.formats)
    chosen = photo_choices({"downscale": arguments.downscale, "max_size_px": arguments.max_size_px})
    from service.export import REPORT, export, photos_as_reported  # late, because it loads PyTorch
    from service.report import format_table

    photos = photos_as_reported(arguments.scene.parent / REPORT) | chosen
    with ProgressBar() as bar:
        rows = export(
            arguments.scene,
            arguments.out,
            formats,
            capture=arguments.capture,
            photos=photos,
            device=arguments.device,
            progress=bar,
        )
    print(format_table(rows))
    print(f"written to {arguments.out}")
    return 1 if any(row.problem for row in rows.values()) else 0
