"""How long the stages of training take: for the capture report and the progress bar.

Fits by eye to the conversions in benchmarks/results (lego at 100 and 400 px, fern, fox; two cores of an AMD EPYC). They
hold within a factor of two: scenes differ in how much surface they have.
"""

from core.presets import Settings

# Seconds per ray on two cores, and per node or cell of an axis: finer grids are met more often.
VOXEL_RAY_S, FIELD_RAY_S, TEXEL_RAY_S = 1.8e-8, 7e-8, 1.1e-7


def stage_seconds(settings: Settings) -> dict[str, float]:
    """Seconds on two cores of `voxels`, `field` and `texels`, for a scene without surroundings."""
    return {
        "voxels": settings.voxel_steps * settings.voxel_batch * settings.nodes * VOXEL_RAY_S,
        "field": settings.field_steps * settings.field_batch * settings.cells * FIELD_RAY_S,
        "texels": settings.texel_steps * settings.texel_batch * settings.cells * TEXEL_RAY_S,
    }
