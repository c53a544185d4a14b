"""Downloads: ranges, ETags, and nothing but the known names."""

import pytest

from tests.api.running import RunningService


@pytest.fixture(scope="module")
def job_id(running: RunningService) -> str:
    job_id = running.post(name="quick")
    running.wait(job_id)
    return job_id


def url(job_id: str, name: str = "scene.glb") -> str:
    return f"/jobs/{job_id}/artifacts/{name}"


@pytest.mark.parametrize(
    ("name", "kind"),
    [("scene.glb", "model/gltf-binary"), ("preview.png", "image/png"), ("report.json", "application/json")],
)
def test_artifact_has_its_media_type(running: RunningService, job_id: str, name: str, kind: str) -> None:
    answer = running.client.get(url(job_id, name))
    assert (answer.status_code, answer.headers["content-type"]) == (200, kind)


def test_range_gives_the_bytes_asked_for(running: RunningService, job_id: str) -> None:
    whole = running.client.get(url(job_id))
    part = running.client.get(url(job_id), headers={"Range": "bytes=2-5"})
    assert (part.status_code, part.content) == (206, whole.content[2:6])
    assert part.headers["content-range"] == f"bytes 2-5/{len(whole.content)}"


def test_range_beyond_the_end_is_refused(running: RunningService, job_id: str) -> None:
    assert running.client.get(url(job_id), headers={"Range": "bytes=99999-"}).status_code == 416


def test_known_etag_is_answered_without_a_body(running: RunningService, job_id: str) -> None:
    etag = running.client.get(url(job_id)).headers["etag"]
    for asked in (etag, f'"other", W/{etag}', "*"):
        answer = running.client.get(url(job_id), headers={"If-None-Match": asked})
        assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", etag)
    assert running.client.get(url(job_id), headers={"If-None-Match": '"other"'}).status_code == 200


def test_head_tells_the_size(running: RunningService, job_id: str) -> None:
    answer = running.client.head(url(job_id))
    assert (answer.status_code, answer.headers["content-length"], answer.content) == (200, "1004", b"")


@pytest.mark.parametrize("name", ["job.json", "..%2fjob.json", "trainer.log", "nothing.glb", ".scene.glb.part"])
def test_other_files_are_not_reachable(running: RunningService, job_id: str, name: str) -> None:
    answer = running.client.get(url(job_id, name))
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
