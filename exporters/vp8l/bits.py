"""A stream of bits, the lowest of each byte first, as VP8L has them."""

import numpy as np

WORD_BITS = 64
MOST_BITS = 60  # of one piece: less than a word, so that every word has a piece that begins in it


class BitStream:
    """Grows by pieces: a number and how many of its low bits count."""

    def __init__(self) -> None:
        self._words: list[np.ndarray] = []
        self._open, self._used = np.uint64(0), 0  # the word that is not full, and how many of its bits are taken
        self._pending: list[tuple[int, int]] = []

    def put(self, number: int, count: int) -> None:
        """One piece; 0 <= number < 2^count, count <= MOST_BITS."""
        self._pending.append((number, count))

    def put_all(self, numbers: np.ndarray, counts: np.ndarray) -> None:
        """Pieces one after the other: uint64 [n] and int64 [n], as `put` takes them."""
        if self._pending:
            pending, self._pending = np.array(self._pending, np.uint64), []
            self.put_all(pending[:, 0], pending[:, 1].astype(np.int64))
        if len(numbers):
            self._append(numbers, counts)

    def _append(self, numbers: np.ndarray, counts: np.ndarray) -> None:
        ends = np.cumsum(counts) + self._used
        starts = ends - counts
        word, shift = starts >> 6, (starts & 63).astype(np.uint64)
        last = np.flatnonzero(word[1:] != word[:-1])  # in each word but the last, the piece that may reach beyond it
        words = np.bitwise_or.reduceat(numbers << shift, np.concatenate([[0], last + 1]))
        # In two steps, since a shift by 64 is not defined.
        words[1:] |= numbers[last] >> np.uint64(1) >> (np.uint64(63) - shift[last])
        words[0] |= self._open
        self._used = int(ends[-1]) - WORD_BITS * (len(words) - 1)
        self._open = words[-1]
        if self._used >= WORD_BITS:
            self._used -= WORD_BITS
            self._open = numbers[-1] >> np.uint64(1) >> (np.uint64(63) - shift[-1])
            self._words.append(words)
        else:
            self._words.append(words[:-1])

    def finish(self) -> bytes:
        """All of it; the last byte is filled with zeros."""
        self.put_all(np.empty(0, np.uint64), np.empty(0, np.int64))
        rest = int(self._open).to_bytes(8, "little")[: -(-self._used // 8)]
        return b"".join([*(words.astype("<u8").tobytes() for words in self._words), rest])
