"""Fixtures that every kind of test may use."""

import numpy as np
import pytest

from core.baked import BakedScene
from tests.scenes import tiny_scene


@pytest.fixture(scope="session")
def scene() -> BakedScene:
    """A small hand-made scene: two pages, holes, three cameras. Read only."""
    return tiny_scene()


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
