"""What stands behind a scene."""

import numpy as np

from core.capture import WHITE, Capture
from core.scene_kind import OBJECT

EVERY = 8  # pixels and rows looked at


def background_of(capture: Capture) -> tuple[float, float, float]:
    """sRGB in [0, 1]: the capture's own around a cut-out object, or if it was chosen; else the photos' mean colour.

    A scene without an empty background fills the view but for holes, where no photo looked: there the mean colour is
    seen least.
    """
    if capture.kind.name == OBJECT or tuple(capture.background) != WHITE:
        return capture.background
    pixels = np.concatenate([view.image_u8[::EVERY, ::EVERY, :3].reshape(-1, 3) for view in capture.train])
    red, green, blue = (float(channel) for channel in pixels.mean(0) / 255.0)
    return red, green, blue
