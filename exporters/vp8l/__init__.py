"""Lossless WebP in a fifth of libwebp's time, for images so large that a few percent of bytes are worth less."""

from exporters.vp8l.encoder import encode_vp8l

__all__ = ["encode_vp8l"]
