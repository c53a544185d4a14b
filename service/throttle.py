"""At most so many a second, and never losing the last."""

from typing import Generic, TypeVar

T = TypeVar("T")


class Throttle(Generic[T]):
    """Lets a value pass when `interval_s` has gone by since the last that passed; keeps the newest of the others.

    Times are seconds of any clock that does not go back.
    """

    def __init__(self, interval_s: float) -> None:
        self._interval_s = interval_s
        self._passed = float("-inf")
        self._held: T | None = None

    def offer(self, value: T, now_s: float) -> T | None:
        """`value` if it may pass now, else None."""
        if now_s - self._passed < self._interval_s:
            self._held = value
            return None
        self._passed, self._held = now_s, None
        return value

    def rest(self) -> T | None:
        """The newest value that was held back, if any came after the last that passed."""
        held, self._held = self._held, None
        return held
