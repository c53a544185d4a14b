"""OpenUSD's validators find no error in what is written; schemas and their source agree."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from core.baked import BakedScene
from exporters.usd import schema, write_usd
from exporters.usd.quicklook import write_quicklook
from exporters.usd.writer import Form
from tests.conformance.usd_validation import errors_of, resolves_everything

FORMS: tuple[Form, ...] = ("usdc", "usda", "usdz")
SCHEMA = Path(__file__).parents[2] / "docs" / "usd" / "polyfield"


@pytest.mark.parametrize("form", FORMS)
def test_validators_find_nothing(scene: BakedScene, tmp_path: Path, form: Form) -> None:
    assert errors_of(write_usd(scene, form), tmp_path) == []
    assert resolves_everything(tmp_path / f"scene.{form}")


def test_validators_find_nothing_in_the_quick_look_package(scene: BakedScene, tmp_path: Path) -> None:
    assert errors_of(write_quicklook(scene), tmp_path, suppress=False) == []
    assert resolves_everything(tmp_path / "scene.quicklook.usdz")


@pytest.mark.parametrize(
    ("right", "wrong", "says"),
    [
        ("ND_max_vector4FA", "ND_max_vector5", "MissingShaderIdInRegistry"),
        ('upAxis = "Y"', "", "MissingUpAxisMetadata"),
        ("./page1.color.png", "./page7.color.png", "UnresolvableDependency"),
        ('"MaterialBindingAPI"', '"GeomModelAPI"', "MissingMaterialBindingAPI"),
    ],
)
def test_validators_find_a_fault(scene: BakedScene, tmp_path: Path, right: str, wrong: str, says: str) -> None:
    files = write_usd(scene, "usda")
    text = files["scene.usda"].decode()
    assert right in text
    found = errors_of({**files, "scene.usda": text.replace(right, wrong).encode()}, tmp_path)
    assert found
    assert all(says in error for error in found), found


def test_schema_is_what_usdgenschema_makes_of_its_source(tmp_path: Path) -> None:
    for name in ("schema.usda", "plugInfo.json"):  # of the latter it renews the types
        shutil.copy(SCHEMA / name, tmp_path)
    command = [sys.executable, "-m", "pxr.Usd.usdGenSchema", "schema.usda", "."]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=60)
    for name in ("generatedSchema.usda", "plugInfo.json"):
        generated = (tmp_path / name).read_text(encoding="utf-8").splitlines()
        assert [line.rstrip() for line in generated] == (SCHEMA / name).read_text(encoding="utf-8").splitlines()


PROGRAM = """
import sys
from pxr import Plug, Usd, UsdValidation

Plug.Registry().RegisterPlugins(sys.argv[1])  # before the first stage is opened
stage = Usd.Stage.Open(sys.argv[2])
for path, name in (("", "Scene"), ("/materials/page0", "Network"), ("/view0", "View")):
    prim = stage.GetPrimAtPath("/scene" + path)
    schema = f"Polyfield{name}API"
    assert prim.HasAPI(schema), schema
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(schema)
    for name in definition.GetPropertyNames():
        prop = prim.GetProperty(name)
        assert prop.IsAuthored(), name
        if isinstance(prop, Usd.Attribute):
            assert prop.GetTypeName() == definition.GetAttributeDefinition(name).GetTypeName(), name
    extra = [p.GetName() for p in prim.GetAuthoredPropertiesInNamespace("polyfield")]
    assert set(extra) == set(definition.GetPropertyNames()), extra
"""


def test_asset_follows_the_schema_where_it_is_installed(scene: BakedScene, tmp_path: Path) -> None:
    """In a process of its own: schemas are registered once and for all."""
    (tmp_path / "scene.usdc").write_bytes(write_usd(replace(scene, start_camera=1))["scene.usdc"])
    command = [sys.executable, "-c", PROGRAM, str(SCHEMA), str(tmp_path / "scene.usdc")]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr


def test_readme_names_every_property() -> None:
    readme = (SCHEMA.parent / "README.md").read_text(encoding="utf-8")
    names = [value for value in vars(schema).values() if isinstance(value, str) and value.startswith("polyfield:")]
    assert len(names) == 10
    assert all(name.rpartition(":")[2] in readme for name in (*names, *schema.WEIGHTS, *schema.BIASES))
