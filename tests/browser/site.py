"""A web server for tests: the viewer's pages as the service serves them, and files held in memory."""

import mimetypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit

PAGES = Path(__file__).parent / "pages"
VIEWER = Path(__file__).resolve().parents[2] / "viewer_static"
# The same addresses as the service's.
FOLDERS = {"/vendor/three/": VIEWER / "node_modules" / "three", "/pages/": PAGES, "/": VIEWER}
mimetypes.add_type("text/javascript", ".js")
mimetypes.add_type("model/gltf-binary", ".glb")

# Answers a request: (method, path, body) -> (status, media type, body), or None for "not mine".
Answer = tuple[int, str, bytes]
Handler = Callable[[str, str, bytes], Answer | None]


@dataclass
class Site:
    """A running site.

    Attributes:
        url: its root, without a slash at the end.
        files: what is served in addition, by path ("/scene.glb"); may be changed while it runs.
        api: answers what is not a file, when given.
    """

    url: str
    files: dict[str, bytes] = field(default_factory=dict)
    api: Handler | None = None


@contextmanager
def running_site() -> Iterator[Site]:
    """Serves until the block ends, on a free port of this machine only."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Requests)
    server.daemon_threads = True
    server.site = Site(f"http://127.0.0.1:{server.server_port}")  # type: ignore[attr-defined]
    thread = Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server.site  # type: ignore[attr-defined]
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Requests(BaseHTTPRequestHandler):
    def handle_request(self) -> None:
        path = urlsplit(self.path).path
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        site: Site = self.server.site  # type: ignore[attr-defined]
        answer = _from_memory(site, path) or (site.api and site.api(self.command, path, body)) or _from_disk(path)
        status, media_type, content = answer or (HTTPStatus.NOT_FOUND, "text/plain", b"not found")
        self.send_response(status)
        self.send_header("Content-Type", media_type)
        self.send_header("Content-Length", str(len(content)))
        # What is the same for every test may be kept: three.js is most of what a page loads.
        self.send_header("Cache-Control", "max-age=3600" if path.startswith("/vendor/") else "no-store")
        self.end_headers()
        self.wfile.write(content)

    do_GET = do_POST = do_DELETE = handle_request  # noqa: N815, RUF100 (the names http.server calls)

    def log_message(self, format: str, *args: object) -> None:
        """Keeps the tests' output to themselves."""


def _from_memory(site: Site, path: str) -> Answer | None:
    return (HTTPStatus.OK, _media_type(path), site.files[path]) if path in site.files else None


def _from_disk(path: str) -> Answer | None:
    prefix = next(prefix for prefix in FOLDERS if path.startswith(prefix))
    file = FOLDERS[prefix] / (path[len(prefix) :] or "index.html")
    inside = file.resolve().is_relative_to(FOLDERS[prefix].resolve())
    return (HTTPStatus.OK, _media_type(file.name), file.read_bytes()) if inside and file.is_file() else None


def _media_type(name: str) -> str:
    return mimetypes.guess_type(name)[0] or "application/octet-stream"
