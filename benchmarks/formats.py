"""Every deliverable of one trained scene: conformance, parity with the reference renderer, and fallbacks.

    python -m benchmarks.formats scene.glb --capture CAPTURE [--views 3] [--out DIR] [--results DIR]

Writes every format of the scene and asks Khronos' and OpenUSD's validators about it; draws those that have the network
in OpenGL and compares with the reference renderer; draws the fallbacks and compares with the photos. Views are held
out, spread over all of them. Rows go into formats.json and formats.md. With --out, a picture: photo, network, each
fallback. The exit status is 1 where a goal is missed: no error and no warning; interior at least 50 dB (45 where
features are rounded) and flipped pixels at most 0.5 %; fallbacks at least 24 dB.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import moderngl
import numpy as np

from benchmarks.format_conformance import conformance
from benchmarks.format_fallbacks import PHOTO, Pictures, fallbacks
from benchmarks.format_parity import Reference, parity
from benchmarks.format_rows import FormatCheck, write_results
from benchmarks.hardware import hardware
from benchmarks.photo_options import add_photo_options, photo_options_of, read_photos
from core.capture import Capture, View
from core.errors import PolyfieldError
from exporters.gltf import read_glb
from service.formats.measure import in_frame
from service.formats.provenance import in_glb
from service.formats.source import Source

RESULTS = Path(__file__).parent / "results"


def checked(base: str, glb: bytes, views: Sequence[View], pictures: Pictures) -> Iterator[FormatCheck]:
    """Everything there is to check of a scene.glb, a row as soon as it is done.

    Args:
        views: in the object frame of the scene in `glb`.
        pictures: that the photos and fallbacks are added to.
    """
    source = Source(read_glb(glb), provenance=in_glb(glb))
    yield from conformance(base, glb, source)
    context = moderngl.create_context(standalone=True, backend="egl")
    yield from fallbacks(base, glb, source.scene, views, context, pictures)
    yield from parity(base, glb, source, [Reference(source.scene, view) for view in views], context)


def spread(capture: Capture, count: int, user_from_object: np.ndarray) -> tuple[View, ...]:
    """Of the held-out views `count`, or as many as there are, evenly spread, in another object frame."""
    views = [view for view in capture.test if view.ignored is None or not view.ignored.all()]
    chosen = np.unique(np.rint(np.linspace(0, len(views) - 1, min(count, len(views)))).astype(int))
    return in_frame([views[number] for number in chosen], capture.user_from_object, user_from_object)


def main() -> int:
    arguments = _arguments()
    try:
        glb = arguments.glb.read_bytes()
        capture = read_photos(arguments.capture, photo_options_of(arguments))
        views = spread(capture, arguments.views, read_glb(glb).user_from_object)
    except PolyfieldError as error:
        sys.exit(f"error [{error.code}]: {error}")
    if not views:
        sys.exit("error: the capture must hold out views to measure on")
    name = arguments.name or arguments.capture.resolve().stem
    base = ", ".join([name, "views " + " ".join(view.camera.name for view in views), hardware("cpu")])
    pictures, rows = Pictures(), []
    for row in checked(base, glb, views, pictures):
        print(f"{row.kind:12}" + "  ".join(cell for cell in row.cells() if cell), flush=True)
        for problem in getattr(row, "problems", ()):
            print(f"{'':12}{problem}", flush=True)
        rows.append(row)
    write_results(arguments.results, rows)
    if arguments.out:
        _write_picture(pictures, arguments.out / f"formats-{name}.png", arguments.without_photo)
    return 0 if all(row.goal_met for row in rows) else 1


def _write_picture(pictures: Pictures, path: Path, without_photo: bool) -> None:
    if without_photo:
        pictures.columns.pop(PHOTO)
    path.parent.mkdir(parents=True, exist_ok=True)
    pictures.side_by_side().save(path, optimize=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("glb", type=Path, help="scene.glb of a conversion")
    parser.add_argument("--capture", type=Path, required=True, help="with held-out views")
    parser.add_argument("--views", type=int, default=3, help="how many held-out views")
    parser.add_argument("--name", default="", help="of the scene; default: the capture's")
    parser.add_argument("--out", type=Path, help="folder for a picture: photo, network, each fallback")
    parser.add_argument(
        "--without-photo", action="store_true", help="leave the photos out of the picture: for photos that aren't ours"
    )
    add_photo_options(parser)
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder of the table")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
