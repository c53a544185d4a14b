"""Decoding EXT_meshopt_compression, with every number checked before memory is taken."""

from typing import Any, Literal

import meshopt

from exporters.invalid import invalid

MESHOPT = "EXT_meshopt_compression"
Mode = Literal["ATTRIBUTES", "TRIANGLES"]
FILTERS = ("NONE", "EXPONENTIAL")
# The attribute codec spends at least a byte on 64, the triangle codec one on a triangle: small files cannot claim much.
MOST_EXPANSION = 64


def decoded(coding: dict[str, Any], stored: memoryview, subject: str) -> tuple[memoryview, int]:
    """(content, bytes a row) of a buffer view's extension and the bytes that it refers to.

    Raises:
        AssetInvalid
    """
    mode: Any = coding.get("mode")
    count: Any = coding.get("count")
    stride: Any = coding.get("byteStride")
    kind = coding.get("filter", "NONE")
    if mode not in ("ATTRIBUTES", "TRIANGLES") or kind not in FILTERS:
        raise invalid(
            subject, f"must be of mode ATTRIBUTES or TRIANGLES, filtered by {FILTERS}", f"{mode}, {kind}"[:80]
        )
    strides = (2, 4) if mode == "TRIANGLES" else tuple(range(4, 257, 4))
    whole = isinstance(count, int) and isinstance(stride, int) and stride in strides and count >= 0
    if not whole or (mode == "TRIANGLES" and count % 3):
        raise invalid(subject, "must have a count and a stride of its mode", f"{count} of {stride} bytes"[:80])
    if count * stride > MOST_EXPANSION * len(stored):
        raise invalid(subject, f"must not decode to {count * stride} bytes", f"{len(stored)} bytes")
    try:
        rows = meshopt.decode_gltf_buffer(bytes(stored), count, stride, mode, kind)
    except ValueError as error:
        raise invalid(subject, "must be an intact compressed buffer view", str(error)[:80]) from error
    return memoryview(rows.tobytes()), stride
