"""Parity of a .glb: its own shaders in OpenGL against the reference renderer, at a held-out view.

    python -m benchmarks.parity scene.glb --capture CAPTURE [--view 0] [--size 400] [--out DIR]

Prints interior PSNR and flipped share (tests/parity/compare.py) for both modes, and the PSNR of either renderer against
the photo. With --out, writes the photo, the renderings, their differences (32 times enlarged) and the figures.
"""

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import moderngl
import numpy as np
from PIL import Image

from core.baked import BakedScene
from core.camera import Camera
from core.capture import View
from core.datasets import read_capture
from core.metrics import psnr
from core.render.reference import render_deferred, render_forward
from exporters.glsl import VERSIONS, Dialect
from tests.parity.compare import Comparison, compare, pixels_with_edges
from tests.parity.gl_renderer import GlRenderer, Mode

Renderer = Callable[[BakedScene, Camera], np.ndarray]
REFERENCES: dict[Mode, Renderer] = {
    "deferred": render_deferred,
    "forward": render_forward,
}
DIFFERENCE_GAIN = 32  # makes one step of 8 bits visible


@dataclass(frozen=True)
class Row:
    """One line of the table; PSNR in dB."""

    dialect: Dialect
    mode: Mode
    interior_psnr: float
    flipped_percent: float
    gl_photo_psnr: float
    reference_photo_psnr: float
    reference_s: float


def measure(glb: bytes, view: View, out: Path | None) -> list[Row]:
    """Both modes in every dialect at one view."""
    context = moderngl.create_context(standalone=True, backend="egl")
    renderers = {dialect: GlRenderer(context, glb, dialect) for dialect in VERSIONS}
    scene = next(iter(renderers.values())).scene
    edges = pixels_with_edges(scene, view.camera)
    photo = view.over(scene.background)
    rows = []
    for mode, render in REFERENCES.items():
        started = time.perf_counter()
        reference = render(scene, view.camera)
        seconds = time.perf_counter() - started
        for dialect, renderer in renderers.items():
            actual = renderer.render(view.camera, mode)
            comparison = compare(actual, reference, edges)
            rows.append(_row(dialect, mode, comparison, (actual, reference), scene, photo, seconds))
            if out:
                _write_pictures(out, f"{mode}.{dialect}", scene, actual, reference, comparison)
    if out:
        _write_image(out / "photo.png", photo)
        figures = [asdict(row) for row in rows]
        (out / "parity.json").write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return rows


def main() -> None:
    arguments = _arguments()
    capture = read_capture(arguments.capture, max_size_px=arguments.size)
    view = capture.test[arguments.view]
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
    rows = measure(arguments.glb.read_bytes(), view, arguments.out)
    print(f"view {view.camera.name}, {view.camera.size_px[0]} x {view.camera.size_px[1]} px")
    print("mode      dialect   interior dB  flipped %  GL-photo dB  reference-photo dB  reference s")
    for row in rows:
        print(
            f"{row.mode:9} {row.dialect:9} {row.interior_psnr:11.2f} {row.flipped_percent:10.3f} "
            f"{row.gl_photo_psnr:12.2f} {row.reference_photo_psnr:19.2f} {row.reference_s:12.1f}"
        )


def _row(
    dialect: Dialect,
    mode: Mode,
    comparison: Comparison,
    images: tuple[np.ndarray, np.ndarray],
    scene: BakedScene,
    photo: np.ndarray,
    seconds: float,
) -> Row:
    gl_psnr, reference_psnr = (float(psnr(_over_background(image, scene), photo)) for image in images)
    flipped_percent = 100 * comparison.flipped_share
    return Row(dialect, mode, comparison.interior_psnr, flipped_percent, gl_psnr, reference_psnr, seconds)


def _write_pictures(
    out: Path, name: str, scene: BakedScene, actual: np.ndarray, reference: np.ndarray, comparison: Comparison
) -> None:
    """The two renderings, and their difference with the flipped pixels in red."""
    _write_image(out / f"{name}.gl.png", _over_background(actual, scene))
    _write_image(out / f"{name}.reference.png", _over_background(reference, scene))
    difference = np.repeat(comparison.difference[..., None] * DIFFERENCE_GAIN, 3, -1)
    difference[comparison.flipped] = (1.0, 0.0, 0.0)
    _write_image(out / f"{name}.difference.png", difference)


def _over_background(image: np.ndarray, scene: BakedScene) -> np.ndarray:
    return image[..., :3] + (1 - image[..., 3:]) * np.asarray(scene.background)


def _write_image(path: Path, image: np.ndarray) -> None:
    Image.fromarray(np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8)).save(path)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("glb", type=Path)
    parser.add_argument("--capture", type=Path, required=True)
    parser.add_argument("--view", type=int, default=0, help="number of the held-out view")
    parser.add_argument("--size", type=int, default=None, help="largest side in pixels; photos larger are scaled down")
    parser.add_argument("--out", type=Path, default=None, help="folder for pictures and parity.json")
    return parser.parse_args()


if __name__ == "__main__":
    main()
