"""A service to talk to: in process for single answers, with a server and a worker for whole jobs."""

from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import httpx
import pytest

from service.settings import ServiceSettings
from tests.api.running import FAKE_TRAINER, RunningService, Worker, in_process


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture
def settings(tmp_path: Path) -> ServiceSettings:
    return ServiceSettings(data=tmp_path / "data", viewer=None)


@pytest.fixture
async def client(settings: ServiceSettings) -> AsyncIterator[httpx.AsyncClient]:
    """The API in this process, without a worker."""
    async with in_process(settings) as client:
        yield client


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """A server on a port of its own and a worker process with the fake trainer, for all tests of a file."""
    settings = ServiceSettings(
        data=tmp_path_factory.mktemp("service") / "data", viewer=None, poll_s=0.1, trainer=FAKE_TRAINER, stall_s=5.0
    )
    with RunningService(settings) as service, Worker(settings):
        yield service
