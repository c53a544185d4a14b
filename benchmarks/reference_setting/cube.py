"""Where the object is: the paper's scaled grid of eq. 22."""

from dataclasses import dataclass

import numpy as np

from core.capture import Capture
from core.errors import OptionInvalid
from core.field.region import find_region
from core.scene_kind import OBJECT


@dataclass(frozen=True)
class Cube:
    """cube = (object - centre) / half. Args: centre: [3] float64; half: half its edge, object units."""

    centre: np.ndarray
    half: float

    def to_cube(self, points: np.ndarray) -> np.ndarray:
        return (np.asarray(points, np.float64) - self.centre) / self.half

    def to_object(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(points, np.float64) * self.half + self.centre


def cube_around(capture: Capture) -> Cube:
    """The cube that Polyfield finds for an object.

    Raises:
        CaptureEmpty
        OptionInvalid: the capture is no object; the paper's other two meshes are not written here.
    """
    if capture.kind.name != OBJECT:
        raise OptionInvalid("the paper's setting", "needs a capture of an object", f"one that is {capture.kind.name}")
    frame = find_region(capture).frame
    return Cube(frame.centre, frame.half)
