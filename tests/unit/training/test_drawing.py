"""Batches drawn ahead are those that the pool draws."""

from dataclasses import fields

import pytest
import torch

from core.training.drawing import _THREAD, BatchSequence
from core.training.pixels import Batch, PixelPool
from tests.unit.training.test_pixels import FRAME, marked_views


def assert_same(one: Batch, other: Batch) -> None:
    for field in fields(Batch):
        assert torch.equal(getattr(one, field.name), getattr(other, field.name)), field.name


@pytest.mark.parametrize("supersampled", [False, True])
def test_batches_are_the_pools_in_any_order(rng, device, supersampled):
    pool = PixelPool(marked_views(rng), FRAME, device)
    sequence = BatchSequence(pool, 60, supersampled=supersampled)
    for number in (0, 1, 2, 2, 7, 8, 3):  # in turn, and from elsewhere, as after a restart
        assert_same(sequence.draw(number), pool.draw(number, 60, supersampled=supersampled))


def test_what_fails_ahead_fails_where_it_is_drawn(rng, monkeypatch):
    pool = PixelPool(marked_views(rng), FRAME, "cpu")
    sequence = BatchSequence(pool, 60, supersampled=False)
    sequence.draw(0)
    monkeypatch.setattr(pool, "draw", None)
    sequence._ahead = 1, _THREAD.submit(sequence._draw, 1)
    with pytest.raises(TypeError):
        sequence.draw(1)
