"""Adam (Kingma and Ba 2015, algorithm 1) on single entries, in float64."""

import numpy as np


class LazyAdam:
    """Adam that leaves entries without a gradient as they are, moments and all.

    Attributes:
        value: [n, ...] float64, the parameters.
        counts: [n] int, how often each entry was stepped.
    """

    def __init__(self, value: np.ndarray, *, beta1: float, beta2: float) -> None:
        self.value = np.array(value, np.float64)
        self.counts = np.zeros(len(self.value), int)
        self._m, self._v = np.zeros_like(self.value), np.zeros_like(self.value)
        self._beta1, self._beta2 = beta1, beta2

    def step(
        self,
        index: np.ndarray,
        grad: np.ndarray,
        rate: float,
        *,
        low: float,
        high: float,
        decay: float = 0.0,
        steps: int | None = None,
    ) -> None:
        """Steps the entries `index` [k] by their gradients [k, ...]; values stay within [low, high].

        Args:
            decay: constant that is added to the normalised gradient.
            steps: what bias correction counts; by default each entry's own steps.
        """
        self.counts[index] += 1
        counts = self.counts[index] if steps is None else np.full(len(index), steps)
        counts = counts.reshape(-1, *[1] * (self.value.ndim - 1)).astype(float)
        self._m[index] = self._beta1 * self._m[index] + (1 - self._beta1) * grad
        self._v[index] = self._beta2 * self._v[index] + (1 - self._beta2) * grad**2
        m_hat = self._m[index] / (1 - self._beta1**counts)
        v_hat = self._v[index] / (1 - self._beta2**counts)
        direction = m_hat / (np.sqrt(v_hat) + 1e-12) + decay
        self.value[index] = np.clip(self.value[index] - rate * direction, low, high)
