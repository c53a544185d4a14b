"""Checkpoints on disk."""

import contextlib
import io

import numpy as np
import pytest
import torch

from core import checkpoint as module
from core.checkpoint import FILE_NAME, CheckpointFile
from core.errors import CheckpointInvalid

IDENTITY = {"settings": {"cells": 8, "distortion": 0.01}, "seed": 3, "capture": "abc"}
STATE = {"done": 5, "rows": {"scalar": torch.arange(50.0)}, "seconds": {"voxels": 1.5}}


def written(folder, state=None) -> CheckpointFile:
    file = CheckpointFile(folder, IDENTITY)
    file.write("field", STATE if state is None else state)
    return file


def test_what_was_written_is_read_back(tmp_path):
    written(tmp_path / "new" / "folder")
    stage, state = CheckpointFile(tmp_path / "new" / "folder", IDENTITY).read()
    assert stage == "field"
    assert state["done"] == 5
    assert state["seconds"] == {"voxels": 1.5}
    assert torch.equal(state["rows"]["scalar"], STATE["rows"]["scalar"])


def test_without_a_folder_nothing_is_kept():
    file = CheckpointFile(None, IDENTITY)
    file.write("field", STATE)
    assert file.read() is None
    assert not file.due()
    file.remove()


def test_no_checkpoint_is_read_where_there_is_none(tmp_path):
    assert CheckpointFile(tmp_path, IDENTITY).read() is None


@pytest.mark.parametrize("other", [{"seed": 4}, {"capture": "abd"}, {"settings": {"cells": 9, "distortion": 0.01}}])
def test_another_runs_checkpoint_is_ignored(tmp_path, other):
    written(tmp_path)
    assert CheckpointFile(tmp_path, {**IDENTITY, **other}).read() is None


def test_the_last_checkpoint_replaces_the_ones_before(tmp_path):
    written(tmp_path).write("texels", {"done": 9})
    assert CheckpointFile(tmp_path, IDENTITY).read() == ("texels", {"done": 9})
    assert [path.name for path in tmp_path.iterdir()] == [FILE_NAME]


def dies_after_some_bytes(content, file):
    file.write(b"PK half a checkpoint")
    raise OSError("no space left on device")


def test_a_crash_while_writing_leaves_the_old_checkpoint(tmp_path, monkeypatch):
    file = written(tmp_path)
    monkeypatch.setattr(torch, "save", dies_after_some_bytes)
    with pytest.raises(OSError, match="no space"):
        file.write("texels", {"done": 9})
    stage, state = CheckpointFile(tmp_path, IDENTITY).read()
    assert (stage, state["done"]) == ("field", 5)


def test_a_crash_before_the_first_checkpoint_leaves_none(tmp_path, monkeypatch):
    monkeypatch.setattr(torch, "save", dies_after_some_bytes)
    with pytest.raises(OSError, match="no space"):
        written(tmp_path)
    assert CheckpointFile(tmp_path, IDENTITY).read() is None


def test_half_a_file_of_a_crash_does_not_disturb_the_next_writing(tmp_path):
    (tmp_path / FILE_NAME).with_suffix(".part").write_bytes(b"x" * 10_000)
    written(tmp_path)
    assert CheckpointFile(tmp_path, IDENTITY).read()[0] == "field"


def saved(content) -> bytes:
    buffer = io.BytesIO()
    torch.save(content, buffer)
    return buffer.getvalue()


class NotAllowed:
    """Reading it would run code of the file's choice."""

    def __reduce__(self):
        return print, ("run by a checkpoint",)


DAMAGED = {
    "empty": b"",
    "text": b"not a checkpoint\n",
    "zeros": bytes(1000),
    "zip magic only": b"PK\x03\x04" + bytes(40),
    "a list": saved([1, 2, 3]),
    "a tensor": saved(torch.zeros(3)),
    "without identity": saved({"stage": "field", "state": {}}),
    "without state": saved({"identity": IDENTITY, "stage": "field"}),
    "code": saved({"identity": NotAllowed(), "stage": "field", "state": {}}),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_file_is_refused(tmp_path, name, capsys):
    (tmp_path / FILE_NAME).write_bytes(DAMAGED[name])
    with pytest.raises(CheckpointInvalid, match="Delete it"):
        CheckpointFile(tmp_path, IDENTITY).read()
    assert "run by" not in capsys.readouterr().out


def test_a_truncated_file_is_refused(tmp_path):
    written(tmp_path)
    content = (tmp_path / FILE_NAME).read_bytes()
    for length in np.linspace(1, len(content) - 1, 25).astype(int):
        (tmp_path / FILE_NAME).write_bytes(content[:length])
        with pytest.raises(CheckpointInvalid):
            CheckpointFile(tmp_path, IDENTITY).read()


def test_changed_bytes_raise_no_other_error(tmp_path, rng):
    written(tmp_path)
    content = np.frombuffer((tmp_path / FILE_NAME).read_bytes(), np.uint8)
    for _ in range(150):
        changed = content.copy()
        changed[rng.integers(0, len(content), 3)] = rng.integers(0, 256, 3)
        (tmp_path / FILE_NAME).write_bytes(changed.tobytes())
        with contextlib.suppress(CheckpointInvalid):  # or the change was in padding, or made it another run's
            CheckpointFile(tmp_path, IDENTITY).read()


def test_writing_waits_for_its_interval_and_for_its_share_of_the_time(tmp_path, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    file = CheckpointFile(tmp_path, IDENTITY)
    assert not file.due()
    now[0] += module.INTERVAL_S
    assert file.due()

    def slow_save(content, handle):
        now[0] += 2.0

    monkeypatch.setattr(torch, "save", slow_save)
    file.write("field", STATE)
    now[0] += module.INTERVAL_S
    assert not file.due()
    now[0] += 2.0 / module.WRITING_SHARE
    assert file.due()


def test_removing_leaves_nothing_and_may_be_repeated(tmp_path):
    file = written(tmp_path)
    file.remove()
    file.remove()
    assert list(tmp_path.iterdir()) == []
