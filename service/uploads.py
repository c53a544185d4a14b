"""Uploads: received into a folder of their own, checked there, and only then made a job."""

import asyncio
import shutil
import time
import uuid
from pathlib import Path

from fastapi import Request

from core.datasets import check_capture, photos_without_poses
from core.errors import NoImages, UploadTooLarge
from core.posing.photo_set import find_photo_set
from service.archive import extract
from service.errors import RequestInvalid
from service.form import SHRINK, Form, receive_form
from service.job_folder import JobFolder
from service.options import Options
from service.settings import Limits, ServiceSettings

SETTING_FIELD = "set"


async def receive_job(request: Request, settings: ServiceSettings) -> JobFolder:
    """Reads a `POST /jobs` and returns the new job's folder, complete with its job.json.

    Whatever is wrong, nothing of the upload stays on disk.

    Raises:
        InputError: of the form, an option, the archive or the capture.
    """
    _refuse_announced(request, settings.limits)
    job_id = uuid.uuid4().hex
    staging = JobFolder(settings.incoming / job_id)
    received = staging.path / "received"
    try:
        await asyncio.to_thread(received.mkdir, parents=True)
        content_type = request.headers.get("content-type", "")
        form = await receive_form(content_type, request.stream(), received, settings.limits)
        options = Options.from_text(_words(form), form.fields.get(SETTING_FIELD, ()))
        await asyncio.to_thread(_make_capture, form, received, staging, settings.limits, options)
        accepted = JobFolder(settings.jobs / job_id)
        await asyncio.to_thread(_accept, staging, _request_of(job_id, form, options), accepted)
        return accepted
    finally:
        await asyncio.to_thread(staging.remove)


def _words(form: Form) -> dict[str, str]:
    """The form's fields; formats may be chosen in several."""
    return form.words() | {"formats": ",".join(form.fields.get("formats", ()))}


def _accept(staging: JobFolder, request: dict[str, object], accepted: JobFolder) -> None:
    staging.write_request(request)
    staging.artifacts.mkdir()
    staging.path.rename(accepted.path)


def _refuse_announced(request: Request, limits: Limits) -> None:
    announced = request.headers.get("content-length", "")
    if announced.isdecimal() and int(announced) > limits.upload_bytes:
        raise UploadTooLarge("upload", f"at most {limits.upload_bytes} bytes", announced, SHRINK)


def _make_capture(form: Form, received: Path, folder: JobFolder, limits: Limits, options: Options) -> None:
    if not form.files:
        remedy = "Send the photos, with their pose file if there is one, or one .zip of it all."
        raise NoImages("upload", "must hold photos", "no file", remedy)
    archives = [path for path in form.files if path.suffix.lower() == ".zip"]
    if not archives:
        received.rename(folder.capture)
    elif len(form.files) == 1:
        folder.capture.mkdir()
        extract(received / archives[0], folder.capture, limits)
        shutil.rmtree(received)
    else:
        raise RequestInvalid("upload", "must be one .zip or loose files", "both", "Send one of them.")
    _check(folder.capture, options)


def _check(capture: Path, options: Options) -> None:
    if photos_without_poses(capture) is None:
        check_capture(capture, skip_missing=options.skip_missing)
    else:
        find_photo_set(capture)


def _request_of(job_id: str, form: Form, options: Options) -> dict[str, object]:
    name = form.words().get("name") or form.files[0].parts[0].removesuffix(".zip")
    return {"id": job_id, "name": name[:200], "created_at": time.time(), "options": options.as_json()}
