"""Tiny captures, whole and broken in one way each."""

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image

Files = dict[str, bytes]
FIELD_OF_VIEW_RAD = 0.7


def capture_files(train: int = 8, test: int = 2, size_px: int = 16) -> Files:
    """A NeRF-synthetic capture of a ball seen from a ring: path to content."""
    files: Files = {}
    for split, count in (("train", train), ("test", test)):
        if not count:
            continue
        frames = []
        for index in range(count):
            files[f"{split}/r_{index}.png"] = png(ball(size_px))
            pose = ring_pose(2 * np.pi * (index + 0.5 * (split == "test")) / count)
            frames.append({"file_path": f"./{split}/r_{index}", "transform_matrix": pose.tolist()})
        files[f"transforms_{split}.json"] = as_json({"camera_angle_x": FIELD_OF_VIEW_RAD, "frames": frames})
    return files


def ring_pose(angle_rad: float, radius: float = 3.0) -> np.ndarray:
    """World from camera: on a ring in the xy plane, looking at the origin, +z up."""
    back = np.array([np.cos(angle_rad), np.sin(angle_rad), 0.0])
    right = np.cross([0.0, 0.0, 1.0], back)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(back, right), back], -1)
    pose[:3, 3] = radius * back
    return pose


def ball(size_px: int) -> np.ndarray:
    """A shaded disc with alpha: [size, size, 4] uint8."""
    y, x = (np.mgrid[:size_px, :size_px] + 0.5) / size_px * 2 - 1
    inside = x**2 + y**2 < 0.5
    color = np.stack([x, y, -x], -1) * 0.4 + 0.5
    return (np.concatenate([color, inside[..., None]], -1) * 255).astype(np.uint8)


def png(image_u8: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image_u8).save(buffer, "PNG")
    return buffer.getvalue()


def huge_png(side_px: int = 20_000) -> bytes:
    """A valid PNG header of a huge image, with hardly any data behind."""
    header = struct.pack(">IIBBBBB", side_px, side_px, 8, 6, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(bytes(4096))), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def as_json(value: object) -> bytes:
    return json.dumps(value).encode()


def with_frame(files: Files, index: int, **changes: object) -> Files:
    """The capture with one training frame changed."""
    poses = json.loads(files["transforms_train.json"])
    poses["frames"][index] |= changes
    return files | {"transforms_train.json": as_json(poses)}


def zipped(files: Mapping[str, bytes], packing: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", packing) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()


def write_files(folder: Path, files: Mapping[str, bytes]) -> Path:
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder
