"""Settings of a reconstruction, and the presets people choose from."""

from dataclasses import dataclass, fields, replace

from core.errors import OptionInvalid, UnknownPreset


@dataclass(frozen=True)
class Settings:
    """What may be traded: see benchmarks for each knob's price."""

    preset: str = "balanced"
