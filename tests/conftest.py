"""Fixtures that every kind of test may use."""

import numpy as np
import pytest
from hypothesis import settings

from core.baked import BakedScene
from tests.scenes import tiny_scene

# The same examples in every run: a red suite is due to a change. `--hypothesis-profile=search` looks for new ones.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("search", deadline=None)
settings.load_profile("same")


@pytest.fixture(scope="session")
def scene() -> BakedScene:
    """A small hand-made scene: two pages, holes, three cameras. Read only."""
    return tiny_scene()


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
