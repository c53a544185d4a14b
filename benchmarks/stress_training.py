"""Ways to make training hard, each a context to train in."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from typing import Any

from benchmarks.patching import replaced
from core.field.voxels import EMPTY_DENSITY, HIGHEST_DENSITY
from core.training import field_stage, texel_stage, voxel_stage
from core.training.field_stage import FieldStage
from core.training.texel_stage import TexelStage
from core.training.voxel_stage import VoxelStage

KEPT_RATES = ("FINAL_RATE",)  # a factor, not a rate


@contextmanager
def rates_times(factor: float) -> Iterator[None]:
    """All learning rates, of every stage."""
    with ExitStack() as stack:
        for module in (voxel_stage, field_stage, texel_stage):
            for name in [name for name in vars(module) if name.endswith("_RATE") and name not in KEPT_RATES]:
                stack.enter_context(replaced(module, name, getattr(module, name) * factor))
        yield


@contextmanager
def voxels_starting_at(density: float) -> Iterator[None]:
    """The voxel stage starts with this raw density everywhere."""
    start = VoxelStage.__init__

    def saturated(stage: VoxelStage, *arguments: Any, **named: Any) -> None:
        start(stage, *arguments, **named)
        stage.field.parameters.scalar.fill_(density)

    with replaced(VoxelStage, "__init__", saturated):
        yield


@contextmanager
def opacity_starting_at(stage: type[FieldStage] | type[TexelStage], opacity: float) -> Iterator[None]:
    """A stage starts with this opacity everywhere."""
    after = stage.after

    def saturated(cls: Any, *arguments: Any, **named: Any) -> Any:
        made = after(*arguments, **named)
        made.parameters.scalar.fill_(opacity)
        return made

    with replaced(stage, "after", classmethod(saturated)):
        yield


STRESSES: dict[str, Callable[[], AbstractContextManager[Any]]] = {
    "": nullcontext,
    "voxels start empty": lambda: voxels_starting_at(EMPTY_DENSITY),
    "voxels start solid": lambda: voxels_starting_at(HIGHEST_DENSITY),
    "mesh starts at opacity 0": lambda: opacity_starting_at(FieldStage, 0.0),
    "mesh starts at opacity 1": lambda: opacity_starting_at(FieldStage, 1.0),
    "texels start at opacity 0": lambda: opacity_starting_at(TexelStage, 0.0),
    "texels start at opacity 1": lambda: opacity_starting_at(TexelStage, 1.0),
    "learning rates times 10": lambda: rates_times(10.0),
}
