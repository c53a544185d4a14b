"""Where the object is: the paper's scaled grid of eq. 22."""

from dataclasses import dataclass

import numpy as np

from core.capture import Capture
from core.field.region import find_region


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
    """
    frame = find_region(capture).frame
    return Cube(frame.centre, frame.half)
