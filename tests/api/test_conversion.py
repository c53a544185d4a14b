"""The whole path on a tiny capture, with the real trainer: through the command line and through the service."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from core.datasets import read_capture
from core.evaluation import evaluate
from exporters.gltf import read_glb
from exporters.viewer.bundle import VIEWER
from service.cli import main
from service.formats import FORMATS
from service.formats.exporting import NO_VIEWS
from service.formats.provenance import in_glb
from service.report import Report
from service.settings import ServiceSettings
from tests.api.captures import capture_files, write_files, zipped
from tests.api.running import RunningService, Worker, wait_until
from tests.unit.posing import room

TINY = {"cells": 8, "patch": 2, "nodes": 16, "voxel_steps": 30, "field_steps": 20, "texel_steps": 20}
VIEWER_IS_INSTALLED = (VIEWER / "node_modules" / "three").is_dir()
ASSIGNMENTS = [f"{name}={value}" for name, value in TINY.items()]


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_files(tmp_path_factory.mktemp("capture"), capture_files())


@pytest.fixture(scope="module")
def out(capture: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `polyfield convert` has filled, with every format."""
    out = tmp_path_factory.mktemp("out") / "new"
    settings = [word for assignment in ASSIGNMENTS for word in ("--set", assignment)]
    words = ["convert", str(capture), "-o", str(out), "--preset", "draft", "--device", "cpu", "--formats", "all"]
    status = main([*words, *settings])
    assert status == (0 if VIEWER_IS_INSTALLED else 1)
    return out


@pytest.fixture(scope="module")
def report(out: Path) -> Report:
    return Report.from_bytes((out / "report.json").read_bytes())


def test_conversion_leaves_its_files_and_no_checkpoint(out: Path) -> None:
    names = {path.name for path in out.iterdir()}
    made = {form.file for name, form in FORMATS.items() if VIEWER_IS_INSTALLED or name not in ("viewer", "html")}
    assert names == {"preview.png", "report.json", "capture.json", "capture.png"} | made


def test_every_format_is_reported_with_bytes_and_quality(out: Path, report: Report) -> None:
    assert list(report.formats) == list(FORMATS)
    for row in report.formats.values():
        if row.problem:
            assert row.problem.startswith("viewer-missing: ")
            continue
        assert row.bytes == (out / row.file).stat().st_size
        assert row.psnr is not None
    for exact in ("glb", "gltf", "usd"):
        assert report.formats[exact].psnr == report.psnr.mean
    for near in ("web", "mobilenerf"):  # each is compared with few and small photos
        assert report.formats[near].psnr == pytest.approx(report.psnr.mean, abs=0.5)
    for plain in ("lq", "quicklook", "obj", "ply"):
        assert report.formats[plain].psnr == pytest.approx(report.psnr.mean, abs=4.0)
    table = report.as_table()
    assert all(form.file in table for form in FORMATS.values())


