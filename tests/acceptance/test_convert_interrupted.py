"""Ctrl-C during `polyfield convert`."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from core.sample import write_sample_capture
from tests.api.running import wait_until

pytestmark = pytest.mark.slow


def test_ctrl_c_exits_130_without_traceback_and_keeps_the_checkpoint(tmp_path: Path) -> None:
    write_sample_capture(tmp_path / "capture", size_px=80, train_views=16, test_views=2)
    command = [sys.executable, "-m", "service.cli", "convert", str(tmp_path / "capture"), "-o", str(tmp_path / "out")]
    process = subprocess.Popen([*command, "--preset", "draft"], stderr=subprocess.PIPE, text=True)
    checkpoint = tmp_path / "out" / ".checkpoint" / "training.pt"
    wait_until(lambda: checkpoint.exists() or process.poll() is not None, 200)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert errors.strip().endswith("stopped")
    assert checkpoint.exists()
