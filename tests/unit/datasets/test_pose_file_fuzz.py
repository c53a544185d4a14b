"""Whatever a pose file says, the answer is a capture or an InputError."""

import contextlib
import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from core.datasets import check_capture, read_capture
from core.errors import InputError
from tests.unit.datasets.captures import nerfstudio, nerfstudio_fields, synthetic

scalars = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8), st.sampled_from([10**400, 1e308, -0.0])
)
anything = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=5), st.dictionaries(st.text(max_size=6), inner, max_size=5)),
    max_leaves=12,
)
keys = st.sampled_from(
    ["fl_x", "fl_y", "cx", "cy", "w", "h", "k1", "k2", "k3", "k4", "p1", "p2", "camera_angle_x", "camera_model",
     "is_fisheye", "frames", "test_filenames", "train_filenames", "val_filenames"]
)  # fmt: skip
frame_keys = st.sampled_from(["file_path", "transform_matrix", "fl_x", "k1", "w", "camera_model"])


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return {
        "transforms.json": nerfstudio(tmp_path_factory.mktemp("nerfstudio"), count=3),
        "transforms_train.json": synthetic(tmp_path_factory.mktemp("synthetic"), train=3, test=1),
    }


def attempt(folders, name, content):
    (folders[name] / name).write_text(json.dumps(content))
    with contextlib.suppress(InputError):
        check_capture(folders[name])
        read_capture(folders[name])


fuzz = settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@fuzz
@given(st.sampled_from(["transforms.json", "transforms_train.json"]), anything)
def test_arbitrary_json(folders, name, content):
    attempt(folders, name, content)


@fuzz
@given(st.dictionaries(keys, anything, max_size=3))
def test_arbitrary_top_level_fields(folders, changes):
    attempt(folders, "transforms.json", {**nerfstudio_fields(3), **changes})


@fuzz
@given(st.dictionaries(keys.filter(lambda key: key != "frames"), st.floats(-2, 2), max_size=4))
def test_arbitrary_numbers(folders, changes):
    attempt(folders, "transforms.json", {**nerfstudio_fields(3), **changes})


@fuzz
@given(st.dictionaries(frame_keys, anything, max_size=2), st.integers(0, 2))
def test_arbitrary_frames(folders, changes, index):
    fields = nerfstudio_fields(3)
    fields["frames"][index].update(changes)
    attempt(folders, "transforms.json", fields)


@fuzz
@given(st.text(max_size=30))
def test_arbitrary_file_paths(folders, file_path):
    fields = nerfstudio_fields(3)
    fields["frames"][1]["file_path"] = file_path
    attempt(folders, "transforms.json", fields)
