"""The whole path: photos -> capture -> scene -> scene.glb, read again and measured."""

import contextlib
import shutil
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from core.baked import BakedScene
from core.capture import WHITE
from core.device import resolve_device
from core.evaluation import Evaluation, evaluate
from core.presets import settings_for
from core.progress import ProgressCallback, ignore_progress
from core.reconstruct import reconstruct
from core.scene_kind import AUTO
from exporters.gltf import read_glb, write_glb
from service.atomic import write_atomically
from service.capture_source import opened_capture
from service.prepared import Preparation, ReportCallback
from service.preview import png_bytes, preview
from service.report import Figure, Report
from service.stages import EXPORT, MEASURE, READ, TRAIN, Stages

SCENE, PREVIEW, REPORT = "scene.glb", "preview.png", "report.json"
POSING = "posing"
NO_HELD_OUT = "No view is held out, so the quality was not measured."
RESUMED = "Training was interrupted and went on from its checkpoint."
BEST_PSNR = 100.0  # what an infinite one is reported as: JSON has no infinity


def convert(
    capture_path: Path,
    out_dir: Path,
    *,
    preset: str = "balanced",
    device: str = "auto",
    seed: int = 0,
    overrides: Mapping[str, Any] | None = None,
    downscale: int = 1,
    max_size_px: int | None = None,
    background: tuple[float, float, float] = WHITE,
    scene_kind: str = AUTO,
    skip_missing: bool = False,
    progress: ProgressCallback = ignore_progress,
    on_report: ReportCallback = lambda report: None,
    checkpoint_dir: Path | None = None,
    posing_dir: Path | None = None,
) -> Report:
    """Turns a capture into `scene.glb`, `preview.png` and `report.json` in `out_dir`, or photos whose cameras are
    estimated first. Before training it writes the capture report, `capture.json` and `capture.png`.

    Every figure is measured on the scene.glb as written, read again: never on the trainer. Each file appears whole or
    not at all, the report last.

    Args:
        capture_path: a folder, a pose file or a .zip of a capture, or of photos without poses.
        out_dir: made when missing.
        preset, overrides: see core.presets.
        device: auto, cpu, cuda or cuda:N.
        downscale, max_size_px, background, skip_missing: see `read_capture`.
        scene_kind: auto, object, forward or unbounded.
        progress: is told stage and fraction of the whole, and now and then a preview.
        on_report: is told the capture report before training starts.
        checkpoint_dir: kept up to date while training; a conversion that was stopped goes on from there. Removed on
            success.
        posing_dir: keeps the cameras estimated of photos without poses, a COLMAP model; `posing` in `out_dir` by
            default. A second conversion of the same photos uses it.

    Raises:
        InputError: the capture or an option cannot be used. Where photos cannot be posed (PosesNotFound), the capture
            report is written all the same.
        TrainingFailed
    """
    stages = Stages(progress)
    settings = settings_for(preset, **(overrides or {}))
    device = resolve_device(device)
    photos: dict[str, Any] = {"downscale": downscale, "max_size_px": max_size_px, "background": background}
    photos["skip_missing"] = skip_missing
    posing_dir = posing_dir or out_dir / POSING
    preparation = Preparation(settings, device, seed, {**photos, "kind": scene_kind}, out_dir, posing_dir, on_report)
    with contextlib.ExitStack() as opened:
        with stages.stage("read", READ):
            source = opened.enter_context(opened_capture(capture_path))
        capture, capture_report = preparation.prepared(source, stages)
    trained = reconstruct(
        capture, settings, device=device, seed=seed, checkpoint_dir=checkpoint_dir, progress=stages.within(TRAIN)
    )
    stages.add(trained.seconds)
    with stages.stage("export", EXPORT):
        sizes, scene = _export(trained.scene, out_dir)
    with stages.stage("measure", MEASURE):
        evaluation = evaluate(scene, capture.test, device=device, progress=stages.within(MEASURE))
        sizes |= _write(out_dir, {PREVIEW: png_bytes(preview(scene, capture, device))})

    report = Report(
        psnr=_figure(evaluation, "psnr"),
        ssim=_figure(evaluation, "ssim"),
        seconds=stages.seconds | {"total": sum(stages.seconds.values())},
        bytes=sizes,
        quads=scene.quad_count,
        triangles=scene.triangle_count,
        pages=len(scene.pages),
        settings=asdict(settings) | {"seed": seed, "scene_kind": scene_kind, **photos},
        device=device,
        views={"train": len(capture.train), "test": len(capture.test)},
        capture=capture_report.as_json(),
        notes=capture.notes + (() if capture.test else (NO_HELD_OUT,)) + ((RESUMED,) if trained.resumed else ()),
    )
    _write(out_dir, {REPORT: report.as_bytes()})
    if checkpoint_dir:
        shutil.rmtree(checkpoint_dir, ignore_errors=True)
    stages.report("measure", 1.0, psnr=report.psnr.mean)
    return report


def _export(scene: BakedScene, folder: Path) -> tuple[dict[str, int], BakedScene]:
    """Writes the asset; returns its sizes and the scene that the file holds."""
    folder.mkdir(parents=True, exist_ok=True)
    sizes = _write(folder, write_glb(scene))
    return sizes, read_glb((folder / SCENE).read_bytes())


def _write(folder: Path, files: Mapping[str, bytes]) -> dict[str, int]:
    for name, data in files.items():
        write_atomically(folder / name, data)
    return {name: len(data) for name, data in files.items()}


def _figure(evaluation: Evaluation, name: str) -> Figure:
    if not evaluation.views:
        return Figure(None, {})
    per_view = {view.name: min(getattr(view, name), BEST_PSNR) for view in evaluation.views}
    return Figure(min(getattr(evaluation, name), BEST_PSNR), per_view)
