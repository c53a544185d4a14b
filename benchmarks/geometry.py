"""Whether surfaces lie where they are: depth error, floaters and overdraw on the sample capture, whose depth is known.

    python -m benchmarks.geometry [draft balanced,distortion=0.1 ...] [--glb NAME=FILE ...] [--size 200]

Each variant is a preset, with settings after commas; several are trained and shown one below the other. Or give .glb
files that were made from the sample capture (`polyfield sample`, seed 0). Figures are over all held-out views, on the
.glb as written and read again. Adds rows to geometry.json and geometry.md in the results folder, and draws
geometry.png: render, depth error, opaque layers of one held-out view.
"""

import argparse
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.child_process import in_child
from benchmarks.depth_scores import DepthScores, depth_error, depth_scores
from benchmarks.fragments import Fragments, fragments_of
from benchmarks.hardware import hardware
from benchmarks.tables import figure, markdown, merged
from core.baked import BakedScene
from core.camera import Camera
from core.capture import Capture
from core.datasets import read_capture
from core.device import resolve_device
from core.errors import PolyfieldError
from core.evaluation import evaluate
from core.normalisation import pose_in_user_frame
from core.presets import settings_for
from core.reconstruct import reconstruct
from core.render.composite import over, quantised
from core.render.raster import Rasteriser
from core.sample import Studio, write_sample_capture
from exporters.gltf import read_glb, write_glb
from service.conversion import SCENE

RESULTS = Path(__file__).parent / "results"
JSON_FILE, TABLE_FILE, PICTURE_FILE = "geometry.json", "geometry.md", "geometry.png"
WHITE_ERROR = 0.05  # of the scene's size: what the error map shows as white
WHITE_LAYERS = 6
HEADING = """# Geometry

Made by `python -m benchmarks.geometry` on the sample capture, whose true depth is known. Depth errors are in percent of
the scene's size, where both the asset and the truth have a surface; "far off" is above 2 %. Floaters: covered pixels
where in truth there is nothing. Holes: true pixels that are not covered. Overdraw: opaque fragments per covered pixel
(1 is best); all fragments include holes. `geometry.png`: render, depth error (white: 5 % or more), opaque layers.
"""
COLUMNS = ("variant", "photos", "hardware", "PSNR dB", "depth error %", "90 %", "far off %", "floaters %", "holes %",
           "overdraw", "all fragments", "quads")  # fmt: skip


@dataclass(frozen=True)
class GeometryRow:
    """One asset."""

    variant: str
    photos: str
    hardware: str
    psnr: float
    quads: int
    scores: dict[str, float]

    def cells(self) -> tuple[str, ...]:
        scores = DepthScores(**self.scores)
        percents = (scores.median, scores.most, scores.far_off, scores.floaters, scores.holes)
        return (
            self.variant, self.photos, self.hardware, figure(self.psnr), *(figure(100 * p) for p in percents),
            figure(scores.overdraw), figure(scores.fragments), str(self.quads),
        )  # fmt: skip


def train_variant(folder: Path, variant: str, device: str, seed: int) -> bytes:
    """The .glb of a preset with settings: "draft,cells=48"."""
    preset, *assignments = variant.split(",")
    settings = settings_for(preset, **dict(text.split("=", 1) for text in assignments))
    return write_glb(reconstruct(read_capture(folder), settings, device=device, seed=seed).scene)[SCENE]


def assets_of(arguments: argparse.Namespace, folder: Path, device: str) -> dict[str, bytes]:
    """The .glb files that were given, and those of the variants, trained one after the other on the capture."""
    assets = {name: Path(path).read_bytes() for name, path in (text.split("=", 1) for text in arguments.glb)}
    for variant in arguments.variants or ([] if assets else ["draft"]):
        assets[variant] = in_child(train_variant, folder, variant, device, arguments.seed)
        print(f"trained: {variant}", flush=True)
    return assets


def true_depths(capture: Capture, cameras: Sequence[Camera], seed: int = 0) -> list[np.ndarray]:
    """[height, width] each: the sample's true distance along the rays of cameras; object units."""
    studio = Studio(seed, lights=1)
    scale = float(np.cbrt(np.linalg.det(capture.user_from_object[:3, :3])))
    in_user_frame = [
        replace(camera, world_from_camera=pose_in_user_frame(capture.user_from_object, camera)) for camera in cameras
    ]
    return [studio.depth(camera).astype(np.float64) / scale for camera in in_user_frame]


