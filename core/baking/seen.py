"""What the training photos see of a baked scene: which texels, and in which colours."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from core.baked import BakedScene
from core.camera import Camera
from core.render.raster import Rasteriser
from core.render.visibility import subpixel_camera

# A colour is a mean over directions; a share of the photos' samples gives the same mean.
COLOR_SAMPLES_PER_VIEW = 100_000


@dataclass(frozen=True)
class Seen:
    """Per page: whether each texel is seen [h, w] (bool), and its mean colour [h, w, 3] (float32, sRGB), NaN unseen."""

    texels: tuple[np.ndarray, ...]
    colors: tuple[np.ndarray, ...]


def look_from(
    scene: BakedScene,
    cameras: Sequence[Camera],
    shader: Callable[[Tensor, Tensor], Tensor],
    *,
    device: str,
    seed: int,
    report: Callable[[float], None],
) -> Seen:
    """Renders the scene from each camera.

    Args:
        shader: (features [n, 8], directions [n, 3]) -> sRGB [n, 3].
        report: called with the share that is done.
    """
    rasteriser = Rasteriser(scene, device)
    seen = [np.zeros(page.features_u8.shape[:2], bool) for page in scene.pages]
    sums = [np.zeros((*mask.shape, 4)) for mask in seen]
    rng = np.random.default_rng([seed, 3])
    for done, camera in enumerate(cameras):
        samples = subpixel_camera(camera)
        view = rasteriser.visibility(samples)
        rows, columns = np.nonzero(view.hit)
        drawn = rng.random(len(rows)) < COLOR_SAMPLES_PER_VIEW / max(len(rows), 1)
        directions = samples.directions(np.stack([columns[drawn], rows[drawn]], -1) + 0.5)
        page_of = view.page[rows, columns]
        texel_row, texel_column = view.row[rows, columns], view.column[rows, columns]
        for index, page in enumerate(scene.pages):
            here = page_of == index
            seen[index][texel_row[here], texel_column[here]] = True
            some = here[drawn]
            y, x = texel_row[drawn][some], texel_column[drawn][some]
            colors = _shaded(page.features_u8[y, x], directions[some], shader, device)
            np.add.at(sums[index], (y, x), np.column_stack([colors, np.ones(len(colors))]))
        report((done + 1) / len(cameras))
    with np.errstate(invalid="ignore"):
        means = tuple((total[..., :3] / total[..., 3:]).astype(np.float32) for total in sums)
    return Seen(tuple(seen), means)


def _shaded(
    features_u8: np.ndarray, directions: np.ndarray, shader: Callable[[Tensor, Tensor], Tensor], device: str
) -> np.ndarray:
    features = torch.from_numpy(features_u8).to(device).float() / 255.0
    with torch.no_grad():
        return shader(features, torch.from_numpy(directions.astype(np.float32)).to(device)).cpu().numpy()
