"""Stage 3 (paper 3.3): from trained texels to a BakedScene that holds only what is seen."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from core.baked import BakedScene
from core.baking.background import background_of
from core.baking.pages import pack_pages, patches_of
from core.baking.seen import look_from
from core.baking.start import start_camera
from core.camera import Camera
from core.capture import Capture
from core.conventions import bytes_from_features
from core.errors import TrainingFailed
from core.field.frame import Frame
from core.field.network import baked_network
from core.training.texel_stage import TexelStage

OPAQUE_FROM = 0.5
SHIPPED_CAMERAS = 8  # views to start from; more only make the file longer


def bake(stage: TexelStage, capture: Capture, frame: Frame, report: Callable[[float], None]) -> BakedScene:
    """The scene of a finished texel stage: quads that some training photo sees, 8 bits a feature.

    Raises:
        TrainingFailed: no photo sees any quad.
    """
    everything = quick_bake(stage, capture, frame)
    cameras = [view.camera for view in capture.train]
    K = stage.settings.patch

    def shader(features: Tensor, directions: Tensor) -> Tensor:
        return torch.sigmoid(stage.network(torch.cat([features, directions], -1)))

    seen = look_from(everything, cameras, shader, device=stage.device, seed=stage.seed, report=report)
    counts = [len(page.triangles) // 2 for page in everything.pages]
    visible = patches_of(seen.texels, counts, K)
    keep = visible.any((1, 2))
    if not keep.any():
        raise TrainingFailed(
            "baking", "some quad must be seen by a training photo", "none", "Check the poses and the background."
        )
    features_u8 = patches_of([page.features_u8 for page in everything.pages], counts, K)[keep]
    colors = patches_of(seen.colors, counts, K)[keep]
    colors = _filled(colors, visible[keep], features_u8, mean_colors(stage, features_u8))
    corners = frame.to_object(_corners(stage)[keep])
    pages = pack_pages(corners, features_u8, colors)
    shipped = _shipped_cameras(capture)
    return replace(everything, pages=pages, cameras=shipped, start_camera=start_camera(shipped, capture.kind.name))


def quick_bake(stage: TexelStage, capture: Capture, frame: Frame) -> BakedScene:
    """The scene as it stands, with every quad and without colours: for previews, and to see what is seen."""
    K = stage.settings.patch
    shape = (len(stage.mesh.quads), K, K)
    opaque = (stage.parameters.scalar > OPAQUE_FROM).cpu().numpy().reshape(shape)
    features = stage.parameters.features.cpu().numpy().reshape(*shape, -1)
    features_u8 = bytes_from_features(features, opaque)
    pages = pack_pages(frame.to_object(_corners(stage)), features_u8, np.zeros((*shape, 3), np.uint8))
    return BakedScene(
        pages,
        baked_network(stage.network),
        background_of(capture),
        capture.asset_from_object,
        user_from_object=capture.user_from_object,
    )


def mean_colors(stage: TexelStage, features_u8: np.ndarray) -> np.ndarray:
    """[Q, K, K, 3] float32: each texel's colour for the mean of six directions; for texels that no photo sees."""
    axes = torch.cat([torch.eye(3), -torch.eye(3)]).to(stage.device)
    features = torch.from_numpy(features_u8.reshape(-1, 8)).to(stage.device)
    total = torch.zeros(len(features), 3, device=stage.device)
    with torch.no_grad():
        for some in torch.arange(len(features), device=stage.device).split(1 << 18):
            x = features[some].float() / 255.0
            for axis in axes:
                total[some] += torch.sigmoid(stage.network(torch.cat([x, axis.expand(len(x), 3)], -1))) / len(axes)
    return total.cpu().numpy().reshape(*features_u8.shape[:3], 3)


def _filled(colors: np.ndarray, visible: np.ndarray, features_u8: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """uint8 colours: seen texels as seen, other opaque ones as guessed, holes black."""
    known = visible & np.isfinite(colors).all(-1)
    filled = np.where(known[..., None], colors, guess)
    opaque = features_u8[..., 0] > 0
    return np.where(opaque[..., None], np.rint(np.clip(filled, 0, 1) * 255), 0).astype(np.uint8)


def _corners(stage: TexelStage) -> np.ndarray:
    return stage.mesh.vertices.detach().cpu().numpy()[stage.mesh.quads].astype(np.float64)


def _shipped_cameras(capture: Capture) -> tuple[Camera, ...]:
    """A few held-out views (or training views where none is held out), evenly spread over their order."""
    views: Sequence = capture.test or capture.train
    chosen = np.unique(np.linspace(0, len(views) - 1, SHIPPED_CAMERAS).round().astype(int))
    return tuple(views[i].camera for i in chosen)
