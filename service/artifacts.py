"""What a job offers for download. No other file of its folder is reachable."""

import json
from typing import Any

from fastapi import Request, Response
from fastapi.responses import FileResponse

from service.errors import ArtifactNotFound
from service.formats import FORMATS
from service.job_folder import JobFolder

CAPTURE_JSON, CAPTURE_PICTURE = "capture.json", "capture.png"
REPORT = "report.json"
MEDIA_TYPES = {form.file: form.media_type for form in FORMATS.values()} | {
    "preview.png": "image/png",
    REPORT: "application/json",
    CAPTURE_JSON: "application/json",
    CAPTURE_PICTURE: "image/png",
}


def list_artifacts(folder: JobFolder) -> list[dict[str, Any]]:
    """`name`, `bytes` and `url` of the artefacts that are there by now."""
    found = []
    for name in MEDIA_TYPES:
        try:
            size = (folder.artifacts / name).stat().st_size
        except FileNotFoundError:
            continue
        found.append({"name": name, "bytes": size, "url": f"/jobs/{folder.id}/artifacts/{name}"})
    return found


def capture_summary(folder: JobFolder) -> dict[str, Any] | None:
    """The capture report's lines (`label`, `text`, `warns`); None until it is there. capture.json has all of it."""
    try:
        report = json.loads((folder.artifacts / CAPTURE_JSON).read_bytes())
    except FileNotFoundError:
        return None
    return {"lines": report["lines"]}


def format_rows(folder: JobFolder) -> dict[str, Any]:
    """What the report says of each format that was exported; {} until it is there."""
    try:
        return json.loads((folder.artifacts / REPORT).read_bytes()).get("formats", {})
    except FileNotFoundError:
        return {}


def artifact_response(request: Request, folder: JobFolder, name: str) -> Response:
    """The file, a range of it, or 304 where the client has it already.

    Raises:
        ArtifactNotFound
    """
    path = folder.artifacts / name
    if name not in MEDIA_TYPES or not path.is_file():
        remedy = f"One of {', '.join(MEDIA_TYPES)}; they are written as the job proceeds."
        raise ArtifactNotFound(f"artifact {name[:64]!r}", "must exist", "no such file", remedy)
    # The preview changes while a job runs, so a cache has to ask each time; the ETag makes asking cheap.
    headers = {"Cache-Control": "no-cache", "X-Content-Type-Options": "nosniff"}
    if MEDIA_TYPES[name] == "text/html":  # a page of the service's own origin it shall not be
        headers["Content-Disposition"] = f'attachment; filename="{name}"'
    response = FileResponse(path, headers=headers, media_type=MEDIA_TYPES[name], stat_result=path.stat())
    if _matches(request.headers.get("if-none-match", ""), response.headers["etag"]):
        return Response(status_code=304, headers=headers | {"ETag": response.headers["etag"]})
    return response


def _matches(if_none_match: str, etag: str) -> bool:
    """RFC 9110 section 13.1.2, with the weak comparison."""
    asked = [tag.strip().removeprefix("W/") for tag in if_none_match.split(",")]
    return "*" in asked or etag in asked
