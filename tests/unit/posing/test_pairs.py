"""Which photos are compared with which."""

import itertools

import numpy as np

from core.posing.pairs import NEIGHBOURS, PARTNERS, RATIO, likely_pairs, likeness


def unit(vectors: np.ndarray) -> np.ndarray:
    return (vectors / np.linalg.norm(vectors, axis=1, keepdims=True)).astype(np.float32)


def slow_likeness(one: np.ndarray, other: np.ndarray) -> int:
    """Mutual best matches that pass the ratio test, one by one."""
    angles = np.arccos(np.clip(one @ other.T, -1, 1))
    count = 0
    for row in range(len(one)):
        best, second = np.argsort(angles[row])[:2]
        if np.argmin(angles[:, best]) == row and angles[row, best] < RATIO * angles[row, second]:
            count += 1
    return count


def test_likeness_agrees_with_its_oracle() -> None:
    rng = np.random.default_rng(0)
    common = rng.normal(size=(40, 128))
    sets = [unit(np.concatenate([common[:k], rng.normal(size=(60 - k, 128))]) + 0.05 * rng.normal(size=(60, 128)))
            for k in (40, 20, 0)]  # fmt: skip
    scores = likeness(sets)
    assert (scores == scores.T).all()
    for a in range(3):
        for b in range(a + 1, 3):
            # The ratio test looks from the first photo, in both.
            assert scores[a, b] == slow_likeness(sets[a], sets[b])
    assert scores[0, 1] > scores[0, 2]


def test_photos_with_hardly_any_features_are_like_nothing() -> None:
    some = unit(np.random.default_rng(0).normal(size=(5, 128)))
    assert likeness([some, some[:1], some[:0]]).sum() == 0


def test_each_photo_is_compared_with_its_likest_and_its_neighbours() -> None:
    count = 60
    places = np.arange(count)[np.random.default_rng(1).permutation(count)]  # names say nothing of places
    scores = np.maximum(0, 100 - 10 * np.abs(places[:, None] - places[None]))
    np.fill_diagonal(scores, 0)
    pairs = likely_pairs(scores)
    assert all(a < b for a, b in pairs)
    by_place = np.argsort(places)
    for one, other in itertools.pairwise(by_place):
        assert (min(one, other), max(one, other)) in pairs
    assert all((a, b) in pairs for a in range(count) for b in range(a + 1, min(a + 1 + NEIGHBOURS, count)))
    assert len(pairs) <= count * (PARTNERS + NEIGHBOURS)
    assert len(pairs) < count * (count - 1) / 2


def test_photos_that_share_nothing_are_compared_with_neighbours_only() -> None:
    assert likely_pairs(np.zeros((4, 4), int)) == {(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)}
    assert len(likely_pairs(np.zeros((50, 50), int))) < 50 * NEIGHBOURS
