"""Captures that ask too much, made from an ordinary one on disk (NeRF-synthetic's layout, as the sample's)."""

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from core.camera import Camera
from core.sample import Studio
from core.sample.cameras import CAMERA_ANGLE_X, look_at_origin
from core.sample.capture_writer import straight_u8

SPLITS = ("train", "test")
# Cameras of the sample, in its own units: within the cube that holds the still life, above the table.
INSIDE_DISTANCE = 0.95
DISTANCE = 4.03
FAR_AWAY = 100.0  # times as far, with a lens as much longer: all rays of a photo are parallel to within 0.4 degrees
COPIES_MADE_OF = 8  # photos that differ; more would only take longer to write


def copied(source: Path, target: Path, change: Callable[[np.ndarray], np.ndarray] = lambda pose: pose) -> Path:
    """The capture with every pose [4, 4] changed."""
    shutil.copytree(source, target, dirs_exist_ok=True)
    for split in SPLITS:
        content = poses_of(target, split)
        for frame in content["frames"]:
            frame["transform_matrix"] = change(np.array(frame["transform_matrix"])).tolist()
        write_poses(target, split, content)
    return target


def scaled(source: Path, target: Path, factor: float) -> Path:
    """The capture `factor` times as large."""
    return copied(source, target, lambda pose: _with_position(pose, pose[:3, 3] * factor))


def moved(source: Path, target: Path, offset: Sequence[float]) -> Path:
    """The capture somewhere else."""
    return copied(source, target, lambda pose: _with_position(pose, pose[:3, 3] + np.array(offset)))


def with_few_photos(source: Path, target: Path, count: int) -> Path:
    """The capture's first training photos only."""
    copied(source, target)
    content = poses_of(target, "train")
    write_poses(target, "train", {**content, "frames": content["frames"][:count]})
    return target


def recoloured(source: Path, target: Path, color: Sequence[int], *, alpha: bool) -> Path:
    """Every photo in one colour (sRGB bytes): within the photos' alpha, or all over and without alpha."""
    copied(source, target)
    for path in sorted(target.glob("*/*.png")):
        rgba = np.array(Image.open(path))
        rgba[..., :3] = color
        Image.fromarray(rgba if alpha else np.ascontiguousarray(rgba[..., :3])).save(path, compress_level=1)
    return target


def with_cameras_inside(source: Path, target: Path) -> Path:
    """The sample with every second training photo taken from within the cube that holds the still life."""
    copied(source, target)

    def inside(index: int, pose: np.ndarray) -> np.ndarray:
        if index % 2 == 0:
            return pose
        heading, height = np.arctan2(pose[1, 3], pose[0, 3]), 0.55 + 0.3 * (index % 5) / 4
        across = np.sqrt(1 - height**2)
        return look_at_origin(INSIDE_DISTANCE * np.array([across * np.cos(heading), across * np.sin(heading), height]))

    return _photographed(target, inside, CAMERA_ANGLE_X)


def along_the_axes(source: Path, target: Path) -> Path:
    """The sample from far away along the axes and their diagonals: rays run parallel to the grid's planes."""
    copied(source, target)
    ways = [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (1e-9, 0, 1), (1, 1, 0), (-1, 1, 0), (1, 0, 1), (0, 1, 1)]

    def far(index: int, pose: np.ndarray) -> np.ndarray:
        way = np.array(ways[index % len(ways)], float)
        return look_at_origin(FAR_AWAY * DISTANCE * way / np.linalg.norm(way))

    return _photographed(target, far, 2 * np.arctan(np.tan(CAMERA_ANGLE_X / 2) / FAR_AWAY))


def many_large_photos(source: Path, target: Path, *, count: int, size_px: int) -> Path:
    """`count` training photos of `size_px`: a few of the capture's, enlarged, again and again (linked)."""
    copied(source, target)
    content = {split: poses_of(target, split) for split in SPLITS}
    originals, held_out = content["train"]["frames"][:COPIES_MADE_OF], content["test"]["frames"][:1]
    for frame in (*originals, *held_out):
        path = target / f"{frame['file_path']}.png"
        large = Image.open(path).resize((size_px, size_px), Image.Resampling.NEAREST)
        large.save(path, compress_level=1)
    frames = []
    for index in range(count):
        original = originals[index % len(originals)]
        name = f"./train/copy_{index}"
        (target / f"{name}.png").hardlink_to(target / f"{original['file_path']}.png")
        frames.append({**original, "file_path": name})
    write_poses(target, "train", {**content["train"], "frames": frames})
    write_poses(target, "test", {**content["test"], "frames": held_out})
    return target


def poses_of(folder: Path, split: str) -> dict[str, Any]:
    """A pose file's content."""
    content: dict[str, Any] = json.loads((folder / f"transforms_{split}.json").read_text(encoding="utf-8"))
    return content


def write_poses(folder: Path, split: str, content: dict[str, Any]) -> None:
    (folder / f"transforms_{split}.json").write_text(json.dumps(content), encoding="utf-8")


def _with_position(pose: np.ndarray, position: np.ndarray) -> np.ndarray:
    changed = pose.copy()
    changed[:3, 3] = position
    return changed


def _photographed(folder: Path, change: Callable[[int, np.ndarray], np.ndarray], angle_x: float) -> Path:
    """Takes the sample's photos (seed 0) again, from changed poses and with another lens; held-out ones with the lens
    of the training ones, from their own directions."""
    studio, distance = Studio(0), np.tan(CAMERA_ANGLE_X / 2) / np.tan(angle_x / 2)
    for split in SPLITS:
        content = poses_of(folder, split)
        for index, frame in enumerate(content["frames"]):
            path = folder / f"{frame['file_path']}.png"
            pose = np.array(frame["transform_matrix"])
            pose = change(index, pose) if split == "train" else _with_position(pose, pose[:3, 3] * distance)
            width, height = Image.open(path).size
            focal = 0.5 * width / np.tan(0.5 * angle_x)
            camera = Camera(path.stem, pose, (focal, focal), (width / 2, height / 2), (width, height))
            Image.fromarray(straight_u8(studio.photo(replace(camera, name=path.stem)))).save(path, compress_level=1)
            frame["transform_matrix"] = pose.tolist()
        write_poses(folder, split, {**content, "camera_angle_x": float(angle_x)})
    return folder
