"""The whole path on a tiny capture, with the real trainer: through the command line and through the service."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from core.datasets import read_capture
from core.evaluation import evaluate
from exporters.gltf import read_glb
from service.cli import main
from service.report import Report
from service.settings import ServiceSettings
from tests.api.captures import capture_files, write_files, zipped
from tests.api.running import RunningService, Worker
from tests.unit.posing import room

TINY = {"cells": 8, "patch": 2, "nodes": 16, "voxel_steps": 30, "field_steps": 20, "texel_steps": 20}
ASSIGNMENTS = [f"{name}={value}" for name, value in TINY.items()]


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_files(tmp_path_factory.mktemp("capture"), capture_files())


@pytest.fixture(scope="module")
def out(capture: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `polyfield convert` has filled."""
    out = tmp_path_factory.mktemp("out") / "new"
    settings = [word for assignment in ASSIGNMENTS for word in ("--set", assignment)]
    assert main(["convert", str(capture), "-o", str(out), "--preset", "draft", "--device", "cpu", *settings]) == 0
    return out


@pytest.fixture(scope="module")
def report(out: Path) -> Report:
    return Report.from_bytes((out / "report.json").read_bytes())


def test_conversion_leaves_its_files_and_no_checkpoint(out: Path) -> None:
    names = {path.name for path in out.iterdir()}
    assert names == {"scene.glb", "preview.png", "report.json", "capture.json", "capture.png"}


def test_capture_report_is_part_of_the_report(out: Path, report: Report) -> None:
    assert json.loads((out / "capture.json").read_bytes()) == report.capture
    assert report.capture["kind"]["name"] == "object"
    assert [photo["held_out"] for photo in report.capture["photos"]].count(True) == 2
    assert {line["label"] for line in report.capture["lines"]} >= {"photos", "format", "scene", "coverage", "expected"}
    assert Image.open(out / "capture.png").size[0] > 1000


def test_figures_are_those_of_the_written_asset(capture: Path, out: Path, report: Report) -> None:
    scene = read_glb((out / "scene.glb").read_bytes())
    again = evaluate(scene, read_capture(capture).test)
    assert report.psnr.mean == again.psnr
    assert report.ssim.mean == again.ssim
    assert report.psnr.per_view == {view.name: view.psnr for view in again.views}
    assert (report.quads, report.triangles, report.pages) == (
        scene.quad_count,
        scene.triangle_count,
        len(scene.pages),
    )


def test_report_tells_sizes_seconds_and_settings(out: Path, report: Report) -> None:
    assert report.bytes == {name: (out / name).stat().st_size for name in ("scene.glb", "preview.png")}
    assert set(report.seconds) == {"read", "region", "voxels", "field", "texels", "bake", "export", "measure", "total"}
    assert report.settings.items() >= TINY.items()
    assert (report.settings["preset"], report.settings["seed"], report.device) == ("draft", 0, "cpu")
    assert report.views == {"train": 8, "test": 2}


def test_report_has_no_infinity(out: Path) -> None:
    json.loads((out / "report.json").read_bytes(), parse_constant=pytest.fail)


def test_preview_is_a_picture_of_something(out: Path) -> None:
    image = np.asarray(Image.open(out / "preview.png"))
    assert image.shape == (512, 512, 3)
    assert image.std() > 0


@pytest.mark.slow
def test_photos_without_poses_become_an_asset_and_are_posed_once(tmp_path: Path) -> None:
    room.write_photos(tmp_path / "photos", count=9)
    words = ["convert", str(tmp_path / "photos"), "-o", str(tmp_path / "out"), "--preset", "draft", "--device", "cpu"]
    words += ["--max-size-px", "120", *(word for assignment in ASSIGNMENTS for word in ("--set", assignment))]
    reports = []
    for _ in range(2):
        assert main(words) == 0
        reports.append(Report.from_bytes((tmp_path / "out" / "report.json").read_bytes()))
        assert read_glb((tmp_path / "out" / "scene.glb").read_bytes()).quad_count > 0
    assert reports[0].views == {"train": 7, "test": 2}
    assert reports[0].capture["posing"]["registered"] == 9
    assert set(reports[0].seconds) > {"features", "matching", "mapping"}
    assert reports[0].capture["posing"] == reports[1].capture["posing"]  # its seconds, too: it was not done again


def test_job_of_the_service_gives_the_same_asset(tmp_path: Path, out: Path) -> None:
    settings = ServiceSettings(data=tmp_path / "data", viewer=None, poll_s=0.1)
    with RunningService(settings) as service, Worker(settings):
        archive = {"tiny.zip": zipped(capture_files())}
        job = service.wait(service.post(archive, preset="draft", device="cpu", set=ASSIGNMENTS), timeout_s=60)
        assert (job["state"], job["problem"]) == ("succeeded", None)
        glb = service.client.get(f"/jobs/{job['id']}/artifacts/scene.glb").content
        report = Report.from_bytes(service.client.get(f"/jobs/{job['id']}/artifacts/report.json").content)
    assert job["psnr"] == report.psnr.mean
    assert read_glb(glb).quad_count == report.quads
    # Threads add floats in any order, so two runs agree closely rather than in every bit.
    first = Report.from_bytes((out / "report.json").read_bytes())
    assert report.psnr.mean == pytest.approx(first.psnr.mean, abs=0.5)
