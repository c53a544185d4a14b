"""What `benchmarks.ablate` takes away: the rows of the paper's Table 6, as far as they have a counterpart here.

Where there is no setting for it, a row replaces a constant or a function of the trainer while it runs.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor, nn

import core.reconstruct as reconstruct_module
from benchmarks.patching import replaced
from core.conventions import FEATURE_CHANNELS
from core.field.region import Region
from core.field.voxels import VoxelField
from core.mesh import quad_mesh
from core.presets import Settings
from core.training import field_stage, pixels, surfacing, texel_stage, vertices
from core.training.tracer import Tracer
from core.training.voxel_stage import VoxelStage

# The full method's PSNR after each stage in the paper's Table 6, Synthetic 360.
STAGE1, STAGE2, STAGE3 = 32.13, 31.01, 30.90
FULL = "the full method"
# Of the binary loss, per hit, beside gradients of the colour's error that are 0.01 to 0.1 where something is wrong.
BINARY_LOSS_WEIGHT = 0.01


@dataclass(frozen=True)
class Ablation:
    """One row.

    Attributes:
        name: what is different.
        paper_delta: dB of difference in the paper's Table 6 on Synthetic 360 scenes, against the same stage of the full
            method; None where the paper has no such row.
        against: the row that it is compared with.
        why: of the result, where its sign is not the paper's, or where the row means something else here.
        settings: the settings of the row, from those of the full method.
        within: a context in which to train.
        forward: the asset is measured with one sample a pixel.
    """

    name: str
    paper_delta: float | None = None
    against: str = FULL
    why: str = ""
    settings: Callable[[Settings], Mapping[str, Any]] = field(default=lambda base: {})
    within: Callable[[], AbstractContextManager[Any]] = nullcontext
    forward: bool = False


@contextmanager
def _constants(*changes: tuple[Any, str, Any]) -> Iterator[None]:
    with ExitStack() as stack:
        for owner, name, value in changes:
            stack.enter_context(replaced(owner, name, value))
        yield


def _fixed_grid() -> AbstractContextManager[None]:
    """Vertices stay in their cells' centres."""
    return _constants(*((module, "VERTEX_REACH", 0.0) for module in (quad_mesh, surfacing, vertices)))


def _placed_vertices() -> AbstractContextManager[None]:
    """Vertices stay where the survey puts them."""
    return _constants((field_stage, "VERTEX_RATE", 0.0), (texel_stage, "VERTEX_RATE", 0.0))


@contextmanager
def _no_directions() -> Iterator[None]:
    """The network's weights on the direction are zero and stay so."""
    make = reconstruct_module.new_network

    def blind(seed: int) -> nn.Sequential:
        network = make(seed)
        weight = network[0].weight
        seeing = torch.ones_like(weight)
        seeing[:, FEATURE_CHANNELS:] = 0.0
        with torch.no_grad():
            weight.mul_(seeing)
        weight.register_hook(lambda gradient: gradient * seeing.to(gradient.device))
        return network

    with replaced(reconstruct_module, "new_network", blind):
        yield


@contextmanager
def _nothing_skipped() -> Iterator[None]:
    """The whole grid is occupied, whatever the photos' alpha or the field's density say."""
    find = reconstruct_module.find_region

    def whole(capture: Any) -> Region:
        region = find(capture)
        return Region(region.frame, np.ones_like(region.hull), region.space)

    with (
        replaced(reconstruct_module, "find_region", whole),
        replaced(VoxelField, "update_occupancy", lambda *_: None),
        replaced(VoxelStage, "_update_occupancy", lambda *_: None),
    ):
        yield


def _never_frozen() -> AbstractContextManager[None]:
    """Both models and opacity train to the last step."""
    return _constants((texel_stage, "CONTINUOUS_UNTIL", 1.0), (texel_stage, "OPACITY_UNTIL", 1.0))


