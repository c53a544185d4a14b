"""The whole way from a capture to a scene, at toy sizes."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from core import reconstruct as module
from core.baked import BakedScene
from core.camera import Camera
from core.capture import Capture
from core.checkpoint import FILE_NAME, CheckpointFile
from core.errors import CheckpointInvalid, OptionInvalid, TrainingFailed
from core.evaluation import evaluate
from core.presets import PRESETS, Settings, settings_for
from core.progress import Progress
from core.reconstruct import Reconstruction, reconstruct, stage_shares
from core.training import surfacing
from core.training.tracer import Tracer
from core.training.voxel_stage import VoxelStage
from tests.unit.training.captures import ball, capture_of

TRAINING_STAGES = ("voxels", "field", "texels")
SETTINGS = settings_for(
    "draft", cells=12, patch=3, nodes=20, voxel_steps=80, field_steps=40, texel_steps=40,
    voxel_batch=512, field_batch=512, texel_batch=256,
)  # fmt: skip
# Within each stage, and where one stage has ended and the next has not begun.
MOMENTS = (("voxels", 0.1), ("voxels", 0.6), ("field", 0.0), ("field", 0.6), ("texels", 0.6), ("bake", 0.0))
HASTY = replace(SETTINGS, voxel_steps=30, field_steps=15, texel_steps=15)


@pytest.fixture(autouse=True, scope="module")
def small_survey() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surfacing, "SURVEY_RAYS", 32_768)
        patch.setattr(module, "REPORT_INTERVAL_S", 0.0)  # reports of every step
        yield


@pytest.fixture(scope="module")
def capture() -> Capture:
    return capture_of(ball())


@pytest.fixture(scope="module")
def told() -> list[Progress]:
    """What the undisturbed run reported."""
    return []


@pytest.fixture(scope="module")
def undisturbed(capture: Capture, told: list[Progress]) -> Reconstruction:
    return reconstruct(capture, SETTINGS, device="cpu", progress=told.append)


def psnr_of(scene: BakedScene, capture: Capture) -> float:
    return evaluate(scene, capture.test, device="cpu").psnr


def assert_same_bytes(a: BakedScene, b: BakedScene) -> None:
    assert len(a.pages) == len(b.pages)
    for one, other in zip(a.pages, b.pages, strict=True):
        for name in ("features_u8", "colors_u8", "positions", "texcoords", "triangles"):
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
    for one, other in zip(
        (*a.network.weights, *a.network.biases), (*b.network.weights, *b.network.biases), strict=True
    ):
        assert one.tobytes() == other.tobytes()


def test_a_capture_becomes_a_scene_that_looks_like_it(capture, undisturbed):
    scene = undisturbed.scene
    # A ball of 32 pixels, learnt in 160 small steps: far above the 11 dB of an empty scene.
    assert psnr_of(scene, capture) > 17.0
    assert scene.background == capture.background
    np.testing.assert_array_equal(scene.asset_from_object, capture.asset_from_object)
    assert [camera.name for camera in scene.cameras] == [view.camera.name for view in capture.test]
    assert not undisturbed.resumed


def test_the_scene_holds_what_was_photographed_where_it_was(undisturbed):
    low, high = undisturbed.scene.bounds()
    assert np.abs(low + high).max() < 0.4  # around the origin, to within a cell of the mesh
    assert (high - low).min() / 2 > 0.6
    assert (high - low).max() / 2 < 1.1


def test_only_quads_that_a_photo_sees_are_kept(undisturbed):
    for page in undisturbed.scene.pages:
        assert len(page.positions) == 2 * len(page.triangles)
    # Each quad has an opaque texel; only opaque texels have a colour.
    opaque = [page.features_u8[..., 0] > 0 for page in undisturbed.scene.pages]
    assert sum(int(mask.sum()) for mask in opaque) >= undisturbed.scene.quad_count
    for page, mask in zip(undisturbed.scene.pages, opaque, strict=True):
        assert not page.colors_u8[~mask].any()


def test_progress_goes_through_the_stages_never_falls_and_ends_at_one(undisturbed, told):
    fractions = [report.fraction for report in told]
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] < 0.02
    assert fractions[-1] == pytest.approx(1.0)
    stages = list(dict.fromkeys(report.stage for report in told))
    assert stages == [*TRAINING_STAGES, "bake"]
    assert all(report.psnr is not None and np.isfinite(report.psnr) for report in told)


def test_every_stage_tells_its_seconds(undisturbed):
    assert set(stage_shares(SETTINGS)) <= set(undisturbed.seconds)
    assert all(seconds > 0 for seconds in undisturbed.seconds.values())


@dataclass(frozen=True)
class Watched:
    """A run with a checkpoint after every step, and what was seen meanwhile."""

    result: Reconstruction
    previews: list[np.ndarray]
    checkpoints: dict[tuple[str, float], bytes]  # as they lay on disk once a share of a stage was done


@pytest.fixture(scope="module")
def watched(capture: Capture, tmp_path_factory: pytest.TempPathFactory) -> Watched:
    folder = tmp_path_factory.mktemp("watched")
    previews: list[np.ndarray] = []
    checkpoints: dict[tuple[str, float], bytes] = {}

    def look(report: Progress) -> None:
        if report.preview_u8 is not None:
            previews.append(report.preview_u8)
        for stage, share in MOMENTS:
            if report.fraction >= fraction_at(stage, share) and (stage, share) not in checkpoints:
                checkpoints[stage, share] = (folder / FILE_NAME).read_bytes()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "PREVIEW_INTERVAL_S", 0.0)
        patch.setattr(CheckpointFile, "due", lambda self: True)
        result = reconstruct(capture, SETTINGS, device="cpu", checkpoint_dir=folder, progress=look)
    return Watched(result, previews, checkpoints)


def fraction_at(stage: str, share: float) -> float:
    shares = stage_shares(SETTINGS)
    names = list(shares)
    return sum(shares[name] for name in names[: names.index(stage)]) + share * shares[stage] - 1e-9


@pytest.mark.parametrize("preset", PRESETS)
def test_the_stages_share_all_of_the_time_by_what_they_have_to_do(preset):
    shares = stage_shares(PRESETS[preset])
    assert list(shares) == [*TRAINING_STAGES, "bake"]
    assert sum(shares.values()) == pytest.approx(1.0)
    assert all(share > 0 for share in shares.values())
    longer = stage_shares(replace(PRESETS[preset], field_steps=2 * PRESETS[preset].field_steps))
    assert longer["field"] > shares["field"]


def test_the_same_seed_gives_the_same_bytes_whatever_is_reported_and_kept(undisturbed, watched):
    assert_same_bytes(watched.result.scene, undisturbed.scene)


def test_previews_are_small_pictures(watched):
    assert len(watched.previews) >= SETTINGS.voxel_steps + SETTINGS.texel_steps
    assert all(preview.shape == (32, 32, 3) and preview.dtype == np.uint8 for preview in watched.previews)


def test_another_seed_gives_another_scene_of_like_quality(capture, undisturbed):
    other = reconstruct(capture, SETTINGS, device="cpu", seed=1)
    assert psnr_of(other.scene, capture) > 17.0
    with pytest.raises(AssertionError):
        assert_same_bytes(other.scene, undisturbed.scene)


class CutOffError(Exception):
    """The process dies."""


def cut_off(capture: Capture, settings: Settings, folder: Path, stage: str, share: float, monkeypatch) -> None:
    """Runs until a share of a stage is done, with a checkpoint after every step but that last one."""

    def die(report: Progress) -> None:
        if report.fraction >= fraction_at(stage, share):
            raise CutOffError

    with monkeypatch.context() as patch:
        patch.setattr(CheckpointFile, "due", lambda self: True)
        with pytest.raises(CutOffError):
            reconstruct(capture, settings, device="cpu", checkpoint_dir=folder, progress=die)


@pytest.mark.parametrize("moment", MOMENTS, ids=lambda moment: f"{moment[0]} {moment[1]}")
def test_a_run_that_was_killed_ends_like_an_undisturbed_one(capture, undisturbed, watched, tmp_path, moment):
    (tmp_path / FILE_NAME).write_bytes(watched.checkpoints[moment])
    reports: list[Progress] = []
    resumed = reconstruct(capture, SETTINGS, device="cpu", checkpoint_dir=tmp_path, progress=reports.append)
    assert resumed.resumed
    assert reports[0].fraction == pytest.approx(fraction_at(*moment), abs=0.02)
    # A checkpoint leaves out nodes that no sample reads; their noise has no say in the picture.
    assert psnr_of(resumed.scene, capture) == pytest.approx(psnr_of(undisturbed.scene, capture), abs=0.2)
    assert set(resumed.seconds) == set(undisturbed.seconds)
    assert list(tmp_path.iterdir()) == []  # a finished run leaves no checkpoint


def test_a_run_can_be_cut_off_again_and_again(capture, tmp_path, monkeypatch):
    expected = reconstruct(capture, HASTY, device="cpu")
    for stage, share in (("voxels", 0.3), ("voxels", 0.8), ("field", 0.5), ("texels", 0.5)):
        cut_off(capture, HASTY, tmp_path, stage, share, monkeypatch)
    resumed = reconstruct(capture, HASTY, device="cpu", checkpoint_dir=tmp_path)
    assert psnr_of(resumed.scene, capture) == pytest.approx(psnr_of(expected.scene, capture), abs=0.2)


@pytest.mark.parametrize("change", ["seed", "settings", "capture"])
def test_another_runs_checkpoint_is_left_aside(capture, tmp_path, monkeypatch, change):
    cut_off(capture, HASTY, tmp_path, "voxels", 0.5, monkeypatch)
    settings = replace(HASTY, distortion=0.5) if change == "settings" else HASTY
    photos = capture_of(ball(radius=0.79)) if change == "capture" else capture
    assert not reconstruct(photos, settings, device="cpu", seed=int(change == "seed"), checkpoint_dir=tmp_path).resumed


def test_a_damaged_checkpoint_is_refused(capture, tmp_path):
    (tmp_path / FILE_NAME).write_bytes(b"half a checkpoint")
    with pytest.raises(CheckpointInvalid, match="Delete it"):
        reconstruct(capture, HASTY, device="cpu", checkpoint_dir=tmp_path)


@pytest.mark.parametrize("alpha", [True, False], ids=["rgba", "rgb"])
@pytest.mark.parametrize("color", [(1, 1, 1), (0, 0, 0), (1, 0, 0)], ids=["white", "black", "red"])
def test_objects_of_one_colour_give_a_finite_picture(color, alpha):
    capture = capture_of(ball(color), alpha=alpha, views=8)
    scene = reconstruct(capture, HASTY, device="cpu").scene
    # NaN fails; a white ball on white is matched exactly, at infinity. So few steps leave the others far from done,
    # photos without alpha farthest (8 dB).
    assert evaluate(scene, capture.test, device="cpu").psnr > 5.0


@pytest.mark.parametrize("body", ["speck", "one place", "two photos"])
def test_hopeless_captures_give_a_scene_or_say_what_is_wrong(body):
    capture = capture_of(ball(radius=0.12 if body == "speck" else 0.8))
    if body == "one place":
        capture = Capture(capture.train[:1] * 3, ())
    if body == "two photos":
        capture = Capture(capture.train[:2], ())
    with contextlib.suppress(TrainingFailed):
        assert reconstruct(capture, HASTY, device="cpu").scene.quad_count > 0


def test_a_mesh_that_no_ray_sees_ends_training(capture, monkeypatch):
    monkeypatch.setattr(Tracer, "seen_quads", lambda self, least: torch.zeros(0, dtype=torch.int64))
    with pytest.raises(TrainingFailed, match="seen"):
        reconstruct(capture, HASTY, device="cpu")


@pytest.mark.parametrize("seed", [-1, 2**31, 2**64])
def test_seeds_out_of_range_are_refused(capture, seed):
    with pytest.raises(OptionInvalid, match="seed"):
        reconstruct(capture, HASTY, device="cpu", seed=seed)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_a_scene_of_any_size_is_learnt_alike(capture, scale):
    views = tuple(replace(view, camera=scaled_camera(view.camera, scale)) for view in capture.train)
    one, other = (reconstruct(c, HASTY, device="cpu").scene for c in (Capture(capture.train, ()), Capture(views, ())))
    for page, scaled in zip(one.pages, other.pages, strict=True):
        np.testing.assert_array_equal(scaled.features_u8, page.features_u8)
        np.testing.assert_allclose(scaled.positions / scale, page.positions, atol=1e-6)  # float32 positions


def scaled_camera(camera: Camera, scale: float) -> Camera:
    pose = camera.world_from_camera.copy()
    pose[:3, 3] *= scale
    return replace(camera, world_from_camera=pose)


def test_a_loss_that_is_no_number_ends_training(capture, monkeypatch):
    monkeypatch.setattr(VoxelStage, "step", lambda self: float("nan"))
    with pytest.raises(TrainingFailed, match="step 0"):
        reconstruct(capture, HASTY, device="cpu")


def test_the_callers_torch_threads_are_as_before_even_after_an_error(capture, monkeypatch):
    torch.set_num_threads(2)
    monkeypatch.setattr(VoxelStage, "step", lambda self: float("nan"))
    with pytest.raises(TrainingFailed):
        reconstruct(capture, HASTY, device="cpu")
    assert torch.get_num_threads() == 2
    torch.set_num_threads(1)


def test_every_device_learns_as_well(capture, undisturbed, device):
    if device == "cpu":
        return
    other = reconstruct(capture, SETTINGS, device=device)
    # Sums come out in another order: another course of training, like another seed's.
    assert psnr_of(other.scene, capture) == pytest.approx(psnr_of(undisturbed.scene, capture), abs=1.5)
