"""Coverage, wording and picture, on rings of cameras."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.camera import Camera
from core.capture import Capture, View
from core.capture_report import coverage_picture, report_of_capture, report_of_unposed
from core.capture_report.coverage import coverage_of, nearest_camera_deg
from core.capture_report.expectation import FACTOR, expected
from core.capture_report.wording import duration
from core.posing.posing import LeftOut, Posing
from core.presets import settings_for
from core.scene_kind import FORWARD, SceneKind
from tests.unit.capture_report.test_photo_quality import textured

SIZE_PX = (240, 180)


def camera_at(name: str, heading_deg: float, elevation_deg: float) -> Camera:
    heading, elevation = np.radians([heading_deg, elevation_deg])
    back = np.array([np.cos(elevation) * np.cos(heading), np.cos(elevation) * np.sin(heading), np.sin(elevation)])
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(back, right), back, back], -1)
    return Camera(name, pose, (200.0, 200.0), (120.0, 90.0), SIZE_PX)


def views(headings: np.ndarray, elevation_deg: float = 20.0) -> list[View]:
    return [View(camera_at(f"p{i}", h, elevation_deg), textured(i)) for i, h in enumerate(headings)]


def capture_of(found: list[View], held_out: int = 0, kind: str = "object", **fields: object) -> Capture:
    return Capture(tuple(found[held_out:]), tuple(found[:held_out]), kind=SceneKind(kind, "the test says so"), **fields)


def test_ring_covers_all_around_but_not_the_top() -> None:
    coverage = coverage_of(views(np.arange(0, 360, 15)))
    assert coverage.gap_deg == pytest.approx(15, abs=0.01)
    assert coverage.elevation_deg == pytest.approx((20, 20), abs=0.01)
    # The band within 20 degrees of the ring's 20 lies between 0 and about 40: sin(40) of the hemisphere.
    assert coverage.upper_share == pytest.approx(np.sin(np.radians(40)), abs=0.05)


def test_arc_leaves_a_gap() -> None:
    assert coverage_of(views(np.linspace(0, 90, 10))).gap_deg == pytest.approx(270, abs=0.01)
    assert coverage_of(views(np.array([10.0]))).gap_deg == 360


def test_spread_is_in_the_users_units() -> None:
    near = coverage_of(views(np.linspace(-10, 10, 5)))
    assert coverage_of(views(np.linspace(-10, 10, 5)), user_unit=3.0).spread == pytest.approx(np.array(near.spread) * 3)


def test_nearest_camera_is_an_angle() -> None:
    assert nearest_camera_deg(np.eye(3), np.array([[1.0, 0, 0]])) == pytest.approx([0, 90, 90])


def test_report_is_json_and_names_what_it_flags() -> None:
    found = views(np.arange(0, 360, 15))
    found[4] = replace(found[4], image_u8=np.full((180, 240, 3), 100, np.uint8))
    report = report_of_capture(capture_of(found, held_out=3), "a format", expected(settings_for("draft"), 10**6))
    value = json.loads(json.dumps(report.as_json(), allow_nan=False))
    assert [photo["name"] for photo in value["photos"] if photo["blurred"]] == ["p4"]
    assert sum(photo["held_out"] for photo in value["photos"]) == 3
    blur = next(line for line in report.lines() if line.label == "blur")
    assert blur.warns
    assert "p4 (0% of the usual sharpness)" in blur.text
    assert 8 <= len(report.lines()) <= 14
    assert report.as_table().count("\n") == len(report.lines()) - 1


def test_one_sided_object_is_warned_of() -> None:
    lines = report_of_capture(capture_of(views(np.linspace(0, 60, 24))), "a format").lines()
    coverage = next(line for line in lines if line.label == "coverage")
    assert coverage.warns
    assert "60 of 360 degrees" in coverage.text


def test_held_out_photos_are_named() -> None:
    lines = report_of_capture(capture_of(views(np.arange(0, 360, 12)), held_out=6), "a format").lines()
    assert lines[0].text == "30: 24 to train on, 6 held out to measure (p0, p1, p2, p3 and 2 more)"


def test_posing_and_left_out_photos_are_told() -> None:
    posing = Posing(
        Path("."), ("a", "b", "c"), (LeftOut("d", "without matches"), LeftOut("e", "without matches")),
        cameras=1, points=900, error_px=0.7, seconds={"features": 5.0, "matching": 7.0},
    )  # fmt: skip
    report = report_of_capture(capture_of(views(np.arange(0, 360, 15))), "a format", posing=posing)
    texts = {line.label: line for line in report.lines()}
    assert texts["poses"].text == "3 of 5 photos posed in 12 s; 900 points, off by 0.70 px on average"
    assert texts["poses"].warns
    assert texts["left out"].text == "2 without matches: d, e"


def test_report_of_photos_that_cannot_be_posed_says_so(tmp_path: Path) -> None:
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "a.png").write_bytes(b"broken")
    report = report_of_unposed("photos", Posing(tmp_path, (), (LeftOut("a.png", "cannot be decoded"),)))
    assert not report.is_usable
    assert next(line.text for line in report.lines() if line.warns) == "1, none of them used"
    json.dumps(report.as_json(), allow_nan=False)


@pytest.mark.parametrize("kind", ["object", "unbounded", FORWARD])
def test_picture_marks_training_held_out_and_flagged_photos(kind: str) -> None:
    found = views(np.arange(0, 360, 15) if kind != FORWARD else np.linspace(-10, 10, 24))
    found[7] = replace(found[7], image_u8=np.full((180, 240, 3), 100, np.uint8))
    points = np.random.default_rng(0).normal(0, 0.2, (500, 3))
    capture = capture_of(found, held_out=3, kind=kind, points=points)
    picture = coverage_picture(capture, report_of_capture(capture, "a format").photos)
    assert (picture.dtype, picture.ndim) == (np.uint8, 3)
    colors = {tuple(color) for color in picture.reshape(-1, 3).tolist()}
    assert colors >= {(36, 92, 214), (232, 132, 12), (206, 34, 50)}


def test_expectation_grows_with_preset_and_shrinks_with_cores() -> None:
    draft, high = (expected(settings_for(name), 10**6, cores=2) for name in ("draft", "high"))
    assert high.seconds > 5 * draft.seconds
    assert high.glb_bytes > draft.glb_bytes
    assert expected(settings_for("draft"), 10**6, cores=8).seconds < draft.seconds
    assert expected(settings_for("draft"), 10**6, cores=2, surroundings=True).seconds > draft.seconds
    assert expected(settings_for("draft"), 10**6, "cuda").seconds is None
    assert FACTOR > 1


def test_durations_are_said_as_people_say_them() -> None:
    assert [duration(s) for s in (12, 99, 300, 7200)] == ["12 s", "99 s", "5 min", "2.0 h"]
