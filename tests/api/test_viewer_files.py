"""The pages are served beside the API, three.js from the installed package."""

from pathlib import Path

import httpx
import pytest

from service.settings import ServiceSettings
from tests.api.running import in_process

pytestmark = pytest.mark.anyio


@pytest.fixture
def viewer(tmp_path: Path) -> Path:
    three = tmp_path / "viewer" / "node_modules" / "three" / "build"
    three.mkdir(parents=True)
    (three / "three.module.js").write_text("export {};")
    (tmp_path / "viewer" / "index.html").write_text("<!doctype html>")
    return tmp_path / "viewer"


async def get(tmp_path: Path, viewer: Path | None, path: str) -> httpx.Response:
    async with in_process(ServiceSettings(data=tmp_path / "data", viewer=viewer)) as client:
        return await client.get(path)


async def test_root_is_the_index_page(tmp_path: Path, viewer: Path) -> None:
    answer = await get(tmp_path, viewer, "/")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")


async def test_three_is_served_as_a_module(tmp_path: Path, viewer: Path) -> None:
    answer = await get(tmp_path, viewer, "/vendor/three/build/three.module.js")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/javascript")


async def test_api_goes_before_the_pages(tmp_path: Path, viewer: Path) -> None:
    assert (await get(tmp_path, viewer, "/jobs")).json() == {"jobs": []}


@pytest.mark.parametrize("path", ["/nothing.js", "/../data/jobs.sqlite", "/vendor/three/../../../data/jobs.sqlite"])
async def test_other_files_are_problems(tmp_path: Path, viewer: Path, path: str) -> None:
    answer = await get(tmp_path, viewer, path)
    assert (answer.status_code, answer.json()["code"]) == (404, "not-found")


async def test_service_without_pages_has_its_api(tmp_path: Path) -> None:
    assert (await get(tmp_path, None, "/health")).status_code == 200
    assert (await get(tmp_path, None, "/")).status_code == 404


@pytest.mark.parametrize("path", ["/docs", "/redoc"])
async def test_no_page_loads_scripts_from_elsewhere(tmp_path: Path, viewer: Path, path: str) -> None:
    assert (await get(tmp_path, viewer, path)).status_code == 404


async def test_interface_is_described(tmp_path: Path, viewer: Path) -> None:
    assert "/jobs/{job_id}/events" in (await get(tmp_path, viewer, "/openapi.json")).json()["paths"]
