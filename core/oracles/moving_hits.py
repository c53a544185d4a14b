"""Where rays meet triangles, differentiable in the triangles' corners."""

import torch
from torch import Tensor


def distances(corners: Tensor, origins: Tensor, directions: Tensor, grazing: float) -> Tensor:
    """t [k] at which rays meet the planes of triangles [k, 3, 3].

    The corners get no gradient where |cos| between ray and normal is at most `grazing`.
    """
    normals = torch.linalg.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = normals / normals.norm(dim=1, keepdim=True)
    facing = (normals * directions).sum(1)
    t = (normals * (corners[:, 0] - origins)).sum(1) / facing
    return torch.where(facing.detach().abs() > grazing, t, t.detach())
