"""How well a baked scene shows the photos: the figures that papers report."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.baked import BakedScene
from core.camera import Camera
from core.capture import View
from core.metrics import psnr, ssim
from core.progress import Progress, ProgressCallback, ignore_progress
from core.render.composite import over, quantised
from core.render.raster import Rasteriser

FULL_ERROR = 0.25  # the mean absolute difference of a pixel that the error map shows as white


@dataclass(frozen=True)
class ViewScore:
    """One view's photo against its render.

    Attributes:
        name: the photo's.
        psnr: dB; infinite when equal.
        ssim: at most 1.
    """

    name: str
    psnr: float
    ssim: float


@dataclass(frozen=True)
class Evaluation:
    """Scores of some views. The means are over views, as in the papers; None without any view."""

    views: tuple[ViewScore, ...]

    @property
    def psnr(self) -> float | None:
        return float(np.mean([view.psnr for view in self.views])) if self.views else None

    @property
    def ssim(self) -> float | None:
        return float(np.mean([view.ssim for view in self.views])) if self.views else None


def evaluate(
    scene: BakedScene,
    views: Sequence[View],
    *,
    device: str = "cpu",
    progress: ProgressCallback = ignore_progress,
) -> Evaluation:
    """Renders every view as the product shows it (deferred, 8 bit) and compares it with the photo.

    Both are over the scene's background. Pixels that a mask takes out do not count, and a photo that has no others is
    passed over. `progress` is told the stage "measure", the fraction of the views (a caller
    with more to do rescales it) and the mean PSNR so far.
    """
    rasteriser = Rasteriser(scene, device)
    scores: list[ViewScore] = []
    for done, view in enumerate(views, start=1):
        if view.ignored is None or not view.ignored.all():
            scores.append(_score(rasteriser, view))
        progress(Progress("measure", done / len(views), Evaluation(tuple(scores)).psnr))
    return Evaluation(tuple(scores))


def _score(rasteriser: Rasteriser, view: View) -> ViewScore:
    photo, rendered = view.over(rasteriser.scene.background), _rendered(rasteriser, view.camera) / 255.0
    images = (photo, rendered, view.ignored)
    return ViewScore(view.camera.name, psnr(*images), ssim(*images))


def comparison_picture(scene: BakedScene, view: View, *, device: str = "cpu") -> np.ndarray:
    """[h, 3 w, 3] uint8, for a person to look at: photo, render, error map (black none, then red, yellow, white)."""
    rendered = _rendered(Rasteriser(scene, device), view.camera)
    photo = quantised(view.over(scene.background))
    error = np.abs(photo.astype(np.float64) - rendered).mean(-1) / 255.0
    heat = np.clip(3.0 * error[..., None] / FULL_ERROR - [0.0, 1.0, 2.0], 0.0, 1.0)
    return np.concatenate([photo, rendered, quantised(heat)], 1)


def _rendered(rasteriser: Rasteriser, camera: Camera) -> np.ndarray:
    return quantised(over(rasteriser.deferred(camera), rasteriser.scene.background))
