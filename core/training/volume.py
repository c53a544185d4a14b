"""The volume that a mesh wears while the field stage trains, as kernels read it."""

import warp as wp
from torch import Tensor

from core.field.frame import as_vec3, empty
from core.field.parameters import Parameters
from core.field.space import Space
from core.kernels.launch import launch
from core.kernels.surfaces import Volume, sample_volume
from core.kernels.types import vec8


def volume_of(space: Space, nodes: int, parameters: Parameters) -> Volume:
    """The volume as kernels read it."""
    volume = Volume()
    volume.space = space.kernel_space()
    volume.nodes = nodes
    volume.alpha = wp.from_torch(parameters.scalar)
    volume.features = wp.from_torch(parameters.features, dtype=vec8)
    return volume


def sampled(volume: Volume, points: Tensor, device: str) -> tuple[Tensor, Tensor]:
    """Opacity [n] and features [n, 8] of a volume at points [n, 3] of the cube."""
    alpha, features = empty(len(points), device=device), empty(len(points), 8, device=device)
    outputs = [wp.from_torch(alpha), wp.from_torch(features, dtype=vec8)]
    launch(sample_volume, len(points), [volume, as_vec3(points), *outputs], device)
    return alpha, features
