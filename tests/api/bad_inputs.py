"""Every input that must be refused, and how: one list for the API and the command line."""

import stat
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from io import BytesIO

import numpy as np

from tests.api.captures import Files, as_json, ball, capture_files, huge_png, png, with_frame, zipped

NAN = float("nan")


@dataclass(frozen=True)
class BadInput:
    """One way to be wrong.

    Attributes:
        files: makes the upload.
        code, status: of the problem.
        culprit: words that its message must contain.
        decoded: whether it shows only once the photos are decoded, in the job.
        options: form fields.
    """

    files: Callable[[], Files]
    code: str
    status: int
    culprit: tuple[str, ...]
    decoded: bool = False
    options: dict[str, str] = field(default_factory=dict)


def _no_images() -> Files:
    return {name: data for name, data in capture_files().items() if name.endswith(".json")}


def _two_photos() -> Files:
    return {name: data for name, data in capture_files(train=2, test=0).items() if name.endswith(".png")}


def _missing_image() -> Files:
    return {name: data for name, data in capture_files().items() if name != "train/r_3.png"}


def _truncated() -> Files:
    files = capture_files(size_px=64)
    return files | {"train/r_3.png": files["train/r_3.png"][:-200]}


def _text_as_png() -> Files:
    return capture_files() | {"train/r_3.png": b"This is not a picture.\n"}


def _size_mismatch() -> Files:
    """nerfstudio's shared intrinsics state one size for all."""
    poses = np.eye(4).tolist()
    frames = [{"file_path": f"images/{i}.png", "transform_matrix": poses} for i in range(4)]
    shared = {"fl_x": 20.0, "fl_y": 20.0, "cx": 8.0, "cy": 8.0, "w": 16, "h": 16, "frames": frames}
    photos = {f"images/{i}.png": png(ball(16 if i != 2 else 24)) for i in range(4)}
    return {"transforms.json": as_json(shared)} | photos


def _named(name: str) -> Callable[[], Files]:
    return lambda: {"capture.zip": zipped(capture_files() | {name: b"x"})}


def _link() -> Files:
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        link = zipfile.ZipInfo("train/r_0.png")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    return {"capture.zip": buffer.getvalue()}


def _bomb() -> Files:
    return {"capture.zip": zipped(capture_files() | {"train/zeros.png": bytes(30 << 20)})}


def _pose(**entries: float) -> Callable[[], Files]:
    def files() -> Files:
        pose = np.eye(4)
        for name, value in entries.items():
            pose[int(name[1]), int(name[2])] = value
        return with_frame(capture_files(), 3, transform_matrix=pose.tolist())

    return files


def _transparent() -> Files:
    files = capture_files()
    return files | {name: png(np.zeros((16, 16, 4), np.uint8)) for name in files if name.endswith(".png")}


BAD_INPUTS = {
    "no images": BadInput(_no_images, "no-images", 422, ("photos",)),
    "two photos without poses": BadInput(_two_photos, "too-few-images", 422, ("at least 3", "2 of 2")),
    "missing image": BadInput(_missing_image, "image-missing", 422, ("r_3",)),
    "truncated PNG": BadInput(_truncated, "image-undecodable", 422, ("r_3",), decoded=True),
    "text as PNG": BadInput(_text_as_png, "image-undecodable", 422, ("r_3",)),
    "sizes differ": BadInput(_size_mismatch, "image-size-mismatch", 422, ("2.png", "24")),
    "zip with ..": BadInput(_named("../evil.png"), "archive-unsafe", 422, ("../evil.png",)),
    "zip with absolute name": BadInput(_named("/evil.png"), "archive-unsafe", 422, ("/evil.png",)),
    "zip with backslash": BadInput(_named("train\\evil.png"), "archive-unsafe", 422, ("evil.png",)),
    "zip with drive": BadInput(_named("C:evil.png"), "archive-unsafe", 422, ("C:evil.png",)),
    "zip with link": BadInput(_link, "archive-unsafe", 422, ("r_0.png", "link")),
    "zip bomb": BadInput(_bomb, "archive-too-large", 413, ("zeros.png",)),
    "not a zip": BadInput(lambda: {"capture.zip": b"PK but no"}, "archive-invalid", 422, ("capture.zip",)),
    "huge PNG": BadInput(
        lambda: capture_files() | {"train/r_3.png": huge_png()}, "image-too-large", 413, ("r_3", "megapixels")
    ),
    "NaN in a pose": BadInput(_pose(m03=NAN), "pose-not-finite", 422, ("r_3",)),
    "non-rigid pose": BadInput(_pose(m00=2.0), "pose-not-rigid", 422, ("r_3",)),
    "one photo": BadInput(lambda: capture_files(train=1, test=0), "too-few-images", 422, ("1",)),
    "all transparent": BadInput(_transparent, "capture-empty", 422, ("transparent",), decoded=True),
    "unknown preset": BadInput(capture_files, "unknown-preset", 422, ("best",), options={"preset": "best"}),
    "unknown setting": BadInput(capture_files, "option-invalid", 422, ("colour",), options={"set": "colour=1"}),
    "unknown format": BadInput(capture_files, "unknown-format", 422, ("fbx",), options={"formats": "web,fbx"}),
    "bad seed": BadInput(capture_files, "option-invalid", 422, ("seed",), options={"seed": "many"}),
}
