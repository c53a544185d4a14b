"""A multipart form that streams to disk: no file is ever whole in memory, and none is written twice."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import IO, TYPE_CHECKING

from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header

from core.errors import UploadTooLarge
from service.errors import RequestInvalid
from service.names import safe_relative_path
from service.settings import MIB, Limits

if TYPE_CHECKING:
    from python_multipart.multipart import MultipartCallbacks

SHRINK = "Send fewer or smaller photos."


@dataclass
class Form:
    """What was received.

    Attributes:
        fields: the values of each field, in order.
        files: paths below the folder, in order.
    """

    fields: dict[str, list[str]] = field(default_factory=dict)
    files: list[PurePosixPath] = field(default_factory=list)

    def words(self) -> dict[str, str]:
        """The last value of each field."""
        return {name: values[-1].strip() for name, values in self.fields.items()}


async def receive_form(content_type: str, body: AsyncIterator[bytes], folder: Path, limits: Limits) -> Form:
    """Reads a multipart body; its files are written below `folder` under their (safe) names.

    On an error what was written stays behind; the caller removes the folder.

    Raises:
        RequestInvalid: not multipart, cut short, or a name sent twice.
        UploadTooLarge, ArchiveUnsafe
    """
    receiver = _Receiver(_boundary(content_type), folder, limits)
    try:
        async for chunk in _batches(body):
            await asyncio.to_thread(receiver.feed, chunk)
        return await asyncio.to_thread(receiver.finish)
    finally:
        receiver.close()


def _boundary(content_type: str) -> bytes:
    kind, parameters = parse_options_header(content_type)
    boundary = parameters.get(b"boundary")
    if kind != b"multipart/form-data" or not boundary:
        remedy = "Send the files as a form, as curl -F does."
        raise RequestInvalid("Content-Type", "must be multipart/form-data with a boundary", content_type[:80], remedy)
    return boundary


async def _batches(body: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    # Larger bites spare a thread switch for each network packet.
    held = bytearray()
    async for chunk in body:
        held += chunk
        if len(held) >= MIB:
            yield bytes(held)
            held.clear()
    yield bytes(held)


class _Receiver:
    """The parser's callbacks: a part is a file when it has a file name, else a field."""

    def __init__(self, boundary: bytes, folder: Path, limits: Limits) -> None:
        self._folder, self._limits = folder, limits
        self._form = Form()
        self._received = 0
        self._ended = False
        self._file: IO[bytes] | None = None
        self._header_name, self._header_value = bytearray(), bytearray()
        self._begin_part()
        self._parser = _parser(boundary, self)

    def feed(self, chunk: bytes) -> None:
        self._received += len(chunk)
        if self._received > self._limits.upload_bytes:
            raise UploadTooLarge("upload", f"at most {self._limits.upload_bytes} bytes", "more", SHRINK)
        try:
            self._parser.write(chunk)
        except FormParserError as error:
            raise RequestInvalid("form", "must be well-formed multipart/form-data", str(error)[:120]) from None

    def finish(self) -> Form:
        if not self._ended:
            raise RequestInvalid("form", "must be complete", "a body that ends too early", "Send it again.")
        return self._form

    def close(self) -> None:
        if self._file:
            self._file.close()
            self._file = None

    def on_part_begin(self) -> None:
        self._begin_part()

    def on_header_field(self, data: bytes, start: int, end: int) -> None:
        self._header_name += data[start:end]

    def on_header_value(self, data: bytes, start: int, end: int) -> None:
        self._header_value += data[start:end]

    def on_header_end(self) -> None:
        if self._header_name.lower() == b"content-disposition":
            self._disposition = bytes(self._header_value)
        self._header_name, self._header_value = bytearray(), bytearray()

    def on_headers_finished(self) -> None:
        _, parameters = parse_options_header(self._disposition)
        self._name = parameters.get(b"name", b"").decode("utf-8", "replace")
        if not self._name:
            raise RequestInvalid("form", "must name each of its parts", "a part without a name")
        if parameters.get(b"filename"):
            self._open(parameters[b"filename"].decode("utf-8", "replace"))
        # A file input that was left empty is sent without a file name, and counts as an empty field.

    def on_part_data(self, data: bytes, start: int, end: int) -> None:
        self._part_bytes += end - start
        limit = self._limits.file_bytes if self._file else self._limits.field_bytes
        if self._part_bytes > limit:
            raise UploadTooLarge(self._name, f"at most {limit} bytes", "more", SHRINK)
        if self._file:
            self._file.write(data[start:end])
        else:
            self._value += data[start:end]

    def on_part_end(self) -> None:
        if self._file:
            self.close()
        else:
            self._form.fields.setdefault(self._name, []).append(self._value.decode("utf-8", "replace"))

    def on_end(self) -> None:
        self._ended = True

    def _begin_part(self) -> None:
        self._part_bytes = 0
        self._name, self._disposition, self._value = "", b"", bytearray()
        self._header_name, self._header_value = bytearray(), bytearray()

    def _open(self, name: str) -> None:
        if len(self._form.files) >= self._limits.files:
            raise UploadTooLarge("upload", f"at most {self._limits.files} files", "more", SHRINK)
        path = safe_relative_path(name, "upload")
        target = self._folder / path
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            self._file = target.open("xb")
        except (FileExistsError, NotADirectoryError):
            raise RequestInvalid(f"upload, name {name!r}", "must be sent once", "it twice") from None
        self._name = name
        self._form.files.append(path)


def _parser(boundary: bytes, receiver: _Receiver) -> MultipartParser:
    callbacks: MultipartCallbacks = {
        "on_part_begin": receiver.on_part_begin,
        "on_header_field": receiver.on_header_field,
        "on_header_value": receiver.on_header_value,
        "on_header_end": receiver.on_header_end,
        "on_headers_finished": receiver.on_headers_finished,
        "on_part_data": receiver.on_part_data,
        "on_part_end": receiver.on_part_end,
        "on_end": receiver.on_end,
    }
    try:
        return MultipartParser(boundary, callbacks)
    except FormParserError as error:
        raise RequestInvalid("Content-Type", "must have a usable boundary", str(error)[:120]) from None
