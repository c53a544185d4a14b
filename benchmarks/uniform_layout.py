"""The paper's layout of the field that a conversion trains: K = 17 texels a side for every quad (paper 3.3).

As the paper's third stage does, the field is baked, and the texels are not trained any further.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import core.reconstruct
from benchmarks.patching import replaced
from core.baked import BakedScene
from core.baking.bake import bake
from core.capture import Capture
from core.field.region import find_region
from core.training.field_stage import FieldStage
from core.training.pixels import PixelPool
from core.training.texel_stage import TexelStage

PAPER_K = 17


@dataclass
class UniformLayout:
    """`scene` is there once a reconstruction has passed its field stage."""

    scene: BakedScene | None = None


@contextmanager
def watched_for_uniform_layout(capture: Capture) -> Iterator[UniformLayout]:
    """Within, `reconstruct` of the capture leaves the uniform layout of its field, and goes on as ever."""
    found, frame = UniformLayout(), find_region(capture).frame

    class Watched(TexelStage):
        @classmethod
        def after(cls, field: FieldStage, pool: PixelPool) -> TexelStage:
            settings = field.settings
            try:
                field.settings = replace(settings, patch=PAPER_K)
                found.scene = bake(TexelStage.after(field, pool), capture, frame, lambda share: None)
            finally:
                field.settings = settings
            return TexelStage.after(field, pool)

    with replaced(core.reconstruct, "TexelStage", Watched):
        yield found
