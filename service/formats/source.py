"""What is exported."""

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from core.baked import BakedScene

if TYPE_CHECKING:
    from exporters.gltf import Provenance


class Source:
    """A scene on its way out, and what several formats are made of.

    Args:
        scene: what to export.
        title: what people call it; part of the formats that have a place for it.
        file: that the scene was read from. It is never written to.
        provenance: where it comes from; part of glTF.
    """

    def __init__(
        self,
        scene: BakedScene,
        title: str = "Scene",
        file: Path | None = None,
        provenance: "Provenance | None" = None,
    ) -> None:
        self.scene, self.title, self.provenance, self._file = scene, title, provenance, file

    def is_file(self, path: Path) -> bool:
        """Whether the scene was read from there."""
        return self._file is not None and path.exists() and path.samefile(self._file)

    @cached_property
    def web_glb(self) -> bytes:
        """scene.web.glb: a format of its own, and what the viewer's bundles hold."""
        from exporters.gltf import write_web_glb

        (data,) = write_web_glb(self.scene, self.provenance).values()
        return data
