"""What a person may choose for a conversion; the same words in the API's form and on the command line."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from core.capture import WHITE
from core.errors import OptionInvalid
from core.presets import settings_for
from core.scene_kind import AUTO, check_kind_name
from service.formats import DEFAULT, formats_of

DEVICE = re.compile(r"auto|cpu|cuda(:\d+)?")
MAX_DOWNSCALE = 16
SIZE_RANGE_PX = (16, 20_000)
MAX_SEED = 2**31 - 1
WHOLE_NUMBERS = ("seed", "downscale", "max_size_px")
TRUTHS = {"true": True, "1": True, "yes": True, "on": True, "false": False, "0": False, "no": False, "off": False}
NAMED_BACKGROUNDS = {"white": WHITE, "black": (0.0, 0.0, 0.0)}


@dataclass(frozen=True)
class Options:
    """The choices of one conversion, checked when built.

    Attributes:
        preset: draft, balanced or high.
        device: auto, cpu, cuda or cuda:N.
        seed: of everything random, 0 to 2^31 - 1.
        downscale: photos are reduced by this whole factor, 1 to 16.
        max_size_px: photos are reduced to this longest side at most, 16 to 20000; None for no bound.
        background: sRGB in [0, 1], behind the transparent pixels of photos.
        scene_kind: auto, object, forward or unbounded.
        skip_missing: leave out photos that the poses name but the capture lacks.
        formats: what to export to, names of service.formats.FORMATS; glb is always among them.
        overrides: settings that replace the preset's; numbers may be text.

    Raises:
        UnknownPreset, UnknownFormat, OptionInvalid
    """

    preset: str = "balanced"
    device: str = "auto"
    seed: int = 0
    downscale: int = 1
    max_size_px: int | None = None
    background: tuple[float, float, float] = WHITE
    scene_kind: str = AUTO
    skip_missing: bool = False
    formats: tuple[str, ...] = DEFAULT
    overrides: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if "preset" in self.overrides:
            raise OptionInvalid("setting preset", "must be given as the preset", repr(self.overrides["preset"]))
        settings_for(self.preset, **self.overrides)
        # Figures are measured on scene.glb, so it is always written.
        object.__setattr__(self, "formats", formats_of((*DEFAULT, *self.formats)))
        if not DEVICE.fullmatch(self.device):
            raise OptionInvalid("device", "must be auto, cpu, cuda or cuda:N", repr(self.device))
        check_kind_name(self.scene_kind, auto=True)
        _require_between("seed", self.seed, 0, MAX_SEED)
        _require_between("downscale", self.downscale, 1, MAX_DOWNSCALE)
        if self.max_size_px is not None:
            _require_between("max_size_px", self.max_size_px, *SIZE_RANGE_PX)

    @classmethod
    def from_text(cls, words: Mapping[str, str], assignments: Sequence[str] = ()) -> "Options":
        """Options from the words of a form or a command line; what is absent or empty keeps its default.

        Args:
            words: any of preset, device, seed, downscale, max_size_px, background ("white", "black", "#rrggbb"),
                scene_kind, skip_missing ("true", "false") and formats ("all", "web,lq").
            assignments: settings that replace the preset's, as "name=value".
        """
        chosen: dict[str, Any] = {name: words[name] for name in ("preset", "device", "scene_kind") if words.get(name)}
        chosen |= {name: _whole(name, words[name]) for name in WHOLE_NUMBERS if words.get(name)}
        if words.get("background"):
            chosen["background"] = _color(words["background"])
        if words.get("skip_missing"):
            chosen["skip_missing"] = _truth("skip_missing", words["skip_missing"])
        if words.get("formats"):
            chosen["formats"] = formats_of(words["formats"])
        return cls(**chosen, overrides=dict(_assignment(text) for text in assignments))

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Options":
        """The reverse of `as_json`."""
        return cls(**{**value, "background": tuple(value["background"])})

    def photos(self) -> dict[str, Any]:
        """How photos are read, as arguments of `read_capture`."""
        names = ("downscale", "max_size_px", "background", "skip_missing")
        return {name: getattr(self, name) for name in names} | {"kind": self.scene_kind}

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def photo_choices(words: Mapping[str, str]) -> dict[str, Any]:
    """How photos are read, of the words that are given and not empty.

    Raises:
        OptionInvalid
    """
    chosen = Options.from_text(words)
    return {name: getattr(chosen, name) for name, text in words.items() if text}


def _require_between(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise OptionInvalid(name, f"must lie between {low} and {high}", str(value))


def _whole(name: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise OptionInvalid(name, "must be a whole number", repr(text[:40])) from None


def _truth(name: str, text: str) -> bool:
    if text.lower() not in TRUTHS:
        raise OptionInvalid(name, "must be true or false", repr(text[:40]))
    return TRUTHS[text.lower()]


def _color(text: str) -> tuple[float, float, float]:
    if text in NAMED_BACKGROUNDS:
        return NAMED_BACKGROUNDS[text]
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise OptionInvalid("background", "must be white, black or #rrggbb", repr(text[:40]))
    red, green, blue = (int(text[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue


def _assignment(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier():
        raise OptionInvalid("setting", "must be written name=value", repr(text[:80]))
    return name, value
