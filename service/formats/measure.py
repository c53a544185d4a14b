"""How well a deliverable shows the photos that are held out: measured on the file, read again."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.baked import BakedScene, similarity_scale
from core.capture import Capture, View
from core.evaluation import evaluate
from core.metrics import psnr
from core.progress import Progress, ProgressCallback, ignore_progress
from core.render.composite import over, quantised
from service.formats.colours import Coloured, ColourRenderer

BEST_PSNR = 100.0  # what an infinite one is reported as: JSON has no infinity


class Measure:
    """Measures scenes on the same views. Of two that are the same to the bit, only the first is rendered.

    Args:
        views: held out; at least one, each with pixels that no mask takes out.
        user_from_object: of the views' frame.
        background: sRGB in [0, 1], that photos and renders are shown over.
        device: of the rasteriser.
    """

    def __init__(
        self,
        views: Sequence[View],
        user_from_object: np.ndarray,
        background: tuple[float, float, float],
        device: str = "cpu",
    ) -> None:
        self._views, self._user_from_object, self._background = tuple(views), user_from_object, background
        self._device = device
        self._known: dict[str, float] = {}

    @classmethod
    def on(cls, capture: Capture, background: tuple[float, float, float], device: str) -> "Measure | None":
        """On the capture's held-out views; None where there are none, or masks take out all of them."""
        views = [view for view in capture.test if view.ignored is None or not view.ignored.all()]
        return cls(views, capture.user_from_object, background, device) if views else None

    def remember(self, scene: BakedScene, mean_psnr: float) -> None:
        """That this scene has been measured on these views already."""
        self._known[_digest(scene)] = mean_psnr

    def psnr(
        self, held: BakedScene | Coloured, exported: BakedScene, progress: ProgressCallback = ignore_progress
    ) -> float:
        """Mean over the views, dB, at most 100.

        Args:
            held: what was read from the file.
            exported: what it was made of.
        """
        if isinstance(held, Coloured):
            user_from_held = exported.user_from_object
            if held.frame == "asset":
                user_from_held = user_from_held @ np.linalg.inv(exported.asset_from_object)
            return min(self._psnr_of_colours(held, self._seen_by(user_from_held), progress), BEST_PSNR)
        digest = _digest(held)
        if digest not in self._known:
            shown = replace(held, background=self._background)
            mean = evaluate(shown, self._seen_by(held.user_from_object), device=self._device, progress=progress).psnr
            assert mean is not None
            self._known[digest] = min(mean, BEST_PSNR)
        return self._known[digest]

    def _psnr_of_colours(self, held: Coloured, views: Sequence[View], progress: ProgressCallback) -> float:
        renderer = ColourRenderer(held, self._device)
        found: list[float] = []
        for done, view in enumerate(views, start=1):
            image = quantised(over(renderer.image(view.camera), self._background)) / 255.0
            found.append(psnr(view.over(self._background), image, view.ignored))
            progress(Progress("measure", done / len(views), float(np.mean(found))))
        return float(np.mean(found))

    def _seen_by(self, user_from_held: np.ndarray) -> tuple[View, ...]:
        return in_frame(self._views, self._user_from_object, user_from_held)


def in_frame(views: Sequence[View], user_from_object: np.ndarray, user_from_other: np.ndarray) -> tuple[View, ...]:
    """Views of one object frame in another, whose place and size may differ."""
    if np.array_equal(user_from_object, user_from_other):
        return tuple(views)
    return tuple(_moved(view, np.linalg.inv(user_from_other) @ user_from_object) for view in views)


def _moved(view: View, matrix: np.ndarray) -> View:
    pose = matrix @ view.camera.world_from_camera
    pose[:3, :3] /= similarity_scale(matrix)
    return replace(view, camera=replace(view.camera, world_from_camera=pose))


def _digest(scene: BakedScene) -> str:
    """Of all that a picture from a camera of the user's frame depends on."""
    digest = hashlib.sha256()
    for page in scene.pages:
        for array in (page.features_u8, page.positions, page.texcoords, page.triangles):
            digest.update(str((array.dtype, array.shape)).encode())
            digest.update(np.ascontiguousarray(array).data)
    for array in (*scene.network.weights, *scene.network.biases, scene.user_from_object):
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()
