"""The next batch is drawn while the present one trains: on the CPU, the network's step leaves a core idle."""

from concurrent.futures import Future, ThreadPoolExecutor

from core.training.pixels import Batch, PixelPool

_THREAD = ThreadPoolExecutor(1, thread_name_prefix="draw")


class BatchSequence:
    """Batches of one size from one pool, in turn. They are those that the pool draws: only the time differs.

    What a batch depends on in the pool (`log_gains`) must not change while the sequence is in use.

    Attributes:
        count: pixels of a batch.
    """

    def __init__(self, pool: PixelPool, count: int, *, supersampled: bool) -> None:
        self.count, self._pool, self._supersampled = count, pool, supersampled
        self._ahead: tuple[int, Future[Batch]] | None = None

    def draw(self, number: int) -> Batch:
        """Batch `number`; quick where the last one was `number - 1`."""
        batch = self._drawn(number)
        if self._pool.device == "cpu":
            self._ahead = number + 1, _THREAD.submit(self._draw, number + 1)
        return batch

    def _drawn(self, number: int) -> Batch:
        # The first one is drawn here: kernels are compiled one after the other.
        if self._ahead is None or self._ahead[0] != number:
            return self._draw(number)
        return self._ahead[1].result()

    def _draw(self, number: int) -> Batch:
        return self._pool.draw(number, self.count, supersampled=self._supersampled)
