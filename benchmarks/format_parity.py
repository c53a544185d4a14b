"""Whether every deliverable with the network shows, in OpenGL, what the reference renderer shows of the scene."""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import moderngl
import numpy as np

from benchmarks.format_rows import ParityRow
from core.baked import BakedScene
from core.capture import View
from core.render.reference import render_deferred, render_forward
from exporters.gltf import read_gltf, write_glb, write_gltf
from exporters.gltf.document import Document
from exporters.gltf.extension import shaders_from_json
from exporters.gltf.reader import root_extension, the_network
from exporters.mobilenerf import read_mobilenerf, write_mobilenerf
from exporters.usd import write_usd
from service.formats.measure import in_frame
from service.formats.source import Source
from tests.parity.compare import INTERIOR_DB, QUANTISED_DB, QUANTISED_VISIBLE, VISIBLE, compare, pixels_with_edges
from tests.parity.gl_matrices import in_asset
from tests.parity.gl_renderer import GlRenderer, Mode
from tests.parity.usd_renderer import Look, UsdRenderer

Draw = Callable[[View], np.ndarray]  # of a view in the scene's object frame; [h, w, 4] as the reference renderer's
MODES: tuple[Mode, ...] = ("deferred", "forward")
LOOKS: dict[Look, str] = {"storm": "glslfx", "materialx": "MaterialX"}


class Reference:
    """What the reference renderer shows of a scene at one view, in the scene's object frame. Rendered when asked for.

    Attributes:
        view: with its photo.
    """

    def __init__(self, scene: BakedScene, view: View) -> None:
        self.view, self._scene = view, scene

    @cached_property
    def deferred(self) -> np.ndarray:
        return render_deferred(self._scene, self.view.camera)

    @cached_property
    def forward(self) -> np.ndarray:
        return render_forward(self._scene, self.view.camera)

    @cached_property
    def edges(self) -> np.ndarray:
        return pixels_with_edges(self._scene, self.view.camera)


@dataclass(frozen=True)
class Drawing:
    """One file, drawn in one way. `visible` as of tests.parity.compare.compare."""

    name: str
    by: str
    mode: Mode
    draw: Draw
    least_db: float = INTERIOR_DB
    visible: float = VISIBLE

    def row(self, base: str, references: Sequence[Reference]) -> ParityRow:
        """The worst of the views."""
        found = [
            compare(self.draw(one.view), getattr(one, self.mode), one.edges, visible=self.visible) for one in references
        ]
        interior_db = min(one.interior_psnr for one in found)
        flipped_percent = 100 * max(one.flipped_share for one in found)
        return ParityRow(base, self.name, self.by, interior_db, flipped_percent, self.least_db)


def parity(
    base: str, glb: bytes, source: Source, references: Sequence[Reference], context: moderngl.Context
) -> Iterator[ParityRow]:
    """A row for each file and way of drawing it, as it is done.

    Args:
        glb: scene.glb.
        source: of what was read of it.
        references: of the same scene.
    """
    with tempfile.TemporaryDirectory() as folder:
        for drawing in _drawings(glb, source, context, Path(folder)):
            yield drawing.row(base, references)


def _drawings(glb: bytes, source: Source, context: moderngl.Context, folder: Path) -> Iterator[Drawing]:
    scene = source.scene
    plain = GlRenderer(context, glb)
    for mode in MODES:
        yield Drawing("scene.glb", f"its GLSL, {mode}", mode, _drawn_by(plain, mode, scene))
    web = _drawn_by(GlRenderer(context, source.web_glb), "deferred", scene)
    yield Drawing("scene.web.glb", "its GLSL, deferred; quantised", "deferred", web, QUANTISED_DB, QUANTISED_VISIBLE)
    apart = _drawn_by(_of_gltf(write_gltf(scene, source.provenance), context), "deferred", scene)
    yield Drawing("scene.gltf", "its GLSL, deferred", "deferred", apart)
    layout = write_glb(read_mobilenerf(write_mobilenerf(scene)))["scene.glb"]
    read = _drawn_by(GlRenderer(context, layout), "deferred", scene)
    yield Drawing("scene.mobilenerf.zip", "the extension's GLSL, deferred", "deferred", read)
    files = write_usd(scene)
    for look, shader in LOOKS.items():
        usd = UsdRenderer(context, files, folder, look)
        yield Drawing("scene.usdc", f"its {shader}", "forward", partial(_usd_image, usd, scene))


def _of_gltf(files: Mapping[str, bytes], context: moderngl.Context) -> GlRenderer:
    """What was read of a .gltf, drawn by the shaders in it."""
    shaders = shaders_from_json(the_network(root_extension(Document.of_files(files))))
    return GlRenderer(context, write_glb(read_gltf(files))["scene.glb"], shaders=shaders["glsl330"])


def _drawn_by(renderer: GlRenderer, mode: Mode, scene: BakedScene) -> Draw:
    """In the frame of the scene that the file was made of: the file's own may be another."""

    def draw(view: View) -> np.ndarray:
        (there,) = in_frame([view], scene.user_from_object, renderer.scene.user_from_object)
        return renderer.render(there.camera, mode)

    return draw


def _usd_image(renderer: UsdRenderer, scene: BakedScene, view: View) -> np.ndarray:
    return renderer.render(in_asset(view.camera, scene.asset_from_object))
