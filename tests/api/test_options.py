"""Options, from words to settings."""

import json

import pytest

from core.errors import OptionInvalid, UnknownPreset
from service.errors import UnknownFormat
from service.options import Options


def test_nothing_said_means_the_defaults() -> None:
    assert Options.from_text({}) == Options() == Options.from_text({"seed": "", "preset": ""})


def test_words_become_values() -> None:
    words = {"preset": "draft", "seed": "7", "downscale": "2", "max_size_px": "400", "background": "#ff0080"}
    options = Options.from_text(words, ["cells=32"])
    assert (options.preset, options.seed, options.downscale, options.max_size_px) == ("draft", 7, 2, 400)
    assert options.background == pytest.approx((1.0, 0.0, 128 / 255))
    assert options.overrides == {"cells": "32"}
    assert (options.scene_kind, options.skip_missing) == ("auto", False)
    chosen = Options.from_text({"scene_kind": "forward", "skip_missing": "true"})
    assert (chosen.scene_kind, chosen.skip_missing) == ("forward", True)
    assert Options.from_text({}).formats == ("glb",)
    assert Options.from_text({"formats": "usd, web"}).formats == ("glb", "web", "usd")


def test_options_survive_json() -> None:
    options = Options.from_text(
        {"preset": "draft", "background": "black", "scene_kind": "object", "skip_missing": "1", "formats": "all"},
        ["cells=32"],
    )
    assert Options.from_json(json.loads(json.dumps(options.as_json()))) == options


@pytest.mark.parametrize(
    "words",
    [
        {"seed": "-1"},
        {"seed": "1.5"},
        {"downscale": "0"},
        {"downscale": "99"},
        {"max_size_px": "1"},
        {"device": "toaster"},
        {"background": "pink"},
        {"background": "#12345"},
        {"scene_kind": "indoors"},
        {"skip_missing": "perhaps"},
    ],
)
def test_bad_word_is_refused(words: dict[str, str]) -> None:
    with pytest.raises(OptionInvalid):
        Options.from_text(words)


@pytest.mark.parametrize("formats", ["fbx", "web,fbx", ",", "All"])
def test_unknown_format_is_refused(formats: str) -> None:
    with pytest.raises(UnknownFormat):
        Options.from_text({"formats": formats})


def test_unknown_preset_is_refused() -> None:
    with pytest.raises(UnknownPreset):
        Options.from_text({"preset": "best"})


@pytest.mark.parametrize("assignment", ["cells", "=3", "no such=1", "colour=1", "preset=high"])
def test_bad_assignment_is_refused(assignment: str) -> None:
    with pytest.raises(OptionInvalid):
        Options.from_text({}, [assignment])
