"""A bad upload is refused with a stable code and a message to act on, and leaves nothing behind."""

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from service.problems import MEDIA_TYPE
from service.settings import Limits, ServiceSettings
from tests.api.bad_inputs import BAD_INPUTS, BadInput
from tests.api.captures import capture_files, zipped
from tests.api.running import form_files, in_process

pytestmark = pytest.mark.anyio
AT_ONCE = {name: case for name, case in BAD_INPUTS.items() if not case.decoded}


def remains(settings: ServiceSettings) -> list[Path]:
    return [path for folder in (settings.jobs, settings.incoming) for path in folder.rglob("*")]


def assert_problem(answer: httpx.Response, status: int, code: str) -> dict[str, str]:
    assert (answer.status_code, answer.headers["content-type"]) == (status, MEDIA_TYPE), answer.text
    problem = answer.json()
    assert (problem["code"], problem["status"]) == (code, status), answer.text
    assert problem["type"].endswith(code)
    assert problem["title"]
    assert problem["detail"]
    return problem


@pytest.mark.parametrize("case", AT_ONCE.values(), ids=AT_ONCE.keys())
async def test_bad_upload_is_refused_and_leaves_nothing(
    client: httpx.AsyncClient, settings: ServiceSettings, case: BadInput
) -> None:
    answer = await client.post("/jobs", data=case.options, files=form_files(case.files()))
    problem = assert_problem(answer, case.status, case.code)
    for word in case.culprit:
        assert word in problem["detail"]
    assert remains(settings) == []
    assert (await client.get("/jobs")).json() == {"jobs": []}


async def test_upload_without_files_is_refused(client: httpx.AsyncClient, settings: ServiceSettings) -> None:
    answer = await client.post("/jobs", files=[("preset", (None, "draft"))])
    assert_problem(answer, 422, "no-images")
    assert remains(settings) == []


async def test_upload_that_is_no_form_is_refused(client: httpx.AsyncClient, settings: ServiceSettings) -> None:
    assert_problem(await client.post("/jobs", json={"preset": "draft"}), 400, "request-invalid")
    assert remains(settings) == []


async def test_upload_cut_short_is_refused(client: httpx.AsyncClient, settings: ServiceSettings) -> None:
    request = client.build_request("POST", "/jobs", files=form_files(capture_files()))
    body = request.read()[:-500]
    headers = {"content-type": request.headers["content-type"]}
    assert_problem(await client.post("/jobs", content=body, headers=headers), 400, "request-invalid")
    assert remains(settings) == []


async def test_archive_beside_loose_files_is_refused(client: httpx.AsyncClient, settings: ServiceSettings) -> None:
    files = capture_files() | {"more.zip": zipped(capture_files())}
    assert_problem(await client.post("/jobs", files=form_files(files)), 400, "request-invalid")
    assert remains(settings) == []


async def test_same_name_twice_is_refused(client: httpx.AsyncClient, settings: ServiceSettings) -> None:
    files = form_files(capture_files()) + form_files({"./train/r_0.png": b"again"})
    assert_problem(await client.post("/jobs", files=files), 400, "request-invalid")
    assert remains(settings) == []


@pytest.mark.parametrize(
    "name", ["../r_0.png", "/r_0.png", "a/../../r_0.png", "train\\r_0.png", "C:r_0.png", "a\x07b.png"]
)
async def test_unsafe_name_of_a_loose_file_is_refused(
    client: httpx.AsyncClient, settings: ServiceSettings, name: str
) -> None:
    disposition = f'Content-Disposition: form-data; name="files"; filename="{name}"'
    body = f"--edge\r\n{disposition}\r\n\r\nx\r\n--edge--\r\n"
    headers = {"content-type": "multipart/form-data; boundary=edge"}
    answer = await client.post("/jobs", content=body.encode(), headers=headers)
    # The form parser strips what Internet Explorer put before a name, so some names arrive harmless.
    assert answer.json()["code"] in ("archive-unsafe", "no-images", "request-invalid")
    assert remains(settings) == []
    assert not (settings.data.parent / "r_0.png").exists()


@pytest.mark.parametrize(
    ("limits", "code"),
    [
        (Limits(upload_bytes=2000), "upload-too-large"),
        (Limits(file_bytes=50), "upload-too-large"),
        (Limits(files=5), "upload-too-large"),
        (Limits(field_bytes=10), "upload-too-large"),
    ],
)
async def test_upload_beyond_a_limit_is_refused(tmp_path: Path, limits: Limits, code: str) -> None:
    settings = ServiceSettings(data=tmp_path / "data", viewer=None, limits=limits)
    async with in_process(settings) as client:
        answer = await client.post("/jobs", data={"name": "n" * 20}, files=form_files(capture_files()))
        assert_problem(answer, 413, code)
        chunked = client.build_request("POST", "/jobs", data={"name": "n" * 20}, files=form_files(capture_files()))
        body = chunked.read()

        async def pieces() -> AsyncIterator[bytes]:  # of unannounced length
            for start in range(0, len(body), 1000):
                yield body[start : start + 1000]

        headers = {"content-type": chunked.headers["content-type"]}
        assert_problem(await client.post("/jobs", content=pieces(), headers=headers), 413, code)
    assert remains(settings) == []
