"""Which photos are worth comparing.

Comparing two photos takes 0.1 to 0.2 s, and n photos have n (n - 1) / 2 pairs: half an hour for 150. Beyond a few
photos each is compared with those only that look alike at a glance: their largest features are matched first, which
takes a thousandth of the time and finds nearly all pairs that overlap ("preemptive matching", Wu 2013, section 2), in
whatever order the photos were taken.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pycolmap

EXHAUSTIVE_UP_TO = 24
# Of a larger set, each photo is compared with so many that look most alike, and with the next ones by name.
PARTNERS = 16
NEIGHBOURS = 3
# Of a photo's features, the largest: they are seen again from elsewhere more often than the many small ones.
LARGEST = 256
RATIO = 0.85  # of the angles to the best and second best; loose, because there are few to be confused with

Pair = tuple[int, int]


def pairs_to_match(database_path: Path, done: Callable[[float], None]) -> list[Pair]:
    """Pairs of image ids (a < b), in an order that keeps each photo's together.

    Args:
        done: is told the share of pairs that were glanced at, in large sets.
    """
    with pycolmap.Database.open(database_path) as database:
        numbers = sorted(image.image_id for image in database.read_all_images())
        numbers = [number for number in numbers if database.num_keypoints_for_image(number) > 0]
        if len(numbers) <= EXHAUSTIVE_UP_TO:
            return [(a, b) for index, a in enumerate(numbers) for b in numbers[index + 1 :]]
        directions = [_largest(database, number) for number in numbers]
    return sorted({(numbers[a], numbers[b]) for a, b in likely_pairs(likeness(directions, done))})


def likely_pairs(scores: np.ndarray) -> set[Pair]:
    """Index pairs (a < b) of photos in the order of their names: each one's likest, and its neighbours.

    Args:
        scores: [n, n], symmetric, 0 for photos that share nothing.
    """
    count = len(scores)
    pairs = {(a, b) for a in range(count) for b in range(a + 1, min(a + 1 + NEIGHBOURS, count))}
    for a in range(count):
        likest = np.argsort(-scores[a], kind="stable")[:PARTNERS]
        pairs |= {(min(a, b), max(a, b)) for b in likest.tolist() if b != a and scores[a, b] > 0}
    return pairs


def likeness(directions: list[np.ndarray], done: Callable[[float], None] = lambda share: None) -> np.ndarray:
    """[n, n] int: mutual best matches of unit descriptors [k, 128] that also pass the ratio test. 0.8 ms a pair."""
    count = len(directions)
    scores = np.zeros((count, count), np.int32)
    for a in range(count):
        for b in range(a + 1, count):
            scores[a, b] = scores[b, a] = _matches(directions[a] @ directions[b].T)
        done(1.0 - ((count - 1 - a) / count) ** 2)
    return scores


def _matches(cosines: np.ndarray) -> int:
    """Of [k, l] cosines, which are overwritten."""
    rows, columns = cosines.shape
    if min(rows, columns) < 2:
        return 0
    best, every = cosines.argmax(1), np.arange(rows)
    mutual = cosines.argmax(0)[best] == every
    first = cosines[every, best]
    cosines[every, best] = -1.0
    first_rad, second_rad = (np.arccos(np.clip(cosine, -1.0, 1.0)) for cosine in (first, cosines.max(1)))
    return int(np.count_nonzero(mutual & (first_rad < RATIO * second_rad)))


def _largest(database: pycolmap.Database, number: int) -> np.ndarray:
    """Unit descriptors [up to LARGEST, 128] float32 of a photo's largest features."""
    sizes = np.asarray(database.read_keypoints(number))[:, 2]
    chosen = np.argsort(-sizes, kind="stable")[:LARGEST]
    descriptors = database.read_descriptors(number).data[chosen].astype(np.float32)
    return descriptors / np.maximum(np.linalg.norm(descriptors, axis=1, keepdims=True), 1e-9)
