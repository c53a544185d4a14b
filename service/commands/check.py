"""`polyfield check`: what is wrong with an asset.

Exit status: 0 nothing; 1 something, a line each; 2 there is no such file, or it is of another format.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from service.asset_source import glb_bytes, gltf_files, is_gltf

if TYPE_CHECKING:
    from exporters.check import Finding


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    parser = subparsers.add_parser("check", help="say what is wrong with a .glb or .gltf")
    parser.add_argument(
        "file", type=Path, metavar="FILE", help=".glb of any variant, or .gltf with its files beside it"
    )
    parser.add_argument("--json", action="store_true", help="for machines: one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Errors and warnings are faults; a note says what was not checked."""
    findings = _findings(arguments.file)
    faults = [finding for finding in findings if finding.severity != "note"]
    if arguments.json:
        print(json.dumps({"file": str(arguments.file), "faults": len(faults), "findings": [*map(asdict, findings)]}))
    else:
        _print(findings)
        print(f"{len(faults)} fault{'s' if len(faults) > 1 else ''}" if faults else "no faults")
    return 1 if faults else 0


def _findings(path: Path) -> "Sequence[Finding]":
    several = is_gltf(path)
    from exporters.check import check_glb, check_gltf, isolated_compiler  # late, because it loads NumPy

    with isolated_compiler() as compiler:
        return check_gltf(gltf_files(path), compiler) if several else check_glb(glb_bytes(path), compiler)


def _print(findings: "Sequence[Finding]") -> None:
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    for finding in findings:
        print(finding)
