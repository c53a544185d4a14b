"""The first page, against an API that is faked."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from tests.browser.fake_jobs import FakeJobs, fake_job
from tests.browser.site import Site

PROBLEM = {
    "status": 422,
    "code": "pose-not-finite",
    "title": "Pose not finite",
    "detail": "pose of r_3: every entry must be a finite number, but got NaN. Leave this photo out.",
    "remedy": "Leave this photo out.",
}


@pytest.fixture
def api(site: Site) -> FakeJobs:
    jobs = FakeJobs()
    site.api = jobs
    return jobs


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    """A folder as people have it: photos in a subfolder, a pose file, and clutter."""
    folder = tmp_path / "teapot"
    (folder / "train").mkdir(parents=True)
    for i in range(3):
        Image.new("RGB", (8, 8), (40 * i, 90, 120)).save(folder / "train" / f"r_{i}.png")
    (folder / "transforms_train.json").write_text("{}")
    (folder / ".DS_Store").write_text("clutter")
    (folder / "notes.pdf").write_text("clutter")
    return folder


@pytest.fixture
def preview(tmp_path: Path) -> bytes:
    Image.new("RGB", (16, 16), (200, 120, 20)).save(tmp_path / "preview.png")
    return (tmp_path / "preview.png").read_bytes()


@pytest.fixture
def phone(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(
        viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True, device_scale_factor=2
    )
    yield context.new_page()
    context.close()


def test_folder_is_sent_with_paths_relative_to_its_pose_file(
    page: Page, site: Site, api: FakeJobs, capture: Path
) -> None:
    page.goto(site.url)
    page.set_input_files("#pick-folder", capture)
    expect(page.locator("#selection-text")).to_contain_text("3 photos, 1 pose file")
    expect(page.locator("#thumbnails img")).to_have_count(3)
    page.locator("#presets label").filter(has_text="High").click()
    page.get_by_role("button", name="Make the asset").click()
    expect(page.locator(".job")).to_have_attribute("data-state", "queued")
    names = set(re.findall(rb'name="files"; filename="([^"]*)"', api.uploads[0]))
    assert names == {b"train/r_0.png", b"train/r_1.png", b"train/r_2.png", b"transforms_train.json"}
    assert b'name="preset"\r\n\r\nhigh\r\n' in api.uploads[0]
    assert b'name="name"\r\n\r\nteapot\r\n' in api.uploads[0]
    assert b'name="seed"' not in api.uploads[0]
    expect(page.locator("#selection")).to_be_hidden()


def test_photos_without_poses_may_be_sent_and_what_happens_is_said(
    page: Page, site: Site, api: FakeJobs, capture: Path
) -> None:
    page.goto(site.url)
    (capture / "train" / "K.txt").write_text("a calibration, but no poses")
    page.set_input_files("#pick-files", [capture / "train" / name for name in ("r_0.png", "r_1.png", "K.txt")])
    expect(page.locator("#selection-text")).to_contain_text("2 photos ·")
    expect(page.locator("#selection-hint")).to_contain_text("at least 3 photos")
    page.set_input_files("#pick-files", capture / "train" / "r_2.png")
    expect(page.locator("#selection-hint")).to_contain_text("cameras will be estimated")
    expect(page.get_by_role("button", name="Make the asset")).to_be_enabled()
    page.set_input_files("#pick-files", capture / "transforms_train.json")
    expect(page.locator("#selection-hint")).to_be_hidden()
    expect(page.locator("#selection-text")).to_contain_text("3 photos, 1 pose file")


def test_files_without_photos_are_refused_at_once(page: Page, site: Site, api: FakeJobs, capture: Path) -> None:
    page.goto(site.url)
    page.set_input_files("#pick-files", capture / "notes.pdf")
    expect(page.locator("#upload-problem")).to_contain_text("no photos")
    expect(page.get_by_role("button", name="Make the asset")).to_be_disabled()


def test_problem_shows_message_and_remedy_once_and_keeps_the_files(
    browser: Browser, site: Site, api: FakeJobs, capture: Path
) -> None:
    page = browser.new_page()  # not the page fixture: a 422 is logged to the console as an error
    api.refusal = PROBLEM
    page.goto(site.url)
    page.set_input_files("#pick-folder", capture)
    page.get_by_role("button", name="Make the asset").click()
    problem = page.locator("#upload-problem")
    expect(problem.locator("strong")).to_have_text("pose of r_3: every entry must be a finite number, but got NaN.")
    expect(problem.locator("span")).to_have_text("Leave this photo out.")
    expect(problem).to_have_attribute("data-code", "pose-not-finite")
    expect(page.get_by_role("button", name="Make the asset")).to_be_enabled()
    page.close()


def test_running_job_shows_stage_progress_psnr_and_preview(
    page: Page, site: Site, api: FakeJobs, preview: bytes
) -> None:
    api.jobs = [fake_job("a1", "running", name="Teapot", stage="read", fraction=0.01)]
    api.events["a1"] = [
        {"stage": "read", "fraction": 0.01, "psnr": None, "preview": False},
        {"stage": "field", "fraction": 0.42, "psnr": 27.18, "preview": True},
    ]
    api.previews["a1"] = preview
    page.goto(site.url)
    card = page.locator(".job")
    expect(card.locator(".job-stage")).to_have_text("Training shape and appearance · 42 % · 27.18 dB")
    expect(card.locator(".job-progress progress")).to_have_js_property("value", 0.42)
    expect(card.get_by_role("img", name="Preview of Teapot")).to_be_visible()


def test_capture_report_is_shown_while_the_job_runs(page: Page, site: Site, api: FakeJobs, preview: bytes) -> None:
    api.jobs = [fake_job("a1", "running", name="Castle", stage="mapping", fraction=0.2)]
    page.goto(site.url)
    expect(page.locator(".job-stage")).to_contain_text("Finding the cameras")
    expect(page.locator(".job-report")).to_be_hidden()
    lines = [
        {"label": "photos", "text": "11: 9 to train on", "warns": False},
        {"label": "blur", "text": "1 blurred: <b>2.jpg</b>", "warns": True},
    ]
    api.captures["a1"] = preview
    api.jobs = [fake_job("a1", "running", name="Castle", stage="voxels", fraction=0.3, capture={"lines": lines})]
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")  # looks again without waiting its turn
    report = page.locator(".job-report")
    expect(report.locator("summary")).to_have_text("Capture report: 1 remark")
    expect(report.locator("dt")).to_have_text(["photos", "blur"])
    expect(report.locator("dd.warns")).to_have_text("1 blurred: <b>2.jpg</b>")
    expect(report.get_by_role("img", name="Where the photos of Castle were taken from")).to_be_visible()


def test_ready_job_links_to_viewer_and_file(page: Page, site: Site, api: FakeJobs) -> None:
    artifacts = [{"name": "scene.glb", "bytes": 12_345_678, "url": "/jobs/a1/artifacts/scene.glb"}]
    api.jobs = [fake_job("a1", "succeeded", psnr=31.234, artifacts=artifacts)]
    page.goto(site.url)
    expect(page.locator(".job-facts")).to_contain_text("31.23 dB · 12.3 MB")
    expect(page.get_by_role("link", name="View in 3D")).to_have_attribute("href", f"{site.url}/viewer.html?job=a1")
    link = page.locator("[data-action=download]")
    expect(link).to_have_attribute("href", f"{site.url}/jobs/a1/artifacts/scene.glb")


def finished_job(**changes: object) -> dict[str, object]:
    """A job with one of the three formats, one that could not be made, and one that was not asked for."""
    names = {"scene.glb": 12_345_678, "report.json": 900}
    artifacts = [{"name": name, "bytes": size, "url": f"/jobs/a1/artifacts/{name}"} for name, size in names.items()]
    rows = {
        "glb": {"file": "scene.glb", "bytes": 12_345_678, "psnr": 31.234, "note": "", "problem": ""},
        "usd": {
            "file": "scene.usd.zip",
            "bytes": None,
            "psnr": None,
            "note": "",
            "problem": "scene-invalid: <b>no</b>",
        },
    }
    return fake_job("a1", "succeeded", name="Vase", artifacts=artifacts, formats=rows, **changes)


def test_files_of_a_job_are_listed_with_size_quality_and_what_opens_them(page: Page, site: Site, api: FakeJobs) -> None:
    api.jobs = [finished_job()]
    page.goto(site.url)
    files = page.locator(".job-files")
    expect(files.locator("summary")).to_have_text("Files: 1 of 3 formats, 12.3 MB")
    files.locator("summary").click()
    row = files.locator("[data-format=glb]")
    expect(row).to_contain_text("The glb form. Opens in: a viewer")
    expect(row).to_contain_text("12.3 MB")
    expect(row).to_contain_text("31.23 dB")
    link = row.get_by_role("link", name="scene.glb")
    expect(link).to_have_attribute("href", f"{site.url}/jobs/a1/artifacts/scene.glb")
    expect(link).to_have_attribute("download", "Vase.glb")
    expect(files.locator("[data-format=usd] .file-problem")).to_have_text("scene-invalid: <b>no</b>")
    expect(files.get_by_role("link", name="report.json")).to_be_visible()


def test_missing_format_is_made_on_request(page: Page, site: Site, api: FakeJobs) -> None:
    api.jobs = [finished_job()]
    page.goto(site.url)
    files = page.locator(".job-files")
    files.locator("summary").click()
    files.get_by_role("button", name="Make: scene.web.glb").click()
    expect(files.locator(".export-stage")).to_have_text("Waiting · 0 %")
    assert api.jobs[0]["export"]["formats"] == ["web"]
    expect(files.get_by_role("button", name="Try again: scene.usd.zip")).to_be_disabled()
    api.jobs[0]["export"] |= {"state": "running", "stage": "export web", "fraction": 0.42}
    expect(files.locator(".export-stage")).to_have_text("Writing scene.web.glb · 42 %")
    files.get_by_role("button", name="Stop").click()
    expect(files.locator(".export-progress")).to_be_hidden()
    files.get_by_role("button", name="Make all the others").click()
    expect(files.locator(".export-stage")).to_be_visible()
    assert api.jobs[0]["export"]["formats"] == ["web", "usd"]
    assert api.requests == [("POST", "/jobs/a1/exports"), ("POST", "/jobs/a1/cancel"), ("POST", "/jobs/a1/exports")]


def test_export_that_failed_says_why(page: Page, site: Site, api: FakeJobs) -> None:
    api.jobs = [finished_job(export={"state": "failed", "formats": ["web"], "problem": PROBLEM})]
    page.goto(site.url)
    page.locator(".job-files summary").click()
    expect(page.locator(".export-problem strong")).to_contain_text("must be a finite number")


def test_failed_job_says_why(page: Page, site: Site, api: FakeJobs) -> None:
    api.jobs = [fake_job("a1", "failed", problem=PROBLEM)]
    page.goto(site.url)
    expect(page.locator(".job-problem strong")).to_contain_text("must be a finite number")
    expect(page.locator(".job-problem span")).to_have_text("Leave this photo out.")


def test_cancel_and_delete_reach_the_service(page: Page, site: Site, api: FakeJobs) -> None:
    api.jobs = [fake_job("a1", "queued")]
    page.goto(site.url)
    page.get_by_role("button", name="Cancel").click()
    expect(page.locator(".job")).to_have_attribute("data-state", "cancelled")
    page.get_by_role("button", name="Delete").click()
    assert ("DELETE", "/jobs/a1") not in api.requests  # asks first
    page.get_by_role("button", name="Really delete?").click()
    expect(page.locator(".job")).to_have_count(0)
    assert api.requests == [("POST", "/jobs/a1/cancel"), ("DELETE", "/jobs/a1")]
    expect(page.locator("#jobs-empty")).to_be_visible()


def test_page_fits_a_phone(phone: Page, site: Site, api: FakeJobs) -> None:
    long_name = "an asset of which the name does not fit into one line of a phone"
    api.jobs = [fake_job("a1", "failed", name=long_name, problem=PROBLEM), fake_job("a2", "succeeded", name=long_name)]
    phone.goto(site.url)
    expect(phone.locator(".job")).to_have_count(2)
    phone.locator(".job-files:visible summary").click()
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390
    for button in phone.locator("a.button:visible, button:visible, label.button:visible").all():
        box = button.bounding_box()
        assert box
        assert box["height"] >= 44 - 0.5, button.inner_text()  # a finger's width
        assert box["x"] + box["width"] <= 390


def test_service_that_is_gone_is_reported(browser: Browser, site: Site, api: FakeJobs) -> None:
    page = browser.new_page()  # not the page fixture: the failed request is logged to the console
    page.goto(site.url)
    expect(page.locator("#jobs-empty")).to_be_visible()
    page.route("**/jobs", lambda route: route.abort())
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")  # looks again without waiting its turn
    expect(page.locator("#jobs-offline")).to_contain_text("cannot be reached")
    page.close()
