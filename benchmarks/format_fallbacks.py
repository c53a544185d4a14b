"""How well those viewers that know nothing of the network show the photos, and the picture of it."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import moderngl
import numpy as np
from PIL import Image, ImageDraw
from pxr import UsdGeom

from benchmarks.format_rows import FALLBACK_DB, FallbackRow
from core.baked import BakedScene
from core.camera import Camera
from core.capture import View
from core.metrics import psnr
from core.render.composite import over, quantised
from core.render.visibility import pixel_means, subpixel_camera
from exporters.usd import write_usd
from exporters.usd.quicklook import write_quicklook
from tests.parity.gl_matrices import in_asset
from tests.parity.gl_renderer import GlRenderer
from tests.parity.unlit import UnlitRenderer
from tests.parity.usd_renderer import UsdRenderer

Draw = Callable[[Camera], np.ndarray]  # of a camera in the scene's object frame; [h, w, 4], premultiplied
CAPTION_PX = 24
PHOTO = "photo"


@dataclass(frozen=True)
class Drawing:
    """One file, drawn in one way.

    Attributes:
        caption: in the picture.
    """

    name: str
    by: str
    caption: str
    draw: Draw
    goal_db: float | None = FALLBACK_DB


@dataclass
class Pictures:
    """uint8 [h, w, 3] of each view, by caption."""

    columns: dict[str, list[np.ndarray]] = field(default_factory=dict)

    def add(self, caption: str, images: Sequence[np.ndarray]) -> None:
        self.columns[caption] = list(images)

    def side_by_side(self) -> Image.Image:
        """A column for each caption, a row for each view."""
        grid = np.concatenate([np.concatenate(column) for column in self.columns.values()], 1)
        sheet = Image.new("RGB", (grid.shape[1], grid.shape[0] + CAPTION_PX), "white")
        sheet.paste(Image.fromarray(grid), (0, CAPTION_PX))
        left, draw = 0, ImageDraw.Draw(sheet)
        for caption, column in self.columns.items():
            draw.text((left + 4, 4), caption, fill="black")
            left += column[0].shape[1]
        return sheet


def fallbacks(
    base: str, glb: bytes, scene: BakedScene, views: Sequence[View], context: moderngl.Context, pictures: Pictures
) -> Iterator[FallbackRow]:
    """A row for each, as it is done; the neural rendering first, to compare with.

    Args:
        glb: scene.glb.
        scene: what was read of it.
        views: in the scene's object frame.
        pictures: that the photos and renderings are added to.
    """
    photos = [view.over(scene.background) for view in views]
    pictures.add(PHOTO, [quantised(photo) for photo in photos])
    with tempfile.TemporaryDirectory() as folder:
        for drawing in _drawings(glb, scene, context, Path(folder)):
            images = [quantised(over(drawing.draw(view.camera), scene.background)) for view in views]
            found = [
                psnr(photo, image / 255.0, view.ignored)
                for view, photo, image in zip(views, photos, images, strict=True)
            ]
            pictures.add(drawing.caption, images)
            yield FallbackRow(base, drawing.name, drawing.by, float(np.mean(found)), min(found), drawing.goal_db)


def _drawings(glb: bytes, scene: BakedScene, context: moderngl.Context, folder: Path) -> Iterator[Drawing]:
    neural = GlRenderer(context, glb)
    yield Drawing("scene.glb", "network", "network", lambda camera: neural.render(camera, "deferred"), None)
    unlit = UnlitRenderer(context, glb)
    yield Drawing("scene.glb", "glTF unlit", "glTF unlit", _in_frame(unlit.render, scene.asset_from_object))
    usd = UsdRenderer(context, write_usd(scene), folder, "preview")
    preview = _in_frame(usd.render, scene.asset_from_object)
    yield Drawing("scene.usdc", "UsdPreviewSurface", "UsdPreviewSurface", preview)
    phone = UsdRenderer(context, write_quicklook(scene), folder, "preview", smooth=True)
    standing = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(phone.stage.GetDefaultPrim())).T
    draw = _in_frame(phone.render, standing)
    yield Drawing("scene.quicklook.usdz", "UsdPreviewSurface, interpolated texels", "Quick Look", draw)


def _in_frame(render: Draw, asset_from_object: np.ndarray) -> Draw:
    """`render` takes cameras of the asset's frame and has one sample a pixel; the result has four."""

    def draw(camera: Camera) -> np.ndarray:
        return pixel_means(render(in_asset(subpixel_camera(camera), asset_from_object)))

    return draw
