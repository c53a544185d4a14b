"""The body of `POST /jobs/{id}/exports`."""

import json

from fastapi import Request

from core.errors import UploadTooLarge
from service.errors import RequestInvalid
from service.formats import FORMATS, formats_of
from service.settings import Limits

SCHEMA = {
    "type": "object",
    "required": ["formats"],
    "properties": {
        "formats": {
            "description": "names, or all of them",
            "oneOf": [
                {"type": "array", "items": {"enum": list(FORMATS)}, "minItems": 1},
                {"type": "string", "examples": ["all", "web,lq"]},
            ],
        }
    },
}
BODY = {"requestBody": {"required": True, "content": {"application/json": {"schema": SCHEMA}}}}
SEND = 'Send {"formats": ["web", "usd"]} as JSON.'


async def requested_formats(request: Request, limits: Limits) -> tuple[str, ...]:
    """The names that a request asks for.

    Raises:
        RequestInvalid: not such an object.
        UnknownFormat, UploadTooLarge
    """
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > limits.field_bytes:
            raise UploadTooLarge("request", f"at most {limits.field_bytes} bytes", "more", SEND)
    try:
        words = json.loads(bytes(body))["formats"]
    except (ValueError, TypeError, KeyError, RecursionError):
        raise RequestInvalid("request", "must be a JSON object with formats", repr(bytes(body[:40])), SEND) from None
    is_list = isinstance(words, list) and all(isinstance(word, str) for word in words)
    if not is_list and not isinstance(words, str):
        raise RequestInvalid("formats", "must be a list of names", repr(words)[:40], SEND)
    return formats_of(words)
