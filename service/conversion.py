"""The whole path: photos -> capture -> scene -> scene.glb, read again and measured."""

import contextlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
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
from service.atomic import write_atomically
from service.capture_source import opened_capture
from service.formats import DEFAULT, FORMATS, FormatRow
from service.formats.exporting import NO_VIEWS, exported
from service.formats.measure import BEST_PSNR, Measure
from service.formats.provenance import of_conversion
from service.formats.source import Source
from service.prepared import Preparation, ReportCallback
from service.preview import png_bytes, preview
from service.report import Figure, Report
from service.stages import EXPORT, MEASURE, READ, TRAIN, Stages

SCENE, PREVIEW, REPORT = "scene.glb", "preview.png", "report.json"
POSING = "posing"
NO_HELD_OUT = "No view is held out, so the quality was not measured."
RESUMED = "Training was interrupted and went on from its checkpoint."


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
    formats: Sequence[str] = DEFAULT,
    title: str = "",
    progress: ProgressCallback = ignore_progress,
    on_report: ReportCallback = lambda report: None,
    checkpoint_dir: Path | None = None,
    posing_dir: Path | None = None,
) -> Report:
    """Turns a capture into `scene.glb`, `preview.png` and `report.json` in `out_dir`, or photos whose cameras are
    estimated first. Before training it writes the capture report, `capture.json` and `capture.png`.

    Every figure is measured on the scene.glb as written, read again: never on the trainer. Each file appears whole or
    not at all, the report last; it is written again as each of the other formats is done.

    Args:
        capture_path: a folder, a pose file or a .zip of a capture, or of photos without poses.
        out_dir: made when missing.
        preset, overrides: see core.presets.
        device: auto, cpu, cuda or cuda:N.
        downscale, max_size_px, background, skip_missing: see `read_capture`.
        scene_kind: auto, object, forward or unbounded.
        formats: what to export beside scene.glb, names of service.formats.FORMATS. One that cannot be made is a row of
            the report with a problem.
        title: what the scene is called; by default the name of the capture.
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
    others = [name for name in formats if name not in DEFAULT]
    stages = Stages(progress, len(others))
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
        called = title or capture_path.resolve().stem
        known = of_conversion(called, "" if title else capture_path.resolve().name, {**asdict(settings), "seed": seed})
        asset, size = _export(Source(trained.scene, called, provenance=known), out_dir)
    scene, trained = asset.scene, replace(trained, scene=asset.scene)
    with stages.stage("measure", MEASURE):
        evaluation = evaluate(scene, capture.test, device=device, progress=stages.within(MEASURE))
        picture = _write(out_dir, PREVIEW, png_bytes(preview(scene, capture, device)))

    report = Report(
        psnr=_figure(evaluation, "psnr"),
        ssim=_figure(evaluation, "ssim"),
        seconds=stages.seconds | {"total": sum(stages.seconds.values())},
        bytes={SCENE: size, PREVIEW: picture},
        quads=scene.quad_count,
        triangles=scene.triangle_count,
        pages=len(scene.pages),
        settings=asdict(settings) | {"seed": seed, "scene_kind": scene_kind, **photos},
        device=device,
        views={"train": len(capture.train), "test": len(capture.test)},
        capture=capture_report.as_json(),
        notes=capture.notes + (() if capture.test else (NO_HELD_OUT,)) + ((RESUMED,) if trained.resumed else ()),
    )
    row = FormatRow(SCENE, size, report.psnr.mean, stages.seconds["export"], "" if evaluation.views else NO_VIEWS)
    report = report.with_format("glb", row)
    _write(out_dir, REPORT, report.as_bytes())
    measure = Measure.on(capture, scene.background, device)
    del capture  # the photos that were trained on are needed no longer
    report = _with_others(report, asset, others, out_dir, measure, stages)
    if checkpoint_dir:
        shutil.rmtree(checkpoint_dir, ignore_errors=True)
    stages.done(psnr=report.psnr.mean)
    return report


def _export(source: Source, folder: Path) -> tuple[Source, int]:
    """Writes the asset; returns what the file holds, to export to other formats, and its size."""
    folder.mkdir(parents=True, exist_ok=True)
    _remove_earlier(folder)
    form = FORMATS["glb"]
    size = _write(folder, SCENE, form.write(source))
    held = form.read((folder / SCENE).read_bytes())
    assert isinstance(held, BakedScene)
    return Source(held, source.title, folder / SCENE, source.provenance), size


def _with_others(
    report: Report, asset: Source, names: Sequence[str], folder: Path, measure: Measure | None, stages: Stages
) -> Report:
    """The report with the other formats, which are exported in turn; it is written as each of them is done."""
    if measure and report.psnr.mean is not None:
        measure.remember(asset.scene, report.psnr.mean)
    for name, row in exported(asset, names, folder, measure, lambda name: stages.within_format(names.index(name))):
        report = report.with_format(name, row).with_seconds("formats", row.seconds)
        _write(folder, REPORT, report.as_bytes())
    return report


def _remove_earlier(folder: Path) -> None:
    """Removes the formats that the folder's report lists: they show another scene than the one to come."""
    with contextlib.suppress(FileNotFoundError, ValueError):
        listed = json.loads((folder / REPORT).read_bytes()).get("formats", {})
        for name in listed.keys() & FORMATS.keys():
            (folder / FORMATS[name].file).unlink(missing_ok=True)


def _write(folder: Path, name: str, data: bytes) -> int:
    write_atomically(folder / name, data)
    return len(data)


def _figure(evaluation: Evaluation, name: str) -> Figure:
    if not evaluation.views:
        return Figure(None, {})
    per_view = {view.name: min(getattr(view, name), BEST_PSNR) for view in evaluation.views}
    return Figure(min(getattr(evaluation, name), BEST_PSNR), per_view)
