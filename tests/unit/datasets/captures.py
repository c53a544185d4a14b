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


def colmap_image(index: int) -> tuple[np.ndarray, np.ndarray]:
    """(camera_from_world rotation [3, 3], translation [3]) with OpenCV axes, of the camera that `pose(index)` is."""
    opengl = np.array(pose(index))
    rotation = (opengl[:3, :3] * [1, -1, -1]).T
    return rotation, -rotation @ opengl[:3, 3]


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """(w, x, y, z) of a rotation [3, 3]: the eigenvector of Bar-Itzhack's matrix, which has no special cases."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    matrix = [
        [xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, yy - xx - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, zz - xx - yy],
    ]
    return np.linalg.eigh(np.array(matrix))[1][:, -1]


def colmap_model(folder: Path, names: list[str], camera="PINHOLE 8 6 10 11 4.25 2.75", points=20) -> Path:
    """A sparse model as text: every point is around the origin and seen by every image."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cameras.txt").write_text(f"# a comment\n1 {camera}\n")
    images = ["# a comment"]
    for index, name in enumerate(names):
        rotation, translation = colmap_image(index)
        numbers = " ".join(repr(float(value)) for value in (*quaternion(rotation), *translation))
        images += [f"{index + 1} {numbers} 1 {name}", "1.5 2.5 1" if index % 2 else ""]
    (folder / "images.txt").write_text("\n".join(images) + "\n")
    positions = np.random.default_rng(0).uniform(-1, 1, (points, 3))
    track = " ".join(f"{index + 1} 0" for index in range(len(names)))
    lines = [f"{i} {x!r} {y!r} {z!r} 9 9 9 0.5 {track}" for i, (x, y, z) in enumerate(positions.tolist())]
    (folder / "points3D.txt").write_text("\n".join(lines) + "\n")
    return folder


def colmap(folder: Path, count=10, size=(8, 6), model="sparse/0", photos="images", **options) -> Path:
    """A COLMAP capture."""
    names = [f"{index:04}.png" for index in range(count)]
    for name in names:
        write_photo(folder / photos / name, size, "RGB")
    colmap_model(folder / model, names, **options)
    return folder


def llff_rows(count=10, full_size=(32, 24)) -> np.ndarray:
    """The content of a poses_bounds.npy: axes (down, right, backwards), position, (height, width, focal), bounds."""
    rows = []
    for index in range(count):
        right, up, back, position = np.array(pose(index))[:3].T
        matrix = np.stack([-up, right, back, position, [full_size[1], full_size[0], 40.0]], 1)
        rows.append([*matrix.ravel(), 1.0 + 0.1 * index, 20.0])
    return np.array(rows)


def llff(folder: Path, count=10, photos=("images_4",), full_size=(32, 24)) -> Path:
    """An LLFF capture with some of its folders of photos."""
    for name in photos:
        scale = int(name.partition("_")[2] or 1)
        for index in range(count):
            write_photo(folder / name / f"image{index:03}.png", (full_size[0] // scale, full_size[1] // scale), "RGB")
    np.save(folder / "poses_bounds.npy", llff_rows(count, full_size))
    return folder
