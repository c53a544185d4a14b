"""One OpenGL context for all parity tests, and no OpenGL error before or after any."""

from collections.abc import Iterator

import moderngl
import pytest


@pytest.fixture(scope="session")
def shared_context() -> moderngl.Context:
    return moderngl.create_context(standalone=True, backend="egl")


@pytest.fixture
def context(shared_context: moderngl.Context) -> Iterator[moderngl.Context]:
    assert shared_context.error == "GL_NO_ERROR"
    yield shared_context
    assert shared_context.error == "GL_NO_ERROR"
