"""What Khronos' glTF validator says of a file."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).with_name("validate_gltf.mjs")
NODE_MODULES = Path(__file__).parents[2] / "viewer_static" / "node_modules"
MOST_S = 300  # it decodes every image, and counts every vertex
ERROR, WARNING = 0, 1
# Hints: the validator does not know the extension, nor that it uses the feature textures.
EXPECTED_HINTS = {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"}


def validated(glb: bytes, folder: Path) -> dict[str, Any]:
    """The validator's report on a .glb."""
    (folder / "scene.glb").write_bytes(glb)
    return validated_file(folder / "scene.glb")


def validated_file(path: Path) -> dict[str, Any]:
    """The validator's report on a .glb, or a .gltf with its files beside it."""
    node = shutil.which("node", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    assert node, "Node is missing, both on the PATH and beside Python"
    assert (NODE_MODULES / "gltf-validator").is_dir(), "gltf-validator is missing: run `npm ci` in viewer_static"
    run = subprocess.run([node, SCRIPT, NODE_MODULES, path], capture_output=True, text=True, timeout=MOST_S, check=True)
    return json.loads(run.stdout)


def messages_of(report: dict[str, Any], severity: int) -> list[str]:
    """Code and text of what a report says, of one severity."""
    found = [message for message in report["issues"]["messages"] if message["severity"] == severity]
    return [f"{message['code']}: {message['message']}" for message in found]


def assert_clean(report: dict[str, Any]) -> None:
    issues = report["issues"]
    serious = [*messages_of(report, ERROR), *messages_of(report, WARNING)]
    assert (issues["numErrors"], issues["numWarnings"], serious) == (0, 0, [])
    assert {message["code"] for message in issues["messages"]} <= EXPECTED_HINTS
