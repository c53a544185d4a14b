"""The server stays small: what trains is loaded by trainers only."""

import subprocess
import sys


def test_server_and_command_line_load_neither_torch_nor_warp() -> None:
    code = "import service.app, service.cli, service.worker, sys; print({'torch', 'warp'} & set(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert loaded.strip() == "set()"
