"""Settings: what may be chosen, and what is refused."""

import math
from dataclasses import asdict, fields, replace

import pytest

from core.errors import OptionInvalid, UnknownPreset
from core.presets import LIMITS, PRESETS, Settings, settings_for

KNOBS = [field.name for field in fields(Settings) if field.name != "preset"]


@pytest.mark.parametrize("preset", PRESETS)
def test_a_preset_is_what_it_says(preset):
    assert settings_for(preset) == PRESETS[preset]
    assert settings_for(preset).preset == preset


def test_every_knob_has_limits():
    assert set(LIMITS) == set(KNOBS)


@pytest.mark.parametrize("preset", ["", "Draft", "drafty", "best"])
def test_an_unknown_preset_is_refused_with_the_known_ones(preset):
    with pytest.raises(UnknownPreset) as error:
        settings_for(preset)
    assert all(name in str(error.value) for name in PRESETS)


def test_an_unknown_option_is_refused_with_the_known_ones():
    with pytest.raises(OptionInvalid) as error:
        settings_for("draft", cell=3)
    assert "option cell" in str(error.value)
    assert all(name in str(error.value) for name in KNOBS)


@pytest.mark.parametrize("name", KNOBS)
@pytest.mark.parametrize(
    "value", ["nan", "inf", "-inf", math.nan, math.inf, -1, "1e300", 10**400, "", "many", None, "0x10"]
)
def test_what_is_no_number_in_range_is_refused(name, value):
    with pytest.raises(OptionInvalid, match=f"option {name}"):
        settings_for("draft", **{name: value})


@pytest.mark.parametrize("name", KNOBS)
def test_limits_are_inclusive_and_hold(name):
    low, high = LIMITS[name]
    for value in (low, high):
        assert getattr(settings_for("draft", **{name: value}), name) == value
    for value in (low - 1, high + 1):
        with pytest.raises(OptionInvalid):
            settings_for("draft", **{name: value})


@pytest.mark.parametrize("name", [name for name in KNOBS if isinstance(getattr(PRESETS["draft"], name), int)])
@pytest.mark.parametrize("value", ["64.5", 64.5, "6e1", True])
def test_counts_are_whole_numbers(name, value):
    with pytest.raises(OptionInvalid, match="must be a number"):
        settings_for("draft", **{name: value})


def test_numbers_may_be_text():
    settings = settings_for("draft", cells="80", distortion="0.5")
    assert (settings.cells, settings.distortion) == (80, 0.5)


def test_other_knobs_stay_as_the_preset_has_them():
    settings = settings_for("balanced", cells=80)
    assert replace(settings, cells=PRESETS["balanced"].cells) == PRESETS["balanced"]


def test_settings_made_by_hand_are_checked_too():
    with pytest.raises(OptionInvalid, match="option distortion"):
        Settings(**{**asdict(PRESETS["draft"]), "distortion": math.nan})
