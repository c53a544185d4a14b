"""Every row of the ablation trains, does what it says, and leaves the trainer as it was."""

import numpy as np
import pytest
import torch

from benchmarks.ablate import base_words, sign
from benchmarks.ablations import ABLATIONS, FULL, Ablation
from core.conventions import FEATURE_CHANNELS
from core.mesh import quad_mesh
from core.presets import replace, settings_for
from core.reconstruct import reconstruct
from core.training import field_stage, pixels, surfacing, texel_stage, vertices, voxel_stage
from core.training.vertices import MovingVertices
from tests.unit.benchmarks.toy import HASTY, small_survey
from tests.unit.training.captures import ball, capture_of

MODULES = (quad_mesh, field_stage, pixels, surfacing, texel_stage, vertices, voxel_stage)
TOO_LARGE_HERE = ("K = 33",)  # half a minute for what K = 17 shows


@pytest.fixture(scope="module")
def capture():
    return capture_of(ball())


def named(words: str) -> Ablation:
    return next(one for one in ABLATIONS if words in one.name)


def trained(ablation: Ablation, capture):
    settings = replace(HASTY, **ablation.settings(HASTY))
    with small_survey(), ablation.within():
        return reconstruct(capture, settings, device="cpu").scene


@pytest.fixture(scope="module")
def full_scene(capture):
    return trained(named(FULL), capture)


def same(one, other) -> bool:
    pairs = zip(one.pages, other.pages, strict=False)
    return len(one.pages) == len(other.pages) and all(
        np.array_equal(a.features_u8, b.features_u8) and np.array_equal(a.positions, b.positions) for a, b in pairs
    )


@pytest.mark.parametrize(
    "ablation", [one for one in ABLATIONS[1:] if one.name not in TOO_LARGE_HERE], ids=lambda one: one.name
)
def test_a_row_trains_another_scene_and_restores_the_trainer(ablation, capture, full_scene):
    before = [dict(vars(module)) for module in MODULES]
    assert not same(trained(ablation, capture), full_scene)
    for module, names in zip(MODULES, before, strict=True):
        assert dict(vars(module)) == names


def test_without_view_dependence_the_network_does_not_look_at_the_direction(capture):
    weights = trained(named("no view dependence"), capture).network.weights[0]
    assert not weights[:, FEATURE_CHANNELS:].any()
    assert weights[:, :FEATURE_CHANNELS].any()


@pytest.mark.parametrize(("words", "in_the_middle"), [("fixed grid", True), ("placed by the survey", False)])
def test_vertices_that_are_not_trained_stay(capture, monkeypatch, words, in_the_middle):
    moved, middle, step = [], [], MovingVertices.step

    def watched(moving, *arguments):
        mesh = moving._mesh
        before = mesh.vertices.clone()
        step(moving, *arguments)
        moved.append(float((mesh.vertices - before).abs().max()))
        centres = torch.from_numpy(mesh.centres())
        middle.append(float((mesh.vertices[: len(centres)] - centres).abs().max()))

    monkeypatch.setattr(MovingVertices, "step", watched)
    trained(named(words), capture)
    assert max(moved) < 1e-6  # float32's rounding in clamping to the cell
    assert (max(middle) < 1e-6) is in_the_middle


def test_signs_are_compared_only_where_there_is_a_difference():
    assert sign(-1.0, -0.3) == "same"
    assert sign(0.4, -0.3) == "different"
    assert sign(0.01, -0.3) == "no difference"
    assert sign(None, -0.3) == sign(0.4, None) == ""


def test_every_row_is_compared_with_one_that_is_there():
    names = {one.name for one in ABLATIONS}
    assert len(names) == len(ABLATIONS)
    assert {one.against for one in ABLATIONS} <= names


def test_the_base_is_named_by_what_differs_from_its_preset():
    assert base_words(settings_for("draft")) == "draft"
    assert base_words(settings_for("draft", cells=48)) == "draft (cells 48)"
