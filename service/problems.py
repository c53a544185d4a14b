"""Errors as problem details (RFC 9457): one shape for every answer that is not a success."""

import errno
import logging
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from core.errors import InputError, PolyfieldError
from service.errors import StorageFull

MEDIA_TYPE = "application/problem+json"

# Codes whose status is not the default of their branch.
STATUS_BY_CODE = {
    "upload-too-large": 413,
    "archive-too-large": 413,
    "image-too-large": 413,
    "request-invalid": 400,
    "job-not-found": 404,
    "artifact-not-found": 404,
    "job-busy": 409,
    "job-unfinished": 409,
    "storage-full": 507,
}

log = logging.getLogger(__name__)


def problem_of(error: Exception) -> dict[str, Any]:
    """The problem of any error: `type, title, status, detail, code` and, of ours, `subject, rule, received, remedy`.

    An error that is not ours says nothing of its inside: the log has it.
    """
    if isinstance(error, OSError) and error.errno == errno.ENOSPC:
        error = StorageFull("disk", "must have room for the upload", remedy="Free some space, then try again.")
    if not isinstance(error, PolyfieldError):
        return _problem("internal", 500, "Something went wrong inside Polyfield; its log says what.")
    named = {"subject": error.subject, "rule": error.rule, "received": error.received, "remedy": error.remedy}
    status = STATUS_BY_CODE.get(error.code, 422 if isinstance(error, InputError) else 500)
    return _problem(error.code, status, str(error)) | {key: value for key, value in named.items() if value}


def answer(problem: dict[str, Any], headers: dict[str, str] | None = None) -> JSONResponse:
    """The HTTP answer that carries a problem."""
    return JSONResponse(problem, problem["status"], headers=headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Makes every error of the application a problem."""
    app.add_exception_handler(PolyfieldError, _on_error)
    app.add_exception_handler(HTTPException, _on_http_error)
    app.add_exception_handler(RequestValidationError, _on_validation_error)
    app.add_exception_handler(Exception, _on_error)


def _problem(code: str, status: int, detail: str) -> dict[str, Any]:
    title = code.replace("-", " ").capitalize()
    return {"type": f"urn:polyfield:problem:{code}", "title": title, "status": status, "detail": detail, "code": code}


async def _on_error(request: Request, error: Exception) -> JSONResponse:
    problem = problem_of(error)
    if problem["status"] == 500:
        log.error("%s %s", request.method, request.url.path, exc_info=error)
    return answer(problem)


async def _on_http_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    code = HTTPStatus(error.status_code).phrase.lower().replace(" ", "-")
    detail = f"{request.method} {request.url.path}: {error.detail}."
    return answer(_problem(code, error.status_code, detail), dict(error.headers or {}))


async def _on_validation_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    faults = [{"field": ".".join(map(str, e["loc"])), "message": e["msg"]} for e in error.errors()]
    detail = "; ".join(f"{fault['field']}: {fault['message']}" for fault in faults)
    return answer(_problem("request-invalid", 400, detail) | {"errors": faults})
