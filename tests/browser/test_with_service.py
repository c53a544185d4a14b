"""The pages against the real service: what they send is understood, what it answers is shown."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from service.settings import ServiceSettings
from tests.api.captures import capture_files
from tests.api.running import RunningService


@pytest.fixture
def service(tmp_path: Path) -> Iterator[RunningService]:
    """A server without a worker: its jobs wait."""
    with RunningService(ServiceSettings(data=tmp_path / "data")) as instance:
        yield instance


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A capture in a folder."""
    for name, content in capture_files().items():
        path = tmp_path / "vase" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return tmp_path / "vase"


@pytest.fixture
def start(browser: Browser, service: RunningService) -> Iterator[Page]:
    """The first page. Refusals are logged to the console as errors, hence not the page fixture."""
    page = browser.new_page()
    page.goto(str(service.client.base_url))
    yield page
    page.close()


def test_uploaded_folder_becomes_a_job_that_can_be_cancelled_and_deleted(
    start: Page, service: RunningService, folder: Path
) -> None:
    start.set_input_files("#pick-folder", folder)
    start.get_by_role("button", name="Make the asset").click()
    card = start.locator(".job")
    expect(card).to_have_attribute("data-state", "queued")
    expect(card.locator("h3")).to_have_text("vase")
    expect(card.locator(".job-facts")).to_contain_text("draft")
    card.get_by_role("button", name="Cancel").click()
    expect(card).to_have_attribute("data-state", "cancelled")
    card.get_by_role("button", name="Delete").click()
    card.get_by_role("button", name="Really delete?").click()
    expect(start.locator("#jobs-empty")).to_be_visible()
    assert service.client.get("/jobs").json() == {"jobs": []}


def test_refusal_of_the_service_is_shown_with_its_remedy(start: Page, folder: Path) -> None:
    start.set_input_files("#pick-files", sorted(folder.rglob("*.png"))[:2])
    start.get_by_role("button", name="Make the asset").click()
    problem = start.locator("#upload-problem")
    expect(problem).to_have_attribute("data-code", "too-few-images")
    expect(problem.locator("span")).not_to_be_empty()


def test_viewer_says_when_a_job_has_no_asset(start: Page, service: RunningService) -> None:
    job_id = service.post()
    start.goto(f"{service.client.base_url}/viewer.html?job={job_id}")
    expect(start.locator("#message")).to_contain_text("scene.glb")
