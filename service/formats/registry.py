"""Every deliverable, in the order in which they are exported and listed.

Importing this is cheap: what writes and reads a format is imported when it is used. Several need libraries that the
server has no use for.
"""

import base64
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from core.baked import BakedScene
from core.errors import AssetInvalid
from service.errors import UnknownFormat
from service.formats.archive import unzipped, zipped
from service.formats.source import Source

if TYPE_CHECKING:
    from service.formats.colours import Coloured

GLB, ZIP = "model/gltf-binary", "application/zip"
ALL = "all"
_WITHIN_HTML = re.compile(rb'<script type="text/plain" id="polyfield-scene"[^>]*>([A-Za-z0-9+/=]*)</script>')


@dataclass(frozen=True)
class Format:
    """One deliverable: one file.

    Attributes:
        name: the word that chooses it.
        file: its name in a folder of results.
        media_type: of the file.
        text: what it is, in one line.
        opens_in: programs that show it.
        write: makes the file.
        read: what is in the file, to measure it on: a scene, or of formats without the network its colours.
    """

    name: str
    file: str
    media_type: str
    text: str
    opens_in: str
    write: Callable[[Source], bytes]
    read: "Callable[[bytes], BakedScene | Coloured]"


def _write_glb(source: Source) -> bytes:
    from exporters.gltf import write_glb

    return _only(write_glb(source.scene, source.provenance))


def _read_glb(data: bytes) -> BakedScene:
    from exporters.gltf import read_glb

    return read_glb(data)


def _write_lq(source: Source) -> bytes:
    from exporters.gltf import write_lq_glb

    return _only(write_lq_glb(source.scene, source.provenance))


def _write_gltf(source: Source) -> bytes:
    from exporters.gltf import write_gltf

    return zipped(write_gltf(source.scene, source.provenance))


def _read_gltf(data: bytes) -> BakedScene:
    from exporters.gltf import read_gltf

    return read_gltf(unzipped(data))


def _write_usd(source: Source) -> bytes:
    from exporters.usd import write_usd

    return zipped(write_usd(source.scene))


def _read_usd(data: bytes) -> BakedScene:
    from exporters.usd import read_usd

    return read_usd(unzipped(data))


def _write_quicklook(source: Source) -> bytes:
    from exporters.usd.quicklook import write_quicklook

    return _only(write_quicklook(source.scene))


def _read_quicklook(data: bytes) -> "Coloured":
    from service.formats.quicklook import read_quicklook

    return read_quicklook(data)


def _write_mobilenerf(source: Source) -> bytes:
    from exporters.mobilenerf import write_mobilenerf

    return zipped(write_mobilenerf(source.scene))


def _read_mobilenerf(data: bytes) -> BakedScene:
    from exporters.mobilenerf import read_mobilenerf

    return read_mobilenerf(unzipped(data))


def _write_obj(source: Source) -> bytes:
    from exporters.plain import write_obj

    return zipped(write_obj(source.scene))


def _read_obj(data: bytes) -> "Coloured":
    from service.formats.plain import read_obj

    return read_obj(unzipped(data))


def _write_ply(source: Source) -> bytes:
    from exporters.plain import write_ply

    return _only(write_ply(source.scene))


def _read_ply(data: bytes) -> "Coloured":
    from service.formats.plain import read_ply

    return read_ply(data)


def _write_viewer(source: Source) -> bytes:
    from exporters.viewer import write_viewer_zip

    return _only(write_viewer_zip(source.web_glb, title=source.title))


def _read_viewer(data: bytes) -> BakedScene:
    return _read_glb(unzipped(data)["scene.glb"])


def _write_html(source: Source) -> bytes:
    from exporters.viewer import write_viewer_html

    return _only(write_viewer_html(source.web_glb, title=source.title))


def _read_html(data: bytes) -> BakedScene:
    match = _WITHIN_HTML.search(data)
    if not match or not data.endswith(b"</html>\n"):
        raise AssetInvalid("viewer.html", "must be whole and hold a scene", f"{len(data)} bytes")
    return _read_glb(base64.b64decode(match[1]))


def _only(files: Mapping[str, bytes]) -> bytes:
    (data,) = files.values()
    return data


_ALL = (
    Format(
        "glb", "scene.glb", GLB, "the asset, for every loader",
        "Polyfield's viewer; any glTF viewer (baked colours)", _write_glb, _read_glb,
    ),
    Format(
        "web", "scene.web.glb", GLB, "the asset in the fewest bytes that look the same (meshopt, WebP)",
        "Polyfield's viewer; three.js, model-viewer (baked colours)", lambda source: source.web_glb, _read_glb,
    ),
    Format(
        "lq", "scene.lq.glb", GLB, "as web, with half the texels a side, for phones",
        "Polyfield's viewer; three.js, model-viewer (baked colours)", _write_lq, _read_glb,
    ),
    Format(
        "gltf", "scene.gltf.zip", ZIP, "the asset taken apart: .gltf, .bin and PNGs",
        "any glTF viewer (baked colours); a text editor", _write_gltf, _read_gltf,
    ),
    Format(
        "usd", "scene.usd.zip", ZIP, "neural USD: a layer and PNGs, with MaterialX, glslfx and a plain preview surface",
        "usdview and other USD renderers, Blender (baked colours)", _write_usd, _read_usd,
    ),
    Format(
        "quicklook", "scene.quicklook.usdz", "model/vnd.usdz+zip", "a decimated mesh with baked colours, for phones",
        "AR Quick Look on iPhone and iPad, Blender", _write_quicklook, _read_quicklook,
    ),
    Format(
        "mobilenerf", "scene.mobilenerf.zip", ZIP, "MobileNeRF's own layout: OBJ, PNG pairs, mlp.json",
        "MobileNeRF's viewers for the web, WebXR, Unity, Unreal", _write_mobilenerf, _read_mobilenerf,
    ),
    Format(
        "obj", "scene.obj.zip", ZIP, "a plain mesh with baked colours as textures: OBJ, MTL, PNGs",
        "nearly everything", _write_obj, _read_obj,
    ),
    Format(
        "ply", "scene.ply", "application/octet-stream", "a plain mesh with baked colours at its vertices",
        "MeshLab, CloudCompare, Blender", _write_ply, _read_ply,
    ),
    Format(
        "viewer", "viewer.zip", ZIP, "a folder with viewer and scene, for any static host",
        "any browser, from a web server", _write_viewer, _read_viewer,
    ),
    Format(
        "html", "viewer.html", "text/html", "viewer and scene in one file",
        "any browser, from a web server, a disk or a mail", _write_html, _read_html,
    ),
)  # fmt: skip
FORMATS: Mapping[str, Format] = {one.name: one for one in _ALL}
DEFAULT = ("glb",)


def formats_of(words: str | Iterable[str]) -> tuple[str, ...]:
    """The names that were chosen, once each, in the registry's order.

    Args:
        words: "all", names between commas, or several of these.

    Raises:
        UnknownFormat: one of them is not known, or there are none.
    """
    texts = [words] if isinstance(words, str) else words
    chosen = {word.strip() for text in texts for word in text.split(",")} - {""}
    unknown = sorted(chosen - {ALL, *FORMATS})
    if unknown or not chosen:
        rule = f"must be {ALL}, or some of {', '.join(FORMATS)}"
        raise UnknownFormat("formats", rule, ", ".join(map(repr, unknown))[:80] or "none")
    return tuple(name for name in FORMATS if ALL in chosen or name in chosen)
