"""Matches of pairs of photos, verified by their epipolar geometry, kept in COLMAP's database as they are found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pycolmap

from core.posing.pairs import Pair

# Pairs of one call. Each call reads its photos' features anew, so few pairs cost time; a call is what is lost when the
# process is killed, and how long progress stands still: 5 to 10 s.
PAIRS_PER_CALL = 64


def write_matches(database_path: Path, pairs: list[Pair], seed: int, done: Callable[[float], None]) -> None:
    """Matches all pairs that are not matched yet.

    Args:
        done: is told the share of pairs that are.
    """
    with pycolmap.Database.open(database_path) as database:
        waiting = [pair for pair in pairs if not database.exists_two_view_geometry(*pair)]
    ready = len(pairs) - len(waiting)
    for start in range(0, len(waiting), PAIRS_PER_CALL):
        part = waiting[start : start + PAIRS_PER_CALL]
        _match(database_path, part, seed)
        done((ready + start + len(part)) / len(pairs))


def _match(database_path: Path, pairs: list[Pair], seed: int) -> None:
    pycolmap.set_random_seed(seed)
    matching = pycolmap.FeatureMatchingOptions()
    matching.use_gpu = False
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = database_path.with_name("pairs.txt")
    pairing.match_list_path.write_text("".join(f"{a} {b}\n" for a, b in pairs))
    pycolmap.match_image_pairs(database_path, matching, pairing, verification, pycolmap.Device.cpu)
