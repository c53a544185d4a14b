"""Parity of a .glb in the three.js viewer, in headless Chromium, against the reference renderer.

    python -m benchmarks.browser_parity scene.glb [--capture CAPTURE] [--view 0] [--size 400] [--out DIR]

The view is a held-out one of the capture or, without a capture, one of the asset's own. Prints interior PSNR and
flipped share (tests/parity/compare.py) for both modes, and whether every byte of the feature pages arrived unchanged.
With --out, writes the renderings, their differences (32 times enlarged) and the figures.
"""

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.parity import DIFFERENCE_GAIN, REFERENCES
from core.baked import BakedScene
from core.camera import Camera
from core.datasets import read_capture
from exporters.gltf import read_glb
from tests.browser.chromium import missing, running_browser
from tests.browser.site import running_site
from tests.browser.viewer import ViewerPage, open_viewer
from tests.parity.compare import Comparison, compare, pixels_with_edges

RENDERER_NAME = """() => {
  const gl = polyfield.stage.webgl.getContext();
  return gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info").UNMASKED_RENDERER_WEBGL);
}"""
WINDOW = {"width": 400, "height": 300}  # the page's own canvas is not what is measured


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    mode: str
    interior_psnr: float
    flipped_percent: float


def measure(viewer: ViewerPage, scene: BakedScene, camera: Camera, out: Path | None) -> list[Row]:
    """Both modes at one view."""
    edges = pixels_with_edges(scene, camera)
    rows = []
    for mode, render in REFERENCES.items():
        reference = render(scene, camera)
        actual = viewer.render(camera, mode, camera.size_px)
        comparison = compare(actual, reference, edges)
        rows.append(Row(mode, comparison.interior_psnr, 100 * comparison.flipped_share))
        if out:
            _write_pictures(out, mode, scene, actual, reference, comparison)
    return rows


def altered_bytes(viewer: ViewerPage, scene: BakedScene) -> int:
    """How many bytes of the feature pages differ on the graphics processor from those stored."""
    count = 0
    for index, page in enumerate(scene.pages):
        for half in (0, 1):
            shown = viewer.feature_texture(index, half)
            count += int(np.count_nonzero(shown != page.features_u8[..., 4 * half : 4 * half + 4]))
    return count


def main() -> None:
    arguments = _arguments()
    if reason := missing():
        sys.exit(reason)
    glb = arguments.glb.read_bytes()
    scene = read_glb(glb)
    camera = _camera(arguments, scene)
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
    with running_site() as site, running_browser() as browser:
        site.files["/scene.glb"] = glb
        viewer = open_viewer(browser.new_page(viewport=WINDOW), f"{site.url}/viewer.html?src=/scene.glb")
        renderer = viewer.page.evaluate(RENDERER_NAME)
        rows = measure(viewer, scene, camera, arguments.out)
        altered = altered_bytes(viewer, scene)
    print(f"view {camera.name}, {camera.size_px[0]} x {camera.size_px[1]} px, {renderer}")
    print("mode       interior dB  flipped %")
    for row in rows:
        print(f"{row.mode:10} {row.interior_psnr:11.2f} {row.flipped_percent:10.3f}")
    print(f"altered bytes of the feature pages: {altered}")
    if arguments.out:
        figures = {"view": camera.name, "altered_bytes": altered, "rows": [asdict(row) for row in rows]}
        (arguments.out / "browser_parity.json").write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def _camera(arguments: argparse.Namespace, scene: BakedScene) -> Camera:
    if arguments.capture is None:
        camera = scene.cameras[arguments.view]
        scale = arguments.size / max(camera.size_px) if arguments.size else 1.0
        width, height = camera.size_px
        return camera.resized((round(width * scale), round(height * scale)))
    return read_capture(arguments.capture, max_size_px=arguments.size).test[arguments.view].camera


def _write_pictures(
    out: Path, mode: str, scene: BakedScene, actual: np.ndarray, reference: np.ndarray, comparison: Comparison
) -> None:
    """The two renderings, and their difference with the flipped pixels in red."""
    background = np.asarray(scene.background)
    for name, image in (("viewer", actual), ("reference", reference)):
        _write_image(out / f"{mode}.{name}.png", image[..., :3] + (1 - image[..., 3:]) * background)
    difference = np.repeat(comparison.difference[..., None] * DIFFERENCE_GAIN, 3, -1)
    difference[comparison.flipped] = (1.0, 0.0, 0.0)
    _write_image(out / f"{mode}.viewer.difference.png", difference)


def _write_image(path: Path, image: np.ndarray) -> None:
    Image.fromarray(np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8)).save(path)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("glb", type=Path)
    parser.add_argument("--capture", type=Path, default=None, help="where the held-out view comes from")
    parser.add_argument("--view", type=int, default=0, help="number of the held-out view, or of the asset's view")
    parser.add_argument("--size", type=int, default=None, help="largest side in pixels")
    parser.add_argument("--out", type=Path, default=None, help="folder for pictures and browser_parity.json")
    return parser.parse_args()


if __name__ == "__main__":
    main()
