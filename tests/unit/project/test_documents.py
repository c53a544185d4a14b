"""What the documents say of the project is so."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
DOCUMENTS = ("README.md", "ARCHITECTURE.md", "CHANGELOG.md", "benchmarks/README.md")
LINK = re.compile(r"\]\((?!https?:)([^)#\s]+)")
MAKE_TARGET = re.compile(r"`?\bmake ([a-z-]+)[` ]")


def requirements() -> set[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    stated = [*project["dependencies"], *project["optional-dependencies"]["dev"]]
    return {re.split(r"[^A-Za-z0-9-]", text)[0] for text in stated}


@pytest.mark.parametrize("name", DOCUMENTS)
def test_links_lead_to_files_of_the_project(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    missing = [link for link in LINK.findall(text) if not (ROOT / name).parent.joinpath(link).exists()]
    assert missing == []


def test_make_targets_that_the_readme_names_exist() -> None:
    named = set(MAKE_TARGET.findall((ROOT / "README.md").read_text(encoding="utf-8")))
    makefile = (ROOT / "Makefile").read_text()
    assert {"setup", "demo", "test"} <= named
    assert [target for target in named if f"\n{target}:" not in makefile] == []


def test_every_dependency_is_pinned_and_explained() -> None:
    pinned = {line.partition("==")[0] for line in (ROOT / "constraints.txt").read_text().splitlines()}
    explained = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    assert requirements() - pinned == set()
    assert [name for name in requirements() if f"`{name}`" not in explained] == []


def test_pins_name_versions_only() -> None:
    """No index, no address, no build of a version: those differ from machine to machine."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert [line for line in pins if not re.fullmatch(r"[a-z0-9.-]+==[0-9][0-9a-z.]*", line)] == []
