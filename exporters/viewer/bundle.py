"""Bundles of the viewer and one scene."""

import io
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

from core.errors import ViewerMissing
from exporters.viewer.modules import modules_from, with_paths_as_names
from exporters.viewer.page import ViewerPage

PAGE, INDEX, SCENE = "viewer.html", "index.html", "scene.glb"
HTML_NAME, ZIP_NAME = "viewer.html", "viewer.zip"
VIEWER = Path(__file__).resolve().parents[2] / "viewer_static"
VENDOR, INSTALLED = "vendor/three/", "node_modules/three/"  # where pages ask for three.js, and where it lies
LICENCE = f"{VENDOR}LICENSE"
_THEN = (1980, 1, 1, 0, 0, 0)  # no dates: the same scene gives the same archive


def write_viewer_bundle(glb: bytes, *, title: str = "Scene", viewer: Path = VIEWER) -> dict[str, bytes]:
    """`index.html`, `scene.glb` and all that the viewer needs, by relative paths: a folder for any static host.

    Args:
        glb: any of the .glb files; scene.web.glb loads fastest.
        title: what the page calls the scene.
        viewer: the folder of the viewer's sources, with its node_modules.

    Raises:
        ViewerMissing: the viewer, or three.js, is not installed.
    """
    read = _reader(viewer)
    page, files = _page_and_files(read)
    modules = modules_from(page.entry, page.import_map, lambda path: read(path).decode())
    return {
        INDEX: page.with_file_beside(SCENE, title).encode(),
        SCENE: glb,
        LICENCE: read(LICENCE),
        **files,
        **{path: text.encode() for path, text in modules.items()},
    }


def write_viewer_html(glb: bytes, *, title: str = "Scene", viewer: Path = VIEWER) -> dict[str, bytes]:
    """`{"viewer.html": ...}`: viewer and scene in one file, which can be opened as it is, mailed or archived.

    Args, raises: as `write_viewer_bundle`.
    """
    read = _reader(viewer)
    page, files = _page_and_files(read)
    found = modules_from(page.entry, page.import_map, lambda path: read(path).decode())
    modules = {path: with_paths_as_names(path, text, page.import_map) for path, text in found.items()}
    return {HTML_NAME: page.with_all_within(glb, title, modules, files, read(LICENCE).decode())}


def write_viewer_zip(glb: bytes, *, title: str = "Scene", viewer: Path = VIEWER) -> dict[str, bytes]:
    """`{"viewer.zip": ...}`: the folder of `write_viewer_bundle` as an archive."""
    return {ZIP_NAME: zipped(write_viewer_bundle(glb, title=title, viewer=viewer))}


def zipped(files: Mapping[str, bytes]) -> bytes:
    """A .zip of files; what is compressed already is stored."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as opened:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, _THEN)
            entry.external_attr = 0o644 << 16
            opened.writestr(entry, data, zipfile.ZIP_STORED if name.endswith(".glb") else zipfile.ZIP_DEFLATED)
    return archive.getvalue()


def _page_and_files(read: Callable[[str], bytes]) -> tuple[ViewerPage, dict[str, bytes]]:
    """The page, and its styles and icon by path."""
    page = ViewerPage(read(PAGE).decode())
    return page, {path: read(path) for path in (*page.styles, page.icon)}


def _reader(viewer: Path) -> Callable[[str], bytes]:
    """Reads a path as the page asks for it."""

    def read(path: str) -> bytes:
        file = viewer / (INSTALLED + path.removeprefix(VENDOR) if path.startswith(VENDOR) else path)
        try:
            return file.read_bytes()
        except OSError as error:
            raise ViewerMissing(
                str(path), "must be there to make a bundle of the viewer", str(error), "Run `make setup`."
            ) from error

    return read
