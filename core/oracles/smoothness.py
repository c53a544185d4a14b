"""How unlike neighbouring entries of a grid are."""

from torch import Tensor


def smoothness_loss(features: Tensor, trained: Tensor) -> Tensor:
    """Half the sum of squared differences over all pairs of neighbours that both train.

    Args:
        features: [n, n, n, c].
        trained: [n, n, n] bool.
    """
    total = features.new_zeros(())
    for axis in range(3):
        n = features.shape[axis]
        difference = features.narrow(axis, 1, n - 1) - features.narrow(axis, 0, n - 1)
        both = trained.narrow(axis, 1, n - 1) & trained.narrow(axis, 0, n - 1)
        total = total + (difference[both] ** 2).sum()
    return total / 2.0
