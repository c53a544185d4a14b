"""Captures of simple bodies, drawn from their formulas: no files, no renderer."""

from collections.abc import Callable

import numpy as np

from core.camera import Camera
from core.capture import WHITE, Capture, View
from tests.scenes import look_at_camera

# Opacity and colour at the pixels: (origin [3], directions [h, w, 3]) -> (alpha [h, w], colour [h, w, 3]).
Body = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def ring_cameras(count: int, size_px: int, radius: float = 4.0) -> list[Camera]:
    """Cameras around the origin, from below to above, evenly spread."""
    turn = np.arange(count) * 2.399963  # the golden angle
    z = np.linspace(-0.6, 0.8, count)
    across = np.sqrt(1 - z**2)
    places = radius * np.stack([across * np.cos(turn), across * np.sin(turn), z], -1)
    return [look_at_camera(f"view {i}", place, size_px=(size_px, size_px)) for i, place in enumerate(places)]


def capture_of(body: Body, *, views: int = 10, held_out: int = 2, size_px: int = 32, alpha: bool = True) -> Capture:
    """Photos of a body over white, with or without an alpha channel."""
    photos = [View(camera, photo_of(body, camera, alpha)) for camera in ring_cameras(views + held_out, size_px)]
    held = {round(place) for place in np.linspace(1, len(photos) - 2, held_out)}
    train = tuple(view for index, view in enumerate(photos) if index not in held)
    return Capture(train, tuple(photos[index] for index in sorted(held)), WHITE)


def photo_of(body: Body, camera: Camera, alpha: bool = True) -> np.ndarray:
    """uint8 [h, w, 4], or [h, w, 3] over white."""
    opacity, color = body(camera.position, camera.directions(camera.pixel_centres()))
    image = np.rint(np.concatenate([color, opacity[..., None]], -1) * 255).astype(np.uint8)
    if alpha:
        return image
    return np.where(opacity[..., None] > 0, image[..., :3], np.uint8(255))


def ball(color=None, radius: float = 0.8, centre=(0.0, 0.0, 0.0)) -> Body:
    """A ball: of one colour, or coloured by its normals."""

    def look(origin: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        away = origin - np.array(centre)
        b = directions @ away
        root = b**2 - (away @ away - radius**2)
        hit = root > 0
        t = -b - np.sqrt(np.maximum(root, 0.0))
        normals = (away + t[..., None] * directions) / radius
        paint = 0.5 + 0.45 * normals if color is None else np.broadcast_to(color, directions.shape)
        return hit.astype(float), np.where(hit[..., None], paint, 0.0)

    return look
