"""Small captures on disk, right in every respect until a test spoils them."""

import json
from pathlib import Path

import numpy as np
from PIL import Image


def pose(index: int = 0) -> list[list[float]]:
    """A rigid camera-to-world matrix on an orbit."""
    angle = 0.7 * index
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return [[c, 0.0, s, 4 * s], [0.0, 1.0, 0.0, 0.5], [-s, 0.0, c, 4 * c], [0.0, 0.0, 0.0, 1.0]]


def write_photo(path: Path, size=(8, 6), mode="RGBA", colour=(200, 120, 40, 180)) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new(mode, size, colour[: len(mode)]).save(path)


def write_json(path: Path, content: object) -> None:
    path.write_text(json.dumps(content))


def synthetic(folder: Path, train=4, test=2, size=(8, 6)) -> Path:
    """A NeRF-synthetic capture."""
    for split, count in (("train", train), ("test", test)):
        frames = []
        for index in range(count):
            write_photo(folder / split / f"r_{index}.png", size)
            frames.append({"file_path": f"./{split}/r_{index}", "rotation": 0.01, "transform_matrix": pose(index)})
        if count:
            write_json(folder / f"transforms_{split}.json", {"camera_angle_x": 0.69, "frames": frames})
    return folder


def nerfstudio_fields(count=10, size=(8, 6)) -> dict:
    """The content of a transforms.json."""
    return {
        "fl_x": 10.0, "fl_y": 11.0, "cx": 4.25, "cy": 2.75, "w": size[0], "h": float(size[1]), "aabb_scale": 4,
        "frames": [{"file_path": f"images/{i:04}.png", "transform_matrix": pose(i)} for i in range(count)],
    }  # fmt: skip


def nerfstudio(folder: Path, count=10, size=(8, 6), mode="RGB", **changes) -> Path:
    """A nerfstudio capture, with top-level fields changed (None removes one)."""
    for index in range(count):
        write_photo(folder / f"images/{index:04}.png", size, mode)
    fields = {**nerfstudio_fields(count, size), **changes}
    write_json(folder / "transforms.json", {key: value for key, value in fields.items() if value is not None})
    return folder


def change_frame(folder: Path, index: int, **changes) -> Path:
    """Changes fields of one frame of a nerfstudio capture."""
    path = folder / "transforms.json"
    fields = json.loads(path.read_text())
    fields["frames"][index].update(changes)
    write_json(path, fields)
    return folder
