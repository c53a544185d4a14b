"""The chunks of a PNG file, by name."""

from collections.abc import Iterator

COLOR_CHUNKS = frozenset({"gAMA", "cHRM", "iCCP", "sRGB", "cICP"})  # decoders may convert colours by these


def chunk_names(data: bytes) -> Iterator[str]:
    """Names in the order of the file; stops where it is damaged."""
    offset = 8
    while offset + 8 <= len(data):
        length = int.from_bytes(data[offset : offset + 4], "big")
        yield data[offset + 4 : offset + 8].decode("latin-1")
        offset += 12 + length
