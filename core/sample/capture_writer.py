"""The sample on disk, in NeRF-synthetic's layout."""

from __future__ import annotations

import json
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from PIL import Image

from core.camera import Camera
from core.errors import OptionInvalid
from core.progress import Progress, ProgressCallback, ignore_progress
from core.sample.cameras import CAMERA_ANGLE_X, hemisphere_cameras, orbit_cameras
from core.sample.studio import THREADS, Studio


def write_sample_capture(
    folder: Path,
    *,
    seed: int = 0,
    size_px: int = 200,
    train_views: int = 60,
    test_views: int = 10,
    progress: ProgressCallback = ignore_progress,
) -> None:
    """Renders the sample into a folder: transforms_train.json, transforms_test.json, train/ and test/ of RGBA PNGs.

    The same arguments write the same bytes. Pose files are written last, so a folder that has them is complete.

    Args:
        progress: is told stage "render" and the share of photos written.

    Raises:
        OptionInvalid
    """
    _check_options(seed=seed, size_px=size_px, train_views=train_views, test_views=test_views)
    cameras = {
        "train": hemisphere_cameras(train_views, size_px, seed),
        "test": orbit_cameras(test_views, size_px, seed),
    }
    for split in cameras:
        (folder / split).mkdir(parents=True, exist_ok=True)
    studio = Studio(seed)
    jobs = [(folder / split / f"{camera.name}.png", camera) for split in cameras for camera in cameras[split]]
    with ThreadPoolExecutor(THREADS) as threads:
        for done, _ in enumerate(threads.map(lambda job: _write_photo(studio, *job), jobs), start=1):
            progress(Progress("render", done / len(jobs)))
    for split, views in cameras.items():
        (folder / f"transforms_{split}.json").write_text(json.dumps(_transforms(split, views), indent=1) + "\n")


def _write_photo(studio: Studio, path: Path, camera: Camera) -> None:
    # Level 6 takes as long as rendering; 1 costs a quarter more bytes.
    Image.fromarray(straight_u8(studio.photo(camera))).save(path, compress_level=1)


def straight_u8(photo: np.ndarray) -> np.ndarray:
    """[h, w, 4] uint8 with straight alpha, from premultiplied colour and coverage in [0, 1]."""
    alpha = photo[..., 3:]
    colour = np.divide(photo[..., :3], alpha, where=alpha > 0, out=np.zeros_like(photo[..., :3]))
    return np.rint(np.clip(np.concatenate([colour, alpha], -1), 0, 1) * 255).astype(np.uint8)


def _transforms(split: str, cameras: Iterable[Camera]) -> dict[str, object]:
    frames = [
        {"file_path": f"./{split}/{camera.name}", "transform_matrix": camera.world_from_camera.tolist()}
        for camera in cameras
    ]
    return {"camera_angle_x": CAMERA_ANGLE_X, "frames": frames}


def _check_options(**options: int) -> None:
    lowest = {"seed": 0, "size_px": 1, "train_views": 2, "test_views": 1}
    for name, value in options.items():
        if value < lowest[name]:
            raise OptionInvalid(name, f"must be at least {lowest[name]}", str(value), "Choose a larger one.")
