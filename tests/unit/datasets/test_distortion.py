"""The lens model against itself, against differences, and against photos of a known pattern."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from PIL import Image

from core.datasets import check_capture, read_capture
from core.datasets.distortion import Distortion
from core.datasets.lens import Lens
from core.datasets.undistortion import undistorted
from core.errors import PosesInvalid
from tests.unit.datasets.captures import nerfstudio

FOX = Distortion(k1=0.0578421, k2=-0.0805099, p1=-0.000980296, p2=0.00015575)

mild = st.builds(
    Distortion,
    k1=st.floats(-0.15, 0.15),
    k2=st.floats(-0.05, 0.05),
    k3=st.floats(-0.01, 0.01),
    k4=st.floats(-0.002, 0.002),
    p1=st.floats(-0.01, 0.01),
    p2=st.floats(-0.01, 0.01),
    d1=st.sampled_from([0.0, 0.05, -0.05]),
    d2=st.floats(-0.01, 0.01),
    d3=st.sampled_from([0.0, 0.003]),
    s1=st.floats(-0.01, 0.01),
    s2=st.floats(-0.01, 0.01),
    fisheye=st.booleans(),
)


def grid(half=0.7, count=15):
    x, y = np.meshgrid(np.linspace(-half, half, count), np.linspace(-half, half, count))
    return np.stack([x, y], -1)


@settings(max_examples=50, deadline=None)
@given(mild)
def test_distort_undoes_undistort(distortion):
    points = grid()
    assume(np.linalg.det(distortion.jacobian(points)).min() > 0.2)
    seen = distortion.distort(points)
    # Newton runs to the last bits of float64; 1e-9 of the focal length is a millionth of a pixel.
    np.testing.assert_allclose(distortion.distort(distortion.undistort(seen)), seen, atol=1e-9)
    np.testing.assert_allclose(distortion.undistort(seen), points, atol=1e-8)


@settings(max_examples=50, deadline=None)
@given(mild)
def test_jacobian_equals_central_differences(distortion):
    points, step = grid(), 1e-6
    for axis in range(2):
        offset = step * np.eye(2)[axis]
        difference = (distortion.distort(points + offset) - distortion.distort(points - offset)) / (2 * step)
        # Differences of float64 over 1e-6 keep about ten digits.
        np.testing.assert_allclose(distortion.jacobian(points)[..., axis], difference, atol=1e-8)


def test_published_example():
    # OpenCV's formula by hand at (0.5, -0.25), r² = 0.3125.
    x, y = Distortion(k1=0.1, k2=0.01, p1=0.001, p2=0.002).distort(np.array([0.5, -0.25]))
    radial = 1 + 0.03125 + 0.0009765625
    assert x == pytest.approx(0.5 * radial + 2 * 0.001 * 0.5 * -0.25 + 0.002 * (0.3125 + 0.5))
    assert y == pytest.approx(-0.25 * radial + 0.001 * (0.3125 + 0.125) + 2 * 0.002 * 0.5 * -0.25)


def test_points_without_preimage_are_nan():
    # r (1 - r²) never exceeds 0.385.
    assert np.isnan(Distortion(k1=-1.0).undistort(np.array([[0.5, 0.0]]))).all()


@settings(max_examples=30, deadline=None)
@given(mild, st.integers(20, 90), st.integers(20, 90))
def test_every_pixel_of_the_pinhole_photo_was_seen(distortion, width, height):
    # Corners lie within 0.66 focal lengths, where none of the mild lenses folds.
    lens = Lens((100.0, 103.0), (width * 0.48, height * 0.53), (width, height), distortion)
    pinhole = lens.pinhole
    x, y = np.meshgrid(np.arange(pinhole.size_px[0]) + 0.5, np.arange(pinhole.size_px[1]) + 0.5)
    seen = lens.pixels(distortion.distort(pinhole.normalised(np.stack([x, y], -1))))
    # Edges are sampled at 129 points, which misses their extremes by less than a twentieth of a pixel.
    assert seen.min() > 0.5 - 0.05
    assert (seen.max((0, 1)) < np.array([width, height]) - 0.5 + 0.05).all()


@pytest.mark.parametrize("focal", [20.0, 26.0, 40.0])
def test_fisheye_photo_is_cut_at_55_degrees(focal):
    # A circular fisheye: 80 px across, of 230, 176 and 115 degrees.
    pinhole = Lens((focal, focal), (40.0, 40.0), (80, 80), Distortion(fisheye=True)).pinhole
    reach = np.degrees(np.arctan(pinhole.size_px[0] / 2 / focal))
    assert reach == pytest.approx(55, abs=2)


def test_fisheye_photo_of_a_narrow_lens_is_kept_whole():
    lens = Lens((100.0, 100.0), (40.0, 30.0), (80, 60), Distortion(k1=-0.01, fisheye=True))
    assert lens.pinhole.size_px[0] >= 80


def test_pinhole_frame_is_as_large_as_it_can_be():
    lens = Lens((60.0, 60.0), (40.0, 30.0), (80, 60), Distortion(k1=-0.1))
    pinhole = lens.pinhole
    assert pinhole.size_px[0] > 80  # barrel: straight rays reach further out
    larger = np.array([[-0.5, 0.5 + row] for row in range(pinhole.size_px[1])])
    assert lens.pixels(lens.distortion.distort(pinhole.normalised(larger)))[:, 0].min() < 0.5


def wave(points):
    """A smooth pattern [..., 3] in 0..255 over normalised coordinates."""
    x, y = points[..., 0], points[..., 1]
    return 127 + 100 * np.stack([np.sin(9 * x), np.cos(8 * y), np.sin(6 * (x + y))], -1)


@pytest.mark.parametrize(
    "distortion",
    [
        FOX,
        Distortion(k1=-0.2, k2=0.03),
        Distortion(k1=0.15, p1=0.01, p2=-0.008),
        Distortion(k1=0.1, d1=0.15, s1=0.01),
        Distortion(k1=-0.05, k4=0.01, fisheye=True),
    ],
)
def test_undistorted_photo_shows_what_a_pinhole_sees(distortion):
    lens = Lens((150.0, 148.0), (80.3, 59.1), (160, 120), distortion)
    x, y = np.meshgrid(np.arange(160) + 0.5, np.arange(120) + 0.5)
    photo = np.rint(wave(distortion.undistort(lens.normalised(np.stack([x, y], -1))))).astype(np.uint8)
    result = undistorted(photo, lens)
    pinhole = lens.pinhole
    x, y = np.meshgrid(np.arange(pinhole.size_px[0]) + 0.5, np.arange(pinhole.size_px[1]) + 0.5)
    expected = wave(pinhole.normalised(np.stack([x, y], -1)))
    # Two roundings to 8 bits (1 level), and bilinear error: second derivative 8100 / 150² px, over 8, two directions.
    np.testing.assert_allclose(result, expected, atol=1.2)


def test_strips_equal_the_whole(monkeypatch):
    lens = Lens((50.0, 50.0), (20.0, 15.0), (40, 30), FOX)
    photo = np.random.default_rng(0).integers(0, 256, (30, 40, 4), np.uint8)
    whole = undistorted(photo, lens)
    monkeypatch.setattr("core.datasets.undistortion.STRIP_PIXELS", 50)
    np.testing.assert_array_equal(undistorted(photo, lens), whole)


def test_colours_of_transparent_pixels_do_not_bleed():
    photo = np.zeros((30, 40, 4), np.uint8)
    photo[..., 1] = 255
    photo[:, 20:] = (255, 0, 0, 255)
    result = undistorted(photo, Lens((50.0, 50.0), (20.0, 15.0), (40, 30), FOX))
    visible = result[..., 3] > 0
    assert (result[visible][:, :2] == [255, 0]).all()


@pytest.mark.parametrize(
    "distortion",
    [
        Distortion(k1=-3.0),
        Distortion(k1=-1.2, k2=0.1),
        Distortion(p1=2.0),
        Distortion(k1=1e300),
        Distortion(k1=-1e30, k2=1e30),
        Distortion(k1=-0.33),
    ],
)
def test_distortion_that_cannot_be_undone_is_refused(distortion):
    # Half a photo diagonal is 0.94 focal lengths: r (1 - 0.33 r²) still rises there, but its slope has all but gone.
    lens = Lens((64.0, 64.0), (48.0, 36.0), (96, 72), distortion)
    with pytest.raises(PosesInvalid, match="must be invertible"):
        _ = lens.pinhole


def test_capture_with_distortion_is_undistorted_on_reading(tmp_path):
    nerfstudio(tmp_path, size=(80, 60), fl_x=60.0, fl_y=60.0, cx=40.0, cy=30.0, k1=-0.1)
    photo = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)
    Image.fromarray(photo).save(tmp_path / "images/0001.png")
    lens = check_capture(tmp_path).train[0].lens
    view = read_capture(tmp_path).train[0]
    assert lens.distortion == Distortion(k1=-0.1)
    assert view.camera.size_px == lens.pinhole.size_px
    np.testing.assert_array_equal(view.image_u8, undistorted(photo, lens))
