"""Canonical Huffman codes of bounded length, and how VP8L writes them down (RFC 9649, section 3.7.2)."""

import heapq
from dataclasses import dataclass

import numpy as np

from exporters.vp8l.bits import BitStream

MOST_BITS = 15
MOST_LENGTH_BITS = 7  # of the code of code lengths
LENGTH_ORDER = (17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

_Node = tuple[int, int, tuple[int, ...]]  # how often; a name, so that ties are broken alike; its symbols


@dataclass(frozen=True)
class PrefixCode:
    """Attributes:
    stated: int64 [a], length of each symbol's code as it is written down; 0: it does not occur.
    lengths: int64 [a], bits that a symbol takes: 0 where it is the only one.
    codes: uint64 [a], to be written lowest bit first.
    """

    stated: np.ndarray
    lengths: np.ndarray
    codes: np.ndarray


def prefix_code(counts: np.ndarray, most_bits: int = MOST_BITS) -> PrefixCode:
    """The code of least bits for symbols that occur so often ([a], at least one of them above 0)."""
    stated = _lengths(counts, most_bits)
    only_one = np.count_nonzero(stated) == 1
    return PrefixCode(stated, np.zeros_like(stated) if only_one else stated, _canonical(stated))


def _lengths(counts: np.ndarray, most_bits: int) -> np.ndarray:
    """[a] code lengths; where the tree is too deep, rare symbols are taken for more frequent until it is not."""
    least = 1
    while True:
        lengths = _depths(np.where(counts > 0, np.maximum(counts, least), 0))
        if lengths.max() <= most_bits:
            return lengths
        least *= 2


def _depths(counts: np.ndarray) -> np.ndarray:
    """[a] depths in Huffman's tree; 1 for a symbol that is alone."""
    heap: list[_Node] = [(int(counts[symbol]), symbol, (symbol,)) for symbol in np.flatnonzero(counts).tolist()]
    depths = np.zeros(len(counts), np.int64)
    if len(heap) == 1:
        depths[heap[0][1]] = 1
    heapq.heapify(heap)
    while len(heap) > 1:
        (few, _, some), (more, name, others) = heapq.heappop(heap), heapq.heappop(heap)
        both = some + others
        depths[list(both)] += 1
        heapq.heappush(heap, (few + more, name, both))
    return depths


def _canonical(lengths: np.ndarray) -> np.ndarray:
    """uint64 [a]: codes that rise with length, then symbol; their first bit is the lowest."""
    codes = np.zeros(len(lengths), np.uint64)
    code, before = 0, 0
    for symbol in np.lexsort((np.arange(len(lengths)), lengths)):
        length = int(lengths[symbol])
        if length:
            code <<= length - before
            codes[symbol] = int(f"{code:0{length}b}"[::-1], 2)
            code, before = code + 1, length
    return codes


def write_prefix_code(stream: BitStream, code: PrefixCode, alphabet: int) -> None:
    """The code's lengths: in the simple form where there is one symbol, or else each by itself.

    Args:
        alphabet: how many symbols the reader takes there to be; those beyond the code's do not occur.
    """
    symbols = np.flatnonzero(code.stated)
    if len(symbols) == 1:
        stream.put(0b101, 3)  # simple; one symbol; of eight bits
        stream.put(int(symbols[0]), 8)
        return
    lengths = np.pad(code.stated, (0, alphabet - len(code.stated)))
    of_lengths = prefix_code(np.bincount(lengths, minlength=len(LENGTH_ORDER)), MOST_LENGTH_BITS)
    stream.put(0, 1)
    stream.put(len(LENGTH_ORDER) - 4, 4)
    for length in LENGTH_ORDER:
        stream.put(int(of_lengths.stated[length]), 3)
    stream.put(0, 1)  # lengths of all symbols follow
    for length in lengths.tolist():
        stream.put(int(of_lengths.codes[length]), int(of_lengths.lengths[length]))