def test_scene_is_exported_again_without_training(
    capture: Path, out: Path, report: Report, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", str(out / "scene.glb"), "-o", str(tmp_path), "--formats", "glb,web,obj", "--device", "cpu"]
    assert main([*words, "--capture", str(capture)]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"scene.glb", "scene.web.glb", "scene.obj.zip", "export.json"}
    rows = json.loads((tmp_path / "export.json").read_bytes())["formats"]
    for name, row in rows.items():
        assert row["psnr"] == pytest.approx(report.formats[name].psnr, abs=1e-6)
        assert row["bytes"] == report.formats[name].bytes
    assert "scene.obj.zip" in capsys.readouterr().out


def test_where_the_scene_comes_from_is_kept_in_every_gltf(out: Path, capture: Path) -> None:
    known = in_glb((out / "scene.glb").read_bytes())
    assert known is not None
    assert (known.title, known.source) == (capture.stem, capture.name)
    assert known.settings["cells"] == TINY["cells"]
    assert in_glb((out / "scene.web.glb").read_bytes()) == in_glb((out / "scene.lq.glb").read_bytes()) == known


def test_export_beside_its_scene_brings_the_report_up_to_date(capture: Path, out: Path, tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    folder.mkdir()
    for name in ("scene.glb", "report.json"):
        (folder / name).write_bytes((out / name).read_bytes())
    before = Report.from_bytes((folder / "report.json").read_bytes())
    glb = (folder / "scene.glb").read_bytes()
    assert main(["export", str(folder / "scene.glb"), "-o", str(folder), "--formats", "lq"]) == 0
    after = Report.from_bytes((folder / "report.json").read_bytes())
    assert (after.psnr, after.settings, after.capture) == (before.psnr, before.settings, before.capture)
    assert (after.formats["lq"].psnr, after.formats["lq"].note) == (None, NO_VIEWS)
    assert after.formats["web"] == before.formats["web"]
    assert (folder / "scene.glb").read_bytes() == glb
    assert not (folder / "export.json").exists()


@pytest.mark.parametrize("name", ["scene.web.glb", "scene.gltf.zip", "scene.usd.zip", "scene.mobilenerf.zip"])
def test_every_form_that_holds_the_network_can_be_exported(out: Path, tmp_path: Path, name: str) -> None:
    assert main(["export", str(out / name), "-o", str(tmp_path), "--formats", "glb"]) == 0
    assert read_glb((tmp_path / "scene.glb").read_bytes()).quad_count > 0


@pytest.mark.parametrize(
    ("scene", "words", "code"),
    [
        ("scene.glb", ["--formats", "fbx"], "unknown-format"),
        ("scene.glb", ["--downscale", "0"], "option-invalid"),
        ("scene.glb", ["--capture", "nothing"], "capture-not-found"),
        ("nothing.glb", [], "capture-not-found"),
        ("preview.png", [], "asset-invalid"),
        ("scene.obj.zip", [], "asset-invalid"),
    ],
)
def test_export_that_cannot_start_is_status_2_and_leaves_nothing(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], scene: str, words: list[str], code: str
) -> None:
    assert main(["export", str(out / scene), "-o", str(tmp_path / "new"), *words]) == 2
    assert f"error [{code}]: " in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


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
    names = {"scene.glb", "preview.png", *(row.file for row in report.formats.values() if not row.problem)}
    assert report.bytes == {name: (out / name).stat().st_size for name in names}
    stages = {"read", "region", "voxels", "field", "texels", "bake", "export", "measure", "formats", "total"}
    assert set(report.seconds) == stages
    assert list(report.seconds)[-1] == "total"
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
        fields = {"preset": "draft", "device": "cpu", "set": ASSIGNMENTS, "formats": "lq"}
        job = service.wait(service.post(archive, **fields), timeout_s=60)
        assert (job["state"], job["problem"], list(job["formats"])) == ("succeeded", None, ["glb", "lq"])
        service.client.post(f"/jobs/{job['id']}/exports", json={"formats": ["web", "obj"]})
        wait_until(lambda: service.job(job["id"])["export"]["state"] in ("succeeded", "failed"), 60)
        job = service.job(job["id"])
        assert (job["export"]["state"], job["export"]["problem"]) == ("succeeded", None)
        assert list(job["formats"]) == ["glb", "web", "lq", "obj"]
        web = service.client.get(f"/jobs/{job['id']}/artifacts/scene.web.glb").content
        glb = service.client.get(f"/jobs/{job['id']}/artifacts/scene.glb").content
        report = Report.from_bytes(service.client.get(f"/jobs/{job['id']}/artifacts/report.json").content)
    assert job["psnr"] == report.psnr.mean
    assert read_glb(glb).quad_count == report.quads
    assert report.formats["glb"].psnr == pytest.approx(report.psnr.mean, abs=1e-6)  # measured anew by the export
    assert len(web) == report.formats["web"].bytes == job["formats"]["web"]["bytes"]
    assert report.formats["web"].psnr == pytest.approx(report.psnr.mean, abs=0.5)
    # Threads add floats in any order, so two runs agree closely rather than in every bit.
    first = Report.from_bytes((out / "report.json").read_bytes())
    assert report.psnr.mean == pytest.approx(first.psnr.mean, abs=0.5)
