"""A scene that is there already, exported without training."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from core.device import resolve_device
from core.progress import ProgressCallback, ignore_progress
from service.atomic import write_atomically
from service.formats import DEFAULT, FormatRow
from service.formats.exporting import exported
from service.formats.provenance import in_glb
from service.formats.source import Source
from service.held_out import measure_on
from service.report import Report, json_bytes
from service.scene_source import read_scene
from service.stages import EXPORT_ONLY_READ, Stages

SCENE, REPORT, EXPORT_REPORT = "scene.glb", "report.json", "export.json"
POSING = "posing"
PHOTO_SETTINGS = ("downscale", "max_size_px", "background", "skip_missing")


def export(
    scene_path: Path,
    out_dir: Path,
    formats: Sequence[str],
    *,
    capture: Path | None = None,
    photos: Mapping[str, Any] | None = None,
    posing_dir: Path | None = None,
    title: str = "",
    device: str = "auto",
    progress: ProgressCallback = ignore_progress,
) -> dict[str, FormatRow]:
    """Exports a scene to formats in `out_dir`, one after the other; returns their rows.

    Where the scene is `out_dir`'s own scene.glb, that is measured, too, and the rows are added to report.json beside
    it, if there is one. Else they are written to export.json.

    Args:
        scene_path: see `read_scene`.
        out_dir: made when missing.
        formats: names of service.formats.FORMATS.
        capture: to measure on; None measures nothing.
        photos: how its photos are read, see `read_capture`; as report.json beside the scene says, if None.
        posing_dir: of photos without poses; `posing` beside the scene by default.
        title: what the scene is called; by default the name of its file.
        device: that renders: auto, cpu, cuda or cuda:N.
        progress: is told stage and fraction.

    Raises:
        InputError: the scene or the capture cannot be read. Nothing has been written then.
    """
    device = resolve_device(device)
    is_own = scene_path.is_file() and (out_dir / SCENE).exists() and scene_path.samefile(out_dir / SCENE)
    names = [*DEFAULT, *(name for name in formats if name not in DEFAULT)] if is_own else list(formats)
    stages = Stages(progress, len(names), only=True)
    with stages.stage("read", (0.0, EXPORT_ONLY_READ)):
        scene = read_scene(scene_path)
    beside = scene_path.parent
    measure = None
    if capture is not None:
        photos = photos_as_reported(beside / REPORT) if photos is None else photos
        measure = measure_on(capture, photos, posing_dir or beside / POSING, device, stages.posing())
    out_dir.mkdir(parents=True, exist_ok=True)
    known = in_glb(scene_path.read_bytes()) if scene_path.suffix.lower() == ".glb" else None
    called = title or (known and known.title) or scene_path.resolve().stem
    source = Source(scene, called, scene_path, known)
    rows: dict[str, FormatRow] = {}
    for name, row in exported(source, names, out_dir, measure, lambda name: stages.within_format(names.index(name))):
        rows[name] = row
        if is_own and (out_dir / REPORT).exists():
            _update_report(out_dir / REPORT, name, row)
        else:
            listed = {known: asdict(row) for known, row in rows.items()}
            write_atomically(out_dir / EXPORT_REPORT, json_bytes({"scene": scene_path.name, "formats": listed}))
    return rows


def photos_as_reported(report: Path) -> dict[str, Any]:
    """How photos were read, as a report.json says; {} where there is none."""
    try:
        settings = json.loads(report.read_bytes()).get("settings", {})
    except (FileNotFoundError, ValueError):
        return {}
    photos = {name: settings[name] for name in PHOTO_SETTINGS if name in settings}
    if "background" in photos:
        photos["background"] = tuple(photos["background"])
    if "scene_kind" in settings:
        photos["kind"] = settings["scene_kind"]
    return photos


def _update_report(path: Path, name: str, row: FormatRow) -> None:
    write_atomically(path, Report.from_bytes(path.read_bytes()).with_format(name, row).as_bytes())