def _binary_only() -> AbstractContextManager[None]:
    """The binary model alone, with gradients straight through, from the mesh's first step on."""
    return _constants((field_stage, "BINARY_SHARE", (1.0, 1.0)), (texel_stage, "CONTINUOUS_UNTIL", 0.0))


@contextmanager
def _binary_loss() -> Iterator[None]:
    """The continuous model alone, and a loss that draws every hit's opacity away from 0.5: - sum |alpha - 0.5|."""
    backward = Tracer.backward

    def with_loss(tracer: Tracer, batch: Any, surface: Any, soft: Any, hard: Any, gradients: Any, parts: int) -> None:
        backward(tracer, batch, surface, soft, tuple(torch.zeros_like(part) for part in hard), gradients, parts)
        away = wp.to_torch(gradients.alpha)
        touched = (away != 0).any(0)
        alpha = wp.to_torch(surface.alpha)
        if hasattr(gradients, "row_of"):  # of a volume, only some nodes train
            alpha = alpha[wp.to_torch(gradients.row_of) >= 0]
        away[0] -= BINARY_LOSS_WEIGHT * touched * _sign(alpha - 0.5)

    never = 1e9
    changes = (
        (field_stage, "BINARY_SHARE", (0.0, 0.0)),
        (texel_stage, "CONTINUOUS_UNTIL", never),
        (texel_stage, "LEAST_BINARY_SHARE", 0.0),
    )
    with replaced(Tracer, "backward", with_loss), _constants(*changes):
        yield


def _sign(x: Tensor) -> Tensor:
    return torch.where(x < 0, -1.0, 1.0)


def _one_subray() -> AbstractContextManager[None]:
    return _constants((texel_stage, "SUBRAYS", 1), (pixels, "SUBPIXEL_OFFSETS_PX", np.zeros((1, 2))))


def _patch(K: int) -> Callable[[Settings], Mapping[str, Any]]:
    return lambda base: {"patch": K}


K17 = "K = 17, the paper's"

ABLATIONS = (
    Ablation(FULL),
    Ablation(
        "fixed grid: vertices in the middle of their cells",
        29.87 - STAGE1,
        within=_fixed_grid,
        why="at 100 px the texels' opacity makes the shape; at 400 px it costs 0.5 dB (docs/training.md)",
    ),
    Ablation(
        "vertices placed by the survey, not trained",
        within=_placed_vertices,
        why="the places that the survey finds need training: alone they are worse than the cells' middle",
    ),
    Ablation("no view dependence", 29.91 - STAGE1, within=_no_directions),
    Ablation("half P", 31.58 - STAGE1, settings=lambda base: {"cells": base.cells // 2}),
    Ablation(
        "no acceleration grid: empty space is marched and trained",
        31.77 - STAGE1,
        within=_nothing_skipped,
        why="here the grid is also what the photos' alpha knows to be empty",
    ),
    Ablation(
        "no fine-tuning: both models and opacity train to the end",
        30.80 - STAGE2,
        within=_never_frozen,
        why="0.05 dB, within what a seed changes; frozen opacity makes training 15 % faster",
    ),
    Ablation("no texel stage: baked from the field", settings=lambda base: {"texel_steps": 1}),
    Ablation("pseudo-gradients only", 29.70 - STAGE2, within=_binary_only),
    Ablation("binary loss in place of pseudo-gradients", 30.89 - STAGE2, within=_binary_loss),
    Ablation(K17, settings=_patch(17), why="texels of half a pixel are enough: presets have K = 5 to 9"),
    Ablation(
        "K = 9", 30.49 - STAGE3, against=K17, settings=_patch(9), why="both have texels far smaller than a pixel here"
    ),
    Ablation("K = 33", 30.99 - STAGE3, against=K17, settings=_patch(33), why="as for K = 9"),
    Ablation("no supersampling", 29.26 - STAGE3, within=_one_subray, forward=True),
)
