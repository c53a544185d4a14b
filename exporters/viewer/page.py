"""viewer.html, changed for one scene."""

import base64
import gzip
import html
import json
import re
from collections.abc import Mapping

_IMPORT_MAP = re.compile(r'<script type="importmap">(.*?)</script>', re.DOTALL)
_ENTRY = re.compile(r'<script type="module" src="\./([^"]+)"></script>')
_STYLE = re.compile(r'<link rel="stylesheet" href="\./([^"]+)" />')
_ICON = re.compile(r'<link rel="icon" href="\./([^"]+)"')
_BACK = re.compile(r'\s*<a class="[^"]*" href="\./"[^>]*>.*?</a>', re.DOTALL)  # to the service's other pages
_TITLE = re.compile(r"<title>.*?</title>", re.DOTALL)
_SCENE = "<the scene>"  # stands for it; nothing else can hold it, since titles are escaped

# Modules are unpacked and named to the browser before the first of them is asked for.
_START = """
const unpacked = async (id) => {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).json();
};
unpacked("polyfield-modules").then((modules) => {
  const asUrl = (text) => URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const imports = Object.fromEntries(Object.entries(modules).map(([name, text]) => [name, asUrl(text)]));
  const map = document.createElement("script");
  map.type = "importmap";
  map.textContent = JSON.stringify({ imports });
  document.head.append(map);
  return import("ENTRY");
});
"""


class ViewerPage:
    """The page's text, and what it refers to by paths relative to it.

    Attributes:
        import_map: specifiers to paths.
        entry: path of the module that it starts.
        styles: paths of style sheets.
        icon: path.
    """

    def __init__(self, text: str) -> None:
        self._text = _BACK.sub("", text)
        stated = json.loads(_found(_IMPORT_MAP, text))["imports"]
        self.import_map = {name: path.removeprefix("./") for name, path in stated.items()}
        self.entry = _found(_ENTRY, text)
        self.styles = _STYLE.findall(text)
        self.icon = _found(_ICON, text)

    def with_file_beside(self, name: str, title: str) -> str:
        """The page that shows the file `name` of its own folder."""
        meta = f'<meta name="polyfield-scene" content="{html.escape(name)}" data-title="{html.escape(title)}" />'
        return self._titled(title).replace("</head>", f"  {meta}\n  </head>")

    def with_all_within(
        self, glb: bytes, title: str, modules: Mapping[str, str], files: Mapping[str, bytes], licence: str
    ) -> bytes:
        """The page that needs no other file. The scene, which may have 200 MB, is copied once, when it is put in.

        Args:
            modules: by path, importing each other by paths.
            files: styles and icon, by path.
            licence: of the modules that are not ours.
        """
        packed = base64.b64encode(gzip.compress(json.dumps(modules).encode(), 9, mtime=0)).decode()
        scene = f'id="polyfield-scene" data-title="{html.escape(title)}"'
        body = [
            f'<script type="text/plain" {scene}>{_SCENE}</script>',
            f'<script type="text/plain" id="polyfield-modules">{packed}</script>',
            f"<script>{_START.replace('ENTRY', self.entry)}</script>",
        ]
        text = _IMPORT_MAP.sub("", _ENTRY.sub("", self._titled(title)))
        text = _STYLE.sub(lambda match: f"<style>{files[match[1]].decode()}</style>", text)
        icon = f"data:image/svg+xml;base64,{base64.b64encode(files[self.icon]).decode()}"
        text = _ICON.sub(lambda _: f'<link rel="icon" href="{icon}"', text)
        text = text.replace("</body>", "".join(f"    {part}\n" for part in body) + "  </body>")
        text = text.replace("<html", f"<!--\nIt contains three.js:\n\n{licence.strip()}\n-->\n<html", 1)
        before, after = text.encode().split(_SCENE.encode())
        return b"".join([before, base64.b64encode(glb), after])

    def _titled(self, title: str) -> str:
        return _TITLE.sub(lambda _: f"<title>{html.escape(title)}</title>", self._text)


def _found(pattern: re.Pattern[str], text: str) -> str:
    match = pattern.search(text)
    assert match, f"viewer.html has nothing like {pattern.pattern}"
    return match[1]
