"""A baked scene in MobileNeRF's layout."""

from core.baked import BakedScene
from core.errors import SceneInvalid
from exporters.limits import check_size
from exporters.mobilenerf.alpha import as_stored
from exporters.mobilenerf.axes import Axes, fitting_axes, moved, network_from_object, obj_from_object, turned
from exporters.mobilenerf.mlp import mlp_bytes
from exporters.mobilenerf.obj import obj_bytes
from exporters.png import encode_pngs


def write_mobilenerf(scene: BakedScene, axes: Axes | None = None) -> dict[str, bytes]:
    """`shape{i}.obj`, `shape{i}.pngfeat{0,1}.png` and `mlp.json`.

    `read_mobilenerf` returns the scene but for three things: features 3 and 7 keep 128 levels, the fallback's colours
    are estimated, and with "forward" positions and weights are rounded once, for the frame is turned.

    Args:
        axes: for which of the layout's viewers; None is "forward" for a scene with a camera to start from that has
            everything before it, else "z-up".

    Raises:
        SceneInvalid: the pages exceed what a reader accepts.
    """
    check_size([page.features_u8.shape[:2] for page in scene.pages], SceneInvalid)
    axes = axes or fitting_axes(scene)
    matrix = obj_from_object(scene, axes)
    network = turned(scene.network, network_from_object(axes, matrix))
    pngs = encode_pngs([image for page in scene.pages for image in as_stored(page.features_u8)])
    files = {"mlp.json": mlp_bytes(network, scene, axes, matrix)}
    for number, page in enumerate(scene.pages):
        files[f"shape{number}.obj"] = obj_bytes(moved(page.positions, matrix), page)
        files[f"shape{number}.pngfeat0.png"], files[f"shape{number}.pngfeat1.png"] = pngs[2 * number : 2 * number + 2]
    return files
