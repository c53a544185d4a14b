"""Our reading of COLMAP's cameras and files against pycolmap's."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from core.datasets.colmap import read_model
from core.datasets.colmap_model import PARAMETERS, lens_of_model

ROOT = Path(__file__).parents[3]
POINTS = np.stack(np.meshgrid(np.linspace(-0.8, 0.8, 9), np.linspace(-0.6, 0.6, 9)), -1).reshape(-1, 2)
VALUES = {
    "f": 500.0, "fx": 500.0, "fy": 510.0, "cx": 321.0, "cy": 237.0, "k1": -0.1, "k2": 0.03, "k3": -0.004, "k4": 0.002,
    "p1": 0.003, "p2": -0.002, "d1": 0.05, "d2": -0.01, "d3": 0.003, "s1": 0.004, "s2": -0.003,
}  # fmt: skip


def ask(*arguments):
    command = [sys.executable, "-m", "tests.unit.datasets.colmap_oracle", *map(str, arguments)]
    output = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return json.loads(output.splitlines()[-1])


def parameters_of(model):
    return [VALUES[name] for name in PARAMETERS[model][1].split()]


@pytest.fixture(scope="module")
def lens_pixels(tmp_path_factory):
    """Where pycolmap's lenses show POINTS, by model."""
    question = tmp_path_factory.mktemp("lenses") / "lenses.json"
    cases = [[model, parameters_of(model)] for model in PARAMETERS]
    question.write_text(json.dumps({"cases": cases, "points": POINTS.tolist()}))
    return dict(zip(PARAMETERS, map(np.array, ask(question)), strict=True))


@pytest.fixture(scope="module")
def synthetic_model(tmp_path_factory):
    """(folder with bin and txt, what they hold)."""
    folder = tmp_path_factory.mktemp("model")
    return folder, ask("model", folder)


@pytest.mark.parametrize("model", PARAMETERS)
def test_lens_shows_points_where_colmap_does(lens_pixels, model):
    lens = lens_of_model(model, (640, 480), parameters_of(model))
    # The same formulas in float64; sums in another order.
    np.testing.assert_allclose(lens.pixels(lens.distortion.distort(POINTS)), lens_pixels[model], atol=1e-9)


@pytest.mark.parametrize("model", PARAMETERS)
def test_lens_is_undone(model):
    lens = lens_of_model(model, (640, 480), parameters_of(model))
    np.testing.assert_allclose(lens.distortion.undistort(lens.distortion.distort(POINTS)), POINTS, atol=1e-8)
    assert lens.pinhole.distortion.is_none


@pytest.mark.parametrize("form", ["bin", "txt"])
def test_model_is_read_as_colmap_reads_it(synthetic_model, form):
    folder, expected = synthetic_model
    model = read_model(folder / form / f"cameras.{form}")
    assert {image.name for image in model.images} == expected["images"].keys()
    for image in model.images:
        theirs, lens = expected["images"][image.name], model.lenses[image.camera_id]
        opengl = np.array(theirs["world_from_camera"]) * [1, -1, -1, 1]
        np.testing.assert_allclose(image.world_from_camera[:3], opengl, atol=1e-12)
        assert lens == lens_of_model("OPENCV", tuple(theirs["size_px"]), theirs["parameters"])
    np.testing.assert_allclose(sorted(model.points.positions.tolist()), sorted(expected["points"]), atol=1e-12)


@pytest.mark.parametrize("form", ["bin", "txt"])
def test_each_image_observes_what_colmap_says(synthetic_model, form):
    folder, expected = synthetic_model
    model = read_model(folder / form / f"cameras.{form}")
    observed = model.points.observed_by()
    for image in model.images:
        theirs = [p for p, names in zip(expected["points"], expected["tracks"], strict=True) if image.name in names]
        np.testing.assert_allclose(sorted(observed[image.image_id].tolist()), sorted(theirs), atol=1e-12)


def test_both_forms_hold_the_same(synthetic_model):
    folder, _ = synthetic_model
    binary, text = (read_model(folder / form / f"cameras.{form}") for form in ("bin", "txt"))
    assert binary.lenses == text.lenses
    for one, other in zip(binary.images, text.images, strict=True):
        assert (one.image_id, one.camera_id, one.name) == (other.image_id, other.camera_id, other.name)
        np.testing.assert_array_equal(one.world_from_camera, other.world_from_camera)
    np.testing.assert_array_equal(binary.points.positions, text.points.positions)
    np.testing.assert_array_equal(binary.points.track_images, text.points.track_images)
