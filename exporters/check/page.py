"""One page: its mesh, its textures, and whether they belong together."""

from typing import Any

import numpy as np

from core.baked import Page, ShaderNetwork
from core.conventions import is_opaque
from exporters.check.features import check_features
from exporters.check.finding import Findings
from exporters.check.png_chunks import COLOR_CHUNKS, chunk_names
from exporters.check.storage import check_alignment, check_image_kind
from exporters.gltf import extension, reader
from exporters.gltf.document import Document
from exporters.gltf.quantization import steps_of
from exporters.images import decode_image
from exporters.invalid import invalid

_NAMES = ("features 0-3", "features 4-7", "fallback colour")
_NEAREST = 9728
DEGENERATE_SHARE = 0.01  # of the triangles; a few are rounding


def check_page(
    found: Findings, document: Document, primitive: dict[str, Any], name: str, network: ShaderNetwork | None
) -> None:
    """Adds what is wrong with a neural primitive.

    Args:
        network: None where it could not be read; then features are not compared with colours.
    """
    found.attempt("fallback", f"{name}'s material", _check_fallback, found, document, primitive, name)
    mesh = found.attempt("mesh", f"{name}'s mesh", reader.mesh_of, document, primitive)
    if mesh is not None:
        found.attempt("mesh", f"{name}'s mesh", check_alignment, found, document, primitive, name)
        found.attempt("mesh", f"{name}'s mesh", _check_mesh, found, document, primitive, name, *mesh)
    files = found.attempt("texture", f"{name}'s textures", reader.page_files, document, primitive)
    if files is None:
        return
    found.attempt("texture", f"{name}'s textures", _check_sampling, found, document, primitive, name)
    for texture, file, label in zip(_textures(document, primitive), files, _NAMES, strict=True):
        found.attempt("texture", name, check_image_kind, found, document, texture, file, f"{name}, {label}")
        managed = COLOR_CHUNKS & set(chunk_names(file))
        if managed and label != _NAMES[2]:
            found.error("texture", f"{name}, {label}", f"must not say how to convert colours ({', '.join(managed)})")
    images = [
        found.attempt("texture", name, decode_image, file, f"{name}, {label}")
        for file, label in zip(files, _NAMES, strict=True)
    ]
    if any(image is None for image in images):
        return
    features0, features1, color = (image for image in images if image is not None)
    features_u8 = np.concatenate([features0, features1], -1)
    if mesh is not None:
        found.attempt("mesh", f"{name}'s mesh", Page, features_u8, np.ascontiguousarray(color[..., :3]), *mesh)
    _check_holes(found, features_u8, color, name)
    if network is not None:
        check_features(found, features_u8, color, network, name)


def _check_fallback(found: Findings, document: Document, primitive: dict[str, Any], name: str) -> None:
    material = document.item("materials", primitive.get("material"))
    wrong = [
        text
        for text, right in (
            ("alphaMode MASK", material.get("alphaMode") == "MASK"),
            ("doubleSided", material.get("doubleSided") is True),
            ("KHR_materials_unlit", "KHR_materials_unlit" in material.get("extensions", {})),
        )
        if not right
    ]
    if wrong:
        found.warning("fallback", f"{name}'s material", f"should have {', '.join(wrong)}")


def _check_mesh(
    found: Findings,
    document: Document,
    primitive: dict[str, Any],
    name: str,
    positions: np.ndarray,
    texcoords: np.ndarray,
    triangles: np.ndarray,
) -> None:
    if len(positions) == 0 or len(triangles) == 0:
        raise invalid(f"{name}'s mesh", "must have triangles", f"{len(positions)} vertices, {len(triangles)} triangles")
    accessor = document.item("accessors", primitive["attributes"]["POSITION"])
    stored = steps_of(positions) if accessor.get("normalized") else positions
    for bound, actual in (("min", stored.min(0)), ("max", stored.max(0))):
        if not np.array_equal(np.asarray(accessor.get(bound), np.float32), actual):
            found.error("mesh", f"{name}, POSITION", f"must state its {bound}, {actual.tolist()}, as glTF asks for")
    if int(triangles.max()) < len(positions):
        corners = positions[triangles].astype(np.float64)
        with np.errstate(over="ignore", invalid="ignore"):
            flat = ~(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) != 0).any(-1)
        if flat.mean() > DEGENERATE_SHARE:
            found.warning(
                "mesh", f"{name}'s mesh", f"should have area: {100 * flat.mean():.0f} % of its triangles lack it"
            )


def _check_sampling(found: Findings, document: Document, primitive: dict[str, Any], name: str) -> None:
    texture = document.item("textures", _textures(document, primitive)[2])
    sampler = document.item("samplers", texture["sampler"]) if "sampler" in texture else {}
    if (sampler.get("magFilter"), sampler.get("minFilter")) != (_NEAREST, _NEAREST):
        found.warning("texture", f"{name}, {_NAMES[2]}", "should be sampled nearest: patches bleed into each other")


def _textures(document: Document, primitive: dict[str, Any]) -> tuple[int, int, int]:
    """Indices of features 0-3, features 4-7 and the fallback's colour."""
    first, second = (texture["index"] for texture in primitive["extensions"][extension.NAME]["featureTextures"])
    material = document.item("materials", primitive.get("material"))
    return first, second, material["pbrMetallicRoughness"]["baseColorTexture"]["index"]


def _check_holes(found: Findings, features_u8: np.ndarray, color: np.ndarray, name: str) -> None:
    opaque = is_opaque(features_u8)
    differ = int((opaque != (color[..., 3] > 0)).sum())
    if differ:
        found.error("hole", name, f"must have holes where the fallback has, but {differ} texels differ")
