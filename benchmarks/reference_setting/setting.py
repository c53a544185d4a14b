"""The numbers of the paper's setting."""

from dataclasses import dataclass

# Of the time: the authors' stage 1 took 8 hours, stage 2 took 16, a fifth of its steps being the last fine-tuning.
STAGE1_UNTIL, STAGE2_UNTIL = 1 / 3, 1 / 3 + 2 / 3 * 0.8
# Supplement G: of stage 1, how long all 3P points of a ray are kept, and then half of them.
ALL_POINTS_UNTIL, HALF_POINTS_UNTIL = 0.25, 0.5
GRID_THRESHOLD = 0.1  # tau_G
GRID_SPARSE, GRID_SMOOTH = 1e-5, 1e-5  # w_g1, w_g2 of eq. 19
VERTEX_PULL, VERTEX_OUTSIDE = 1e-2, 1e3  # eq. 6
OPACITY_BIAS = -8.0
FIRST_RATE, LAST_RATE = 1e-3, 1e-5
WARM_UP, WARM_UP_RATE = 1 / 15, 0.1  # share of the time, and the rate's factor at its start
VERTEX_RATE = 16 / 2.4  # of the learning rate, in cells
ADAM_BETAS, ADAM_EPSILON = (0.9, 0.999), 1e-15
SUBRAYS = 4


@dataclass(frozen=True)
class PaperSetting:
    """What may be chosen smaller than in the paper, for machines that are.

    Attributes:
        cells: P, cells per axis of the mesh.
        patch: K, texels per quad side.
        width, depth: of the networks A and F.
        frequencies: octaves of the positional encoding.
        batch: rays a step once points are pruned; earlier ones take a quarter, then half of it.
        prune: whether the acceleration grid removes points after the first quarter of stage 1. G can rise by no more
            than the learning rate a step: in minutes it is still below the threshold everywhere by then, and
            everything goes for good.
    """

    cells: int = 128
    patch: int = 17
    width: int = 384
    depth: int = 8
    frequencies: int = 10
    batch: int = 8192
    prune: bool = False


# What two cores can move at all: P = 32, so that a ray meets some 60 quads, and texels in proportion to 100 px photos.
ON_A_CPU = PaperSetting(cells=32, patch=5, batch=512)
