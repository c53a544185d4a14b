"""What a person sees who comes close: the sample from a third of the photos' distance, with true colours.

    python -m benchmarks.closeup [draft balanced ...] [--glb NAME=FILE ...] [--size 400]

Variants are presets, with settings after commas; they are trained on the sample (200 px, 60 photos) and shown one below
the other. Or give .glb files that were made from the sample capture (`polyfield sample`, seed 0). Figures are means
over the close-ups of all held-out views, on the .glb as written and read again. Adds rows to closeup.json and
closeup.md in the results folder, and draws closeup.png: truth, render over white, render over black.
"""

import argparse
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from benchmarks.geometry import assets_of, true_depths
from benchmarks.hardware import hardware
from benchmarks.tables import figure, markdown, merged
from core.camera import Camera
from core.capture import Capture
from core.datasets import read_capture
from core.device import resolve_device
from core.errors import PolyfieldError
from core.metrics import psnr, ssim
from core.normalisation import pose_in_user_frame
from core.render.composite import quantised
from core.render.raster import Rasteriser
from core.sample import Studio, write_sample_capture
from exporters.gltf import read_glb

RESULTS = Path(__file__).parent / "results"
JSON_FILE, TABLE_FILE, PICTURE_FILE = "closeup.json", "closeup.md", "closeup.png"
NEARER = 3.0
LARGEST_PINHOLE_PX, PINHOLE_SIZE_PX = 40, 1000  # of so many pixels, in a picture of that width
CHECKER_PX = 8
HEADING = """# Close-ups

Made by `python -m benchmarks.closeup`: the sample seen from a third of the photos' distance to what the middle of each
held-out photo shows, against the sample's own renderer. PSNR (dB) over four backgrounds; pinholes: covered places of at
most 40 px at 1000 px where the asset lets the background through, a picture. `closeup.png`: truth, and the asset over
white and over black.
"""
BACKGROUNDS = ("white", "grey", "black", "checkers")
COLUMNS = ("variant", "hardware", *BACKGROUNDS, "SSIM", "pinholes", "quads", ".glb MB")


@dataclass(frozen=True)
class CloseupRow:
    """One asset. psnr: by background, dB; pinholes: a picture; megabytes: of the .glb."""

    variant: str
    hardware: str
    psnr: dict[str, float]
    ssim: float
    pinholes: float
    quads: int
    megabytes: float

    def cells(self) -> tuple[str, ...]:
        values = [figure(self.psnr[name]) for name in BACKGROUNDS]
        return (self.variant, self.hardware, *values, f"{self.ssim:.4f}", figure(self.pinholes), str(self.quads),
                figure(self.megabytes))  # fmt: skip


