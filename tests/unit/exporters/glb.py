"""A .glb taken apart and put together again, for tests that damage it."""

import json
import struct
from typing import Any

JSON, BIN = 0x4E4F534A, 0x004E4942


def split(glb: bytes) -> tuple[dict[str, Any], bytes]:
    """(JSON, binary chunk)."""
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


def join(document: dict[str, Any], binary: bytes) -> bytes:
    """The inverse of `split`. NaN and infinity are written as Python does."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), JSON) + text + struct.pack("<II", len(binary), BIN) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks
