"""Stage 3 of the paper: K x K texels for each quad that a training photo sees."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from benchmarks.reference_setting.training import PaperRun
from core.baked import BakedScene
from core.baking.pages import pack_pages
from core.conventions import FEATURE_CHANNELS, bytes_from_features
from core.errors import TrainingFailed
from core.field.network import baked_network
from core.mesh.quad_mesh import patch_weights
from core.render.raster import Rasteriser
from core.render.visibility import subpixel_camera

POINTS_AT_ONCE = 1 << 18
HOPEFUL = 0.05


@dataclass(frozen=True)
class _Quads:
    """Quads with their texels: corners [n, 4, 3] in the cube and opacity [n, K, K] (bool)."""

    corners: Tensor
    opaque: Tensor

    def those(self, index: Tensor) -> "_Quads":
        return _Quads(self.corners[index], self.opaque[index])


@torch.no_grad()
def bake_paper(run: PaperRun) -> BakedScene:
    """The scene as it stands.

    Raises:
        TrainingFailed: no quad is opaque anywhere, or none is seen.
    """
    quads = _opaque_quads(run)
    seen = _seen(run, quads)
    if len(seen) == 0:
        raise TrainingFailed("paper's setting", "some quad must be seen", "an empty scene", "Train it for longer.")
    visible = quads.those(seen)
    features = _texel_values(run.networks.features, visible.corners, run.setting.patch)
    features_u8 = bytes_from_features(features.cpu().numpy(), visible.opaque.cpu().numpy())
    return _scene(run, visible, features_u8, _mean_colors(run, features_u8))


def _opaque_quads(run: PaperRun) -> _Quads:
    """All quads between cells that G keeps (all cells where it does not prune) that are opaque somewhere."""
    K, kept = run.setting.patch, []
    for quads in _hopeful_quads(run).split(max(POINTS_AT_ONCE // K**2, 1)):
        corners = run.mesh.vertex(quads)
        opaque = _texel_values(run.networks.opacity, corners, K) > 0.5
        some = opaque.flatten(1).any(1)
        kept.append(_Quads(corners[some], opaque[some]))
    if not sum(len(part.corners) for part in kept):
        raise TrainingFailed("paper's setting", "some texel must be opaque", "an empty scene", "Train it for longer.")
    return _Quads(torch.cat([part.corners for part in kept]), torch.cat([part.opaque for part in kept]))


def _hopeful_quads(run: PaperRun) -> Tensor:
    """[n, 4]: the quads that are not almost transparent at corners and middle. Saves most of the work."""
    cells = run.mesh.cells**3
    wanted = run.grid.nonempty() if run.setting.prune else torch.ones(cells, dtype=torch.bool, device=run.device)
    quads = run.mesh.quads(wanted)
    used, place = quads.unique(return_inverse=True)
    at_corners = _in_parts(run.networks.opacity, run.mesh.vertex(used))[place].amax(1)
    in_the_middle = _in_parts(run.networks.opacity, run.mesh.vertex(quads).mean(1))
    return quads[torch.maximum(at_corners, in_the_middle) > HOPEFUL]


def _in_parts(network: Callable[[Tensor], Tensor], points: Tensor) -> Tensor:
    return torch.cat([network(some) for some in points.split(POINTS_AT_ONCE)])


def _texel_values(network: Callable[[Tensor], Tensor], corners: Tensor, K: int) -> Tensor:
    """A network's values [n, K, K, ...] at the texel centres of quads [n, 4, 3]."""
    weights = torch.from_numpy(patch_weights(K).astype(np.float32)).to(corners.device)
    points = torch.einsum("abk,qkd->qabd", weights, corners).reshape(-1, 3)
    values = _in_parts(network, points)
    return values.reshape(len(corners), K, K, *values.shape[1:])


def _seen(run: PaperRun, quads: _Quads) -> Tensor:
    """Indices of the quads that some training photo sees."""
    opaque = quads.opaque.cpu().numpy()
    blank = np.repeat(opaque[..., None].astype(np.uint8), FEATURE_CHANNELS, -1)
    scene = _scene(run, quads, blank, np.zeros((*opaque.shape, 3), np.uint8))
    rasteriser = Rasteriser(scene, run.device)
    first_quad = np.cumsum([0, *(len(page.triangles) // 2 for page in scene.pages)])
    seen = np.zeros(first_quad[-1], bool)
    for view in run.capture.train:
        view_of = rasteriser.visibility(subpixel_camera(view.camera))
        hit = view_of.hit
        seen[first_quad[view_of.page[hit]] + view_of.triangle[hit] // 2] = True
    return torch.from_numpy(np.flatnonzero(seen)).to(run.device)


def _mean_colors(run: PaperRun, features_u8: np.ndarray) -> np.ndarray:
    """[n, K, K, 3] uint8 colours for viewers without the network: means over six directions."""
    texels = torch.from_numpy(features_u8.reshape(-1, 8)).to(run.device)
    axes = torch.cat([torch.eye(3), -torch.eye(3)]).to(run.device)
    parts = []
    for some in texels.split(POINTS_AT_ONCE):
        features = some.float() / 255.0
        shades = [run.networks.color(features, axis.expand(len(features), 3)) for axis in axes]
        parts.append(torch.stack(shades).mean(0) * (some[:, :1] > 0))
    colors = torch.cat(parts).reshape(*features_u8.shape[:3], 3)
    return (colors * 255.0).round().to(torch.uint8).cpu().numpy()


def _scene(run: PaperRun, quads: _Quads, features_u8: np.ndarray, colors_u8: np.ndarray) -> BakedScene:
    corners = run.cube.to_object(quads.corners.cpu().numpy().astype(np.float64))
    capture = run.capture
    pages = pack_pages(corners, features_u8, colors_u8)
    return BakedScene(pages, baked_network(run.networks.H), capture.background, capture.asset_from_object)
