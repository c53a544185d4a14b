"""The three kinds of scene (paper, supplement H), and how a capture's kind is told from its alpha and its cameras."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from core.errors import OptionInvalid
from core.rig import Rig

if TYPE_CHECKING:
    import numpy as np

    from core.capture import Capture, View

OBJECT = "object"  # something to walk around, cut out of its surroundings
FORWARD = "forward"  # a scene seen from one side; it may be deep
UNBOUNDED = "unbounded"  # surroundings on all sides
NAMES = (OBJECT, FORWARD, UNBOUNDED)
AUTO = "auto"


@dataclass(frozen=True)
class SceneKind:
    """Attributes:
    name: OBJECT, FORWARD or UNBOUNDED.
    reason: why, as a phrase for the user.
    overridden: whether the user said so.

    Raises:
        OptionInvalid: there is no such kind.
    """

    name: str
    reason: str
    overridden: bool = False

    def __post_init__(self) -> None:
        check_kind_name(self.name)

    def __str__(self) -> str:
        return f"{self.name}: {self.reason}"


def check_kind_name(name: str, *, auto: bool = False) -> None:
    """Raises OptionInvalid unless `name` is a kind (or "auto", where that is allowed)."""
    allowed = (AUTO, *NAMES) if auto else NAMES
    if name not in allowed:
        raise OptionInvalid("scene kind", f"must be one of {', '.join(allowed)}", repr(name)[:40])


# Stands for "detect it"; a capture never keeps it.
UNDECIDED = SceneKind(OBJECT, "undecided")


def chosen_kind(name: str) -> SceneKind:
    """The kind that the user asked for; `UNDECIDED` for "auto".

    Raises:
        OptionInvalid
    """
    check_kind_name(name, auto=True)
    return UNDECIDED if name == AUTO else SceneKind(name, "chosen by the user", overridden=True)


def detect_kind(capture: Capture) -> SceneKind:
    """The kind of a capture, from its training photos' alpha, its cameras and, where there are, depths."""
    return kind_of_views(capture.train, capture.points)


def kind_of_views(views: Sequence[View], points: np.ndarray | None = None) -> SceneKind:
    """As `detect_kind`, from views (at least one) and sparse points [n, 3] in the same frame."""
    if all(view.has_alpha for view in views):
        return SceneKind(OBJECT, "every photo has an alpha channel that cuts the object out")
    rig = Rig.of(views, points)
    degrees = math.degrees(rig.widest_angle_rad)
    if not rig.looks_one_way:
        look = "in all directions" if rig.mean_axis is None else f"up to {degrees:.0f} degrees off their mean direction"
        return SceneKind(UNBOUNDED, f"the photos have no alpha, and the cameras look {look}")
    if rig.advance > rig.near_far[0]:
        return SceneKind(UNBOUNDED, "the photos have no alpha, and some cameras stand within what others see")
    return SceneKind(
        FORWARD,
        f"the photos have no alpha, and all cameras look one way (within {degrees:.0f} degrees) at what is in front "
        "of them",
    )
