"""Who may import whom: service -> exporters, core; exporters -> a few modules of core; core -> neither."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXPORTERS_MAY_USE = {"core.baked", "core.camera", "core.conventions", "core.errors"}
TRAINING = {"torch", "warp"}
GLTF = {"pygltflib", "trimesh"}
USD = {"pxr"}
HTTP = {"fastapi", "starlette", "uvicorn", "httpx", "http", "dbos", "sse_starlette"}


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def imported(path: Path) -> Iterator[str]:
    """Full names of what a file imports, wherever in the file: `import a.b` and `from a.b import c` give a.b."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.relative_to(ROOT)}:{node.lineno}: relative imports hide the rules"
            yield from _modules(node)


def _modules(node: ast.ImportFrom) -> Iterator[str]:
    """The modules of `from a import b`: a.b where that is a module of ours, a otherwise."""
    assert node.module
    for alias in node.names:
        inner = ROOT.joinpath(*node.module.split("."), alias.name)
        is_module = inner.with_suffix(".py").is_file() or inner.is_dir()
        yield f"{node.module}.{alias.name}" if is_module else node.module


def top(module: str) -> str:
    return module.split(".")[0]


def offences(package: str, forbidden: set[str]) -> list[str]:
    return [
        f"{path.relative_to(ROOT)} imports {module}"
        for path in sources(package)
        for module in imported(path)
        if top(module) in forbidden
    ]


def test_core_knows_no_gltf_no_usd_no_http_and_no_other_package() -> None:
    assert sources("core")
    assert offences("core", GLTF | USD | HTTP | {"exporters", "service", "tests", "benchmarks"}) == []


def test_exporters_use_only_the_baked_scene_of_core() -> None:
    assert sources("exporters")
    used = {module for path in sources("exporters") for module in imported(path) if top(module) == "core"}
    assert used <= EXPORTERS_MAY_USE


def test_exporters_know_no_training_no_http_and_no_service() -> None:
    assert offences("exporters", TRAINING | HTTP | {"service", "tests", "benchmarks"}) == []


def test_what_exporters_use_of_core_needs_numpy_only() -> None:
    allowed = {"numpy", "core", "collections", "dataclasses", "typing", "math", "functools", "enum"}
    for module in EXPORTERS_MAY_USE:
        path = ROOT.joinpath(*module.split(".")).with_suffix(".py")
        names = set(imported(path))
        assert {top(name) for name in names} <= allowed
        assert {name for name in names if top(name) == "core"} <= EXPORTERS_MAY_USE


def test_service_depends_on_nothing_but_core_and_exporters_of_ours() -> None:
    assert offences("service", {"tests", "benchmarks", "viewer_static"}) == []


@pytest.mark.parametrize("package", ["core", "exporters"])
def test_package_itself_imports_nothing(package: str) -> None:
    """So that one module of it can be used alone."""
    assert list(imported(ROOT / package / "__init__.py")) == []
