"""How a benchmark reads its photos: the options of `polyfield convert` that concern them."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from core.capture import Capture
from core.datasets import read_capture
from core.scene_kind import AUTO
from service.capture_source import opened_capture
from service.options import Options


def add_photo_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--max-size-px", type=int, help="reduce the photos to this longest side at most")
    parser.add_argument("--downscale", type=int, default=1, help="reduce the photos by this whole factor")
    parser.add_argument("--scene-kind", default=AUTO, help="auto, object, forward or unbounded")
    parser.add_argument("--skip-missing", action="store_true", help="leave out photos that the capture lacks")


def photo_options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The choices as arguments of `read_capture`."""
    names = ("max_size_px", "downscale", "skip_missing")
    return {name: getattr(arguments, name) for name in names} | {"kind": arguments.scene_kind}


def photo_options_in(options: Options) -> dict[str, Any]:
    """The same out of a conversion's options."""
    names = ("max_size_px", "downscale", "background", "skip_missing")
    return {name: getattr(options, name) for name in names} | {"kind": options.scene_kind}


def read_photos(path: Path, choices: Mapping[str, Any]) -> Capture:
    """The capture of a folder, a pose file or a .zip."""
    with opened_capture(path) as source:
        return read_capture(source, **choices)
