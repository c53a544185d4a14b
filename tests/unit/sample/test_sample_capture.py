"""The sample is reproducible, readable, and as difficult as it claims to be."""

import json
from functools import partial

import numpy as np
import pytest

from core.datasets import read_capture
from core.errors import OptionInvalid
from core.normalisation import pose_in_user_frame
from core.progress import Progress
from core.sample import sample_depth, write_sample_capture
from core.sample.cameras import hemisphere_cameras, orbit_cameras
from core.sample.design import design_of
from core.sample.still_life import still_life
from core.sample.studio import Studio

SIZE = {"size_px": 24, "train_views": 3, "test_views": 2}


def files_of(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module", autouse=True)
def few_lights():
    """Light takes most of a tiny sample's time, and its quality does not matter here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("core.sample.capture_writer.Studio", partial(Studio, lights=12))
        yield


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """(folder, progress reports) of a tiny sample."""
    folder, reports = tmp_path_factory.mktemp("sample"), []
    write_sample_capture(folder, **SIZE, progress=reports.append)
    return folder, reports


@pytest.fixture(scope="module")
def studio():
    return Studio(0, lights=24)


def test_same_seed_writes_the_same_bytes(written, tmp_path):
    write_sample_capture(tmp_path, **SIZE)
    assert files_of(tmp_path) == files_of(written[0])


def test_another_seed_shows_another_still_life(written, tmp_path):
    write_sample_capture(tmp_path, **SIZE, seed=1)
    ours, theirs = files_of(tmp_path), files_of(written[0])
    assert ours.keys() == theirs.keys()
    assert all(ours[name] != theirs[name] for name in ours)


def test_capture_is_readable(written):
    capture = read_capture(written[0])
    assert (len(capture.train), len(capture.test)) == (3, 2)
    assert capture.has_alpha
    for view, camera in zip(capture.train, hemisphere_cameras(3, 24, 0), strict=True):
        theirs = pose_in_user_frame(capture.user_from_object, view.camera)
        np.testing.assert_allclose(theirs, camera.world_from_camera, atol=1e-12)
        assert view.camera.focal_px == pytest.approx(camera.focal_px)


def test_layout_is_nerf_synthetics(written):
    fields = json.loads((written[0] / "transforms_train.json").read_text())
    assert fields["camera_angle_x"] == 0.69
    assert fields["frames"][2]["file_path"] == "./train/r_2"


def test_alpha_is_empty_full_and_fractional_at_silhouettes(written):
    for view in read_capture(written[0]).train:
        alpha = view.image_u8[..., 3]
        assert (alpha == 0).mean() > 0.1
        assert (alpha == 255).mean() > 0.1
        assert ((alpha > 0) & (alpha < 255)).any()


def test_object_stays_clear_of_the_photos_edges(studio):
    for camera in (*hemisphere_cameras(12, 32, 0), *orbit_cameras(6, 32, 0)):
        alpha = studio.photo(camera)[..., 3]
        assert not alpha[[0, -1]].any()
        assert not alpha[:, [0, -1]].any()


@pytest.mark.parametrize("seed", range(8))
def test_object_lies_within_its_box(seed):
    assert np.abs(still_life(design_of(seed)).positions).max() < 1.2


def test_normals_are_unit_and_finite():
    mesh = still_life(design_of(0))
    assert np.isfinite(mesh.positions).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-9)
    assert mesh.faces.max() < len(mesh.positions)


def test_some_of_the_surface_changes_with_the_view_and_most_does_not(studio):
    first, second = orbit_cameras(14, 96, 0)[:2]
    points = first.position + studio.depth(first)[..., None] * first.directions(first.pixel_centres())
    points, colours = points[np.isfinite(points[..., 0])], studio.photo(first)[np.isfinite(points[..., 0])]
    local = (points - second.position) @ second.world_from_camera[:3, :3]
    x = (second.centre_px[0] - second.focal_px[0] * local[:, 0] / local[:, 2]).astype(int)
    y = (second.centre_px[1] + second.focal_px[1] * local[:, 1] / local[:, 2]).astype(int)
    distance = np.linalg.norm(points - second.position, axis=1)
    both = (np.abs(studio.depth(second)[y, x] - distance) < 0.02) & (colours[:, 3] == 1)
    change = np.abs(studio.photo(second)[y, x] - colours)[both, :3].max(1)
    assert both.sum() > 500
    # Matt texture moves by a fraction of a pixel only; the window's reflection goes from blue to white.
    assert np.median(change) < 0.1
    assert np.quantile(change, 0.98) > 0.3


def test_photo_is_premultiplied(studio):
    photo = studio.photo(hemisphere_cameras(4, 32, 0)[1])
    assert (photo[..., :3] <= photo[..., 3:] + 1e-6).all()
    assert photo.min() >= 0


def test_depth_is_that_of_the_photo(studio):
    camera = hemisphere_cameras(4, 32, 0)[1]
    depth, alpha = studio.depth(camera), studio.photo(camera, subsamples=1)[..., 3]
    np.testing.assert_array_equal(np.isfinite(depth), alpha > 0)
    points = camera.position + depth[..., None] * camera.directions(camera.pixel_centres())
    assert np.abs(points[alpha > 0]).max() < 1.2
    np.testing.assert_array_equal(sample_depth(camera), depth)


def test_depth_equals_the_nearest_triangle_by_brute_force(studio):
    camera = hemisphere_cameras(4, 8, 0)[2]
    mesh, depth = still_life(design_of(0)), studio.depth(camera)
    directions = camera.directions(camera.pixel_centres())
    a, b, c = (mesh.positions[mesh.faces[:, corner]] for corner in range(3))
    for row, column in ((3, 3), (4, 4), (5, 3), (0, 0)):
        # Möller and Trumbore 1997, without culling.
        across = np.cross(directions[row, column], c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / np.einsum("ij,ij->i", b - a, across)
            u = np.einsum("ij,ij->i", camera.position - a, across) * inverse
            q = np.cross(camera.position - a, b - a)
            v = q @ directions[row, column] * inverse
            t = np.einsum("ij,ij->i", c - a, q) * inverse
            # A ray parallel to a triangle, or a triangle without area, gives NaN, which no comparison lets through.
            hits = t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)]
        # float32 over a distance of four units.
        np.testing.assert_allclose(depth[row, column], hits.min(initial=np.inf), atol=1e-5)


def test_cameras_look_at_the_object_from_everywhere():
    cameras = hemisphere_cameras(60, 100, 0)
    positions = np.array([camera.position for camera in cameras]) / 4.03
    np.testing.assert_allclose(np.linalg.norm(positions, axis=1), 1)
    apart = np.linalg.norm(positions[:, None] - positions, axis=-1) + 9 * np.eye(60)
    assert apart.min() > 0.1  # none twice; 60 evenly spread ones would be 0.32 apart
    assert apart.min(1).max() < 0.6  # and no gap


def test_progress_rises_to_one(written):
    fractions = [report.fraction for report in written[1]]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1
    assert all(isinstance(report, Progress) for report in written[1])


@pytest.mark.parametrize("option", [{"seed": -1}, {"size_px": 0}, {"train_views": 1}, {"test_views": 0}])
def test_senseless_options_are_refused(tmp_path, option):
    with pytest.raises(OptionInvalid):
        write_sample_capture(tmp_path, **option)