def closeup_cameras(capture: Capture, size_px: int) -> list[Camera]:
    """The held-out cameras, moved towards what their middle shows until a third of the way is left."""
    cameras = [view.camera for view in capture.test]
    closer = []
    for camera, depth in zip(cameras, true_depths(capture, cameras), strict=True):
        row, column = (side // 2 for side in depth.shape)
        direction = camera.directions(np.array([column + 0.5, row + 0.5]))
        if not np.isfinite(depth[row, column]):
            continue
        pose = camera.world_from_camera.copy()
        pose[:3, 3] += direction * (depth[row, column] * (1.0 - 1.0 / NEARER))
        closer.append(replace(camera, world_from_camera=pose).resized((size_px, size_px)))
    return closer


def true_photos(capture: Capture, cameras: Sequence[Camera], seed: int = 0) -> list[np.ndarray]:
    """[h, w, 4] each: premultiplied colour and coverage, by the sample's own renderer."""
    studio = Studio(seed)
    return [
        studio.photo(replace(camera, world_from_camera=pose_in_user_frame(capture.user_from_object, camera)))
        for camera in cameras
    ]


def background(name: str, shape: tuple[int, int]) -> np.ndarray:
    """[h, w, 3] in [0, 1]."""
    y, x = np.indices(shape) // CHECKER_PX
    values = {"white": 1.0, "grey": 0.5, "black": 0.0, "checkers": 0.2 + 0.6 * ((x + y) % 2)}
    return np.broadcast_to(values[name], shape)[..., None].repeat(3, -1)


def pinholes(rendered: np.ndarray, truth: np.ndarray) -> int:
    """Small places [h, w] that are covered in truth, and hardly in the render.

    Args:
        rendered, truth: coverage [h, w] in [0, 1].
    """
    labels, count = ndimage.label((rendered < 0.5) & (truth > 0.99))
    largest = LARGEST_PINHOLE_PX * (rendered.shape[1] / PINHOLE_SIZE_PX) ** 2
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    return int((sizes <= max(largest, 1.0)).sum())


def measure(
    assets: Mapping[str, bytes], capture: Capture, size_px: int, machine: str, view: int = 0
) -> tuple[list[CloseupRow], np.ndarray]:
    """Rows, and the picture of all assets."""
    cameras = closeup_cameras(capture, size_px)
    truths = true_photos(capture, cameras)
    rows, pictures = [], []
    for name, glb in assets.items():
        scene = read_glb(glb)
        rasteriser = Rasteriser(scene)
        drawn = [rasteriser.deferred(camera) for camera in cameras]
        pairs = list(zip(drawn, truths, strict=True))
        scores = {on: float(np.mean([psnr(_over(d, on), _over(t, on)) for d, t in pairs])) for on in BACKGROUNDS}
        likeness = float(np.mean([ssim(_over(d, "white"), _over(t, "white")) for d, t in pairs]))
        holes = float(np.mean([pinholes(d[..., 3], t[..., 3]) for d, t in pairs]))
        rows.append(CloseupRow(name, machine, scores, likeness, holes, scene.quad_count, len(glb) / 1e6))
        d, t = pairs[view]
        pictures.append(np.concatenate([_over(t, "white"), _over(d, "white"), _over(d, "black")], 1))
    return rows, quantised(np.concatenate(pictures))


def _over(rgba: np.ndarray, name: str) -> np.ndarray:
    behind = background(name, rgba.shape[:2])
    return np.clip(rgba[..., :3] + (1.0 - rgba[..., 3:]) * behind, 0.0, 1.0)


def main() -> int:
    arguments = _arguments()
    try:
        with tempfile.TemporaryDirectory() as folder:
            rows, image = _measured(arguments, Path(folder))
    except PolyfieldError as error:
        sys.exit(f"error [{error.code}]: {error}")
    everything = merged(
        arguments.results / JSON_FILE, [asdict(row) for row in rows], lambda row: (row["variant"], row["hardware"])
    )
    table = markdown(COLUMNS, [CloseupRow(**row).cells() for row in everything])
    (arguments.results / TABLE_FILE).write_text(f"{HEADING}\n{table}", encoding="utf-8")
    Image.fromarray(image).save(arguments.results / PICTURE_FILE, optimize=True)
    print(markdown(COLUMNS, [row.cells() for row in rows]))
    return 0


def _measured(arguments: argparse.Namespace, folder: Path) -> tuple[list[CloseupRow], np.ndarray]:
    device = resolve_device(arguments.device)
    write_sample_capture(folder)
    assets = assets_of(arguments, folder, device)
    return measure(assets, read_capture(folder), arguments.size, hardware(device), arguments.view)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("variants", nargs="*", metavar="PRESET[,NAME=VALUE...]", help="default: draft")
    parser.add_argument("--glb", nargs="+", default=[], metavar="NAME=FILE", help="assets made from the sample capture")
    parser.add_argument("--size", type=int, default=400, help="of the close-ups, px")
    parser.add_argument("--view", type=int, default=0, help="number of the close-up in the picture")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--results", type=Path, default=RESULTS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