def size_of(cameras: Sequence[Camera], truths: Sequence[np.ndarray]) -> float:
    """The longest side of the box around all true surface points that are seen."""
    points = []
    for camera, truth in zip(cameras, truths, strict=True):
        there = np.isfinite(truth)
        rays = camera.directions(camera.pixel_centres())[there]
        points.append(camera.position + rays * truth[there, None])
    everything = np.concatenate(points)
    return float((everything.max(0) - everything.min(0)).max())


def picture(scene: BakedScene, camera: Camera, fragments: Fragments, truth: np.ndarray, size: float) -> np.ndarray:
    """[h, 3 w, 3] uint8: render, depth error, opaque layers."""
    front = fragments.front()
    error = depth_error(front, truth) / (size * WHITE_ERROR)
    both = np.isfinite(front) & np.isfinite(truth)
    heat = _heat(np.where(both, error, 0.0))
    heat[np.isfinite(front) & ~np.isfinite(truth)] = (0.2, 0.2, 1.0)  # floaters
    heat[~np.isfinite(front) & np.isfinite(truth)] = (0.0, 0.6, 0.6)  # holes
    render = over(Rasteriser(scene).deferred(camera), scene.background)
    return quantised(np.concatenate([render, heat, _heat(fragments.layers() / WHITE_LAYERS)], 1))


def _heat(share: np.ndarray) -> np.ndarray:
    """Black, red, yellow, white for 0 to 1."""
    return np.clip(3.0 * share[..., None] - [0.0, 1.0, 2.0], 0.0, 1.0)


def measure(
    assets: Mapping[str, bytes], capture: Capture, words: tuple[str, str], view: int
) -> tuple[list[GeometryRow], np.ndarray]:
    """Rows, and the picture of all assets. Args: words: of photos and hardware. view: of the picture."""
    cameras = [one.camera for one in capture.test]
    truths = true_depths(capture, cameras)
    size = size_of(cameras, truths)
    rows, pictures = [], []
    for name, glb in assets.items():
        scene = read_glb(glb)
        drawn = [fragments_of(scene, camera) for camera in cameras]
        scores = asdict(depth_scores(drawn, truths, size))
        psnr = evaluate(scene, capture.test).psnr or 0.0
        rows.append(GeometryRow(name, *words, psnr, scene.quad_count, scores))
        pictures.append(picture(scene, cameras[view], drawn[view], truths[view], size))
    return rows, np.concatenate(pictures)


def main() -> int:
    arguments = _arguments()
    try:
        with tempfile.TemporaryDirectory() as folder:
            rows, image = _measured(arguments, Path(folder))
    except PolyfieldError as error:
        sys.exit(f"error [{error.code}]: {error}")
    everything = merged(
        arguments.results / JSON_FILE,
        [asdict(row) for row in rows],
        lambda row: (row["variant"], row["photos"], row["hardware"]),
    )
    table = markdown(COLUMNS, [GeometryRow(**row).cells() for row in everything])
    (arguments.results / TABLE_FILE).write_text(f"{HEADING}\n{table}", encoding="utf-8")
    Image.fromarray(image).save(arguments.results / PICTURE_FILE, optimize=True)
    print(markdown(COLUMNS, [row.cells() for row in rows]))
    return 0


def _measured(arguments: argparse.Namespace, folder: Path) -> tuple[list[GeometryRow], np.ndarray]:
    device = resolve_device(arguments.device)
    write_sample_capture(folder, size_px=arguments.size, train_views=arguments.views, test_views=arguments.held_out)
    assets = assets_of(arguments, folder, device)
    words = (f"{arguments.views} of {arguments.size} px", hardware(device))
    return measure(assets, read_capture(folder), words, arguments.view)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("variants", nargs="*", metavar="PRESET[,NAME=VALUE...]", help="default: draft")
    parser.add_argument("--glb", nargs="+", default=[], metavar="NAME=FILE", help="assets made from the sample capture")
    parser.add_argument("--size", type=int, default=200, help="of the sample's photos, px")
    parser.add_argument("--views", type=int, default=60, help="to train on")
    parser.add_argument("--held-out", type=int, default=10)
    parser.add_argument("--view", type=int, default=0, help="number of the held-out view in the picture")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--results", type=Path, default=RESULTS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
