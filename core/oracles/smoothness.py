"""How unlike neighbours are: entries of a grid, texels of a patch."""

from torch import Tensor


def patch_smoothness_loss(features: Tensor, opaque: Tensor) -> Tensor:
    """Half the sum of squared differences over all pairs of texels with a common side that are both opaque.

    Args:
        features: [q, K, K, c], of q patches.
        opaque: [q, K, K] bool.
    """
    rows, columns = features[:, 1:] - features[:, :-1], features[:, :, 1:] - features[:, :, :-1]
    both = opaque[:, 1:] & opaque[:, :-1], opaque[:, :, 1:] & opaque[:, :, :-1]
    return ((rows[both[0]] ** 2).sum() + (columns[both[1]] ** 2).sum()) / 2.0


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
