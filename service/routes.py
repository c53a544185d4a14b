"""The endpoints."""

from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse, StreamingResponse

from service.artifacts import artifact_response
from service.events import job_events, last_event_id
from service.export_request import BODY, requested_formats
from service.formats import FORMATS
from service.jobs import Jobs
from service.problems import MEDIA_TYPE as PROBLEM
from service.uploads import receive_job

FORM = {
    "type": "object",
    "required": ["files"],
    "properties": {
        "files": {
            "type": "array",
            "items": {"type": "string", "format": "binary"},
            "description": "Photos, with pose files or alone, named relative to the capture (images/1.png), or a .zip.",
        },
        "name": {"type": "string"},
        "preset": {"type": "string", "default": "balanced"},
        "device": {"type": "string", "default": "auto", "description": "auto, cpu, cuda or cuda:N"},
        "seed": {"type": "integer", "default": 0},
        "downscale": {"type": "integer", "default": 1, "minimum": 1, "maximum": 16},
        "max_size_px": {"type": "integer", "description": "longest side of a photo at most"},
        "background": {"type": "string", "default": "white", "description": "white, black or #rrggbb"},
        "scene_kind": {"type": "string", "default": "auto", "description": "auto, object, forward or unbounded"},
        "skip_missing": {
            "type": "boolean",
            "default": False,
            "description": "leave out photos that the poses name but the capture lacks",
        },
        "formats": {
            "type": "string",
            "default": "glb",
            "description": f"what to export beside scene.glb: all, or some of {','.join(FORMATS)}",
        },
        "set": {"type": "array", "items": {"type": "string"}, "description": "name=value, a setting of the preset"},
    },
}
UPLOAD = {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": FORM}}}}

router = APIRouter(
    responses={"4XX": {"description": "A problem (RFC 9457) with a stable code", "content": {PROBLEM: {}}}}
)


def _jobs(request: Request) -> Jobs:
    return request.app.state.jobs


@router.get("/health")
async def health() -> dict[str, str]:
    """Whether the server answers."""
    return {"status": "ok"}


@router.get("/formats")
async def list_formats() -> dict[str, Any]:
    """What a scene can be exported to."""
    keys = ("name", "file", "media_type", "text", "opens_in")
    return {"formats": [{key: getattr(form, key) for key in keys} for form in FORMATS.values()]}


@router.post("/jobs", status_code=202, openapi_extra=UPLOAD)
async def create_job(request: Request) -> JSONResponse:
    """Starts a conversion. What can be refused without decoding a photo is refused at once."""
    jobs = _jobs(request)
    folder = await receive_job(request, request.app.state.settings)
    try:
        await jobs.enqueue(folder)
    except BaseException:
        folder.remove()
        raise
    return JSONResponse(await jobs.get(folder.id), 202, headers={"Location": f"/jobs/{folder.id}"})


@router.get("/jobs")
async def list_jobs(request: Request) -> dict[str, Any]:
    """The newest 200 jobs."""
    return {"jobs": await _jobs(request).list()}


@router.get("/jobs/{job_id}")
async def get_job(request: Request, job_id: str) -> dict[str, Any]:
    """A job: its state, latest progress, artefacts and, where it failed, the problem."""
    return await _jobs(request).get(job_id)


@router.get("/jobs/{job_id}/events", response_class=StreamingResponse)
async def get_job_events(request: Request, job_id: str) -> StreamingResponse:
    """Server-sent events: every report from the first, or after `Last-Event-ID`, then `end`."""
    jobs = _jobs(request)
    await jobs.get(job_id)
    after = last_event_id(request.headers.get("last-event-id"))
    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    return StreamingResponse(job_events(jobs, job_id, after), headers=headers, media_type="text/event-stream")


@router.post("/jobs/{job_id}/cancel")
async def cancel_job(request: Request, job_id: str) -> dict[str, Any]:
    """Stops a job. One that has ended stays as it is; its export, if there is one, is stopped."""
    return await _jobs(request).cancel(job_id)


@router.post("/jobs/{job_id}/exports", status_code=202, openapi_extra=BODY)
async def create_export(request: Request, job_id: str) -> dict[str, Any]:
    """Exports a finished job's scene.glb to more formats, without training; one export of a job at a time.

    The answer is the job. Its `export` tells state and progress, its `formats` what has been made.
    """
    formats = await requested_formats(request, request.app.state.settings.limits)
    return await _jobs(request).export(job_id, formats)


@router.delete("/jobs/{job_id}", status_code=204)
async def delete_job(request: Request, job_id: str) -> Response:
    """Stops a job and removes its files and its record."""
    await _jobs(request).delete(job_id)
    return Response(status_code=204)


@router.get("/jobs/{job_id}/artifacts/{name}")
@router.head("/jobs/{job_id}/artifacts/{name}", include_in_schema=False)
async def get_artifact(request: Request, job_id: str, name: str) -> Response:
    """`preview.png`, `report.json`, `capture.json`, `capture.png` or a format's file; ranges and ETags are honoured."""
    return artifact_response(request, _jobs(request).folder(job_id), name)
