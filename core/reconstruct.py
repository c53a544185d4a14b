"""From a capture to a baked scene: the three training stages in turn, then baking."""

import hashlib
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from torch import nn

from core.baked import BakedScene
from core.baking.bake import bake, quick_bake
from core.baking.preview import preview_of_field, preview_of_scene
from core.capture import Capture
from core.checkpoint import CheckpointFile
from core.device import CPU, resolve_device, torch_threads
from core.errors import OptionInvalid
from core.field.network import new_network
from core.field.region import Region, find_region
from core.presets import Settings
from core.progress import Progress, ProgressCallback, ignore_progress
from core.stage_times import stage_seconds
from core.training.field_stage import FieldStage
from core.training.pixels import PixelPool
from core.training.stage import Stage
from core.training.texel_stage import TexelStage
from core.training.voxel_stage import VoxelStage

BAKE_SHARE = 0.06  # of the time, for the progress bar
REPORT_INTERVAL_S = 0.5
# To be raised when a stage keeps other things: checkpoints of another format are ignored, not misread.
CHECKPOINT_FORMAT = 6
PREVIEW_INTERVAL_S = 20.0
MAX_SEED = 2**31 - 1


@dataclass(frozen=True)
class Reconstruction:
    """Attributes:
    scene: what to export.
    seconds: per stage (region, voxels, field, texels, bake), including what an interrupted run spent on them.
    resumed: whether the run went on from a checkpoint.
    """

    scene: BakedScene
    seconds: dict[str, float]
    resumed: bool


def reconstruct(
    capture: Capture,
    settings: Settings,
    *,
    device: str = "auto",
    seed: int = 0,
    checkpoint_dir: Path | None = None,
    progress: ProgressCallback = ignore_progress,
) -> Reconstruction:
    """Trains and bakes a capture (paper 3.1 to 3.3).

    The same capture, settings, seed and device give the same scene. With a checkpoint folder, a run that was cut off
    goes on from its last checkpoint; the checkpoint of a finished run is removed.

    Raises:
        CaptureEmpty, TrainingFailed, CheckpointInvalid, OptionInvalid
    """
    if not 0 <= seed <= MAX_SEED:
        raise OptionInvalid("seed", f"must be between 0 and {MAX_SEED}", str(seed))
    resolved = resolve_device(device)
    # Beside the kernels' threads, a pool of torch's would spin: a 3 ms network then takes up to 300 ms.
    with torch_threads(1) if resolved == CPU else nullcontext():
        return _Run(capture, settings, resolved, seed, checkpoint_dir, progress).reconstruction()


class _Run:
    """One reconstruction under way."""

    def __init__(
        self,
        capture: Capture,
        settings: Settings,
        device: str,
        seed: int,
        checkpoint_dir: Path | None,
        progress: ProgressCallback,
    ) -> None:
        self.capture, self.settings, self.device, self.seed = capture, settings, device, seed
        self._progress = progress
        self._checkpoint = CheckpointFile(checkpoint_dir, _identity(capture, settings, seed))
        self._seconds: dict[str, float] = {}
        with self._timed("region"):
            self.region: Region = find_region(capture)
        self.network: nn.Sequential = new_network(seed).to(device)
        self._reported_at = self._previewed_at = time.monotonic()

    def reconstruction(self) -> Reconstruction:
        saved = self._checkpoint.read()
        stage_name, state = saved or ("voxels", None)
        if state is not None:
            self._seconds = dict(state["seconds"])
        with self._timed("region"):
            pool = self._pool = PixelPool(self.capture.train, self.region.frame, self.device, seed=self.seed)
        if state is not None and state["log_gains"] is not None:
            pool.log_gains = state["log_gains"].to(self.device)
        common = self.network, self.settings, self.seed, self.device
        if stage_name == "voxels":
            voxels = VoxelStage(self.capture, self.region, *common)
            self._train(voxels, state)
            pool.log_gains = voxels.log_gains
            with self._timed("field"):
                field = FieldStage.after(voxels, pool)
            del voxels
        elif stage_name == "field":
            assert state is not None
            field = FieldStage.restored(pool, self.region.space, state, *common)
        if stage_name in ("voxels", "field"):
            self._train(field, None)
            with self._timed("texels"):
                texels = TexelStage.after(field, pool)
            del field
        else:
            assert state is not None
            texels = TexelStage.restored(pool, self.region.space, state, *common)
        self._train(texels, None)
        scene = self._baked(texels)
        self._checkpoint.remove()
        return Reconstruction(scene, self._seconds, resumed=saved is not None)

    def _train(self, stage: Stage, state: dict[str, Any] | None) -> None:
        if state is not None:
            stage.restore(state)
        before, start = self._seconds.get(stage.name, 0.0), time.monotonic()
        while stage.done < stage.steps:
            stage.advance()
            self._seconds[stage.name] = before + time.monotonic() - start
            self._report(stage)
            if self._checkpoint.due():
                shared = {"seconds": self._seconds, "log_gains": self._pool.log_gains}
                self._checkpoint.write(stage.name, {**shared, **stage.state()})

    def _baked(self, texels: TexelStage) -> BakedScene:
        with self._timed("bake"):
            return bake(texels, self.capture, self.region.frame, lambda share: self._tell("bake", share, texels.psnr))

    @contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        start = time.monotonic()
        yield
        self._seconds[name] = self._seconds.get(name, 0.0) + time.monotonic() - start

    def _report(self, stage: Stage) -> None:
        now = time.monotonic()
        if now - self._reported_at < REPORT_INTERVAL_S and stage.done < stage.steps:
            return
        self._reported_at = now
        preview = None
        if now - self._previewed_at >= PREVIEW_INTERVAL_S:
            preview = self._preview(stage)
            self._previewed_at = time.monotonic()
        self._tell(stage.name, stage.fraction, stage.psnr, preview)

    def _tell(self, name: str, share: float, psnr: float | None, preview: Any = None) -> None:
        shares = stage_shares(self.settings)
        names = list(shares)
        before = sum(shares[earlier] for earlier in names[: names.index(name)])
        self._progress(Progress(name, min(before + shares[name] * share, 1.0), psnr, preview))

    def _preview(self, stage: Stage) -> Any:
        camera = (self.capture.test or self.capture.train)[0].camera
        background = self.capture.background
        if isinstance(stage, TexelStage):
            scene = quick_bake(stage, self.capture, self.region.frame)
            return preview_of_scene(scene, camera, self.device)
        if isinstance(stage, VoxelStage):
            return preview_of_field(stage.field, self.network, camera, self.region.frame, background, self.device)
        return None


def stage_shares(settings: Settings) -> dict[str, float]:
    """The stages' shares of the time, in order; their sum is 1."""
    seconds = stage_seconds(settings)
    whole = sum(seconds.values()) / (1.0 - BAKE_SHARE)
    return {**{name: of_stage / whole for name, of_stage in seconds.items()}, "bake": BAKE_SHARE}


def _identity(capture: Capture, settings: Settings, seed: int) -> dict[str, Any]:
    digest = hashlib.sha256()
    for view in capture.train:
        digest.update(view.image_u8.tobytes())
        digest.update(view.camera.world_from_camera.tobytes())
        digest.update(str((view.camera.focal_px, view.camera.centre_px)).encode())
    return {"format": CHECKPOINT_FORMAT, "settings": asdict(settings), "seed": seed, "capture": digest.hexdigest()}
