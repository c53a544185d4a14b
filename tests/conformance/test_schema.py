"""The JSON that is written follows the extension's own schema."""

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator, ValidationError
from referencing import Registry, Resource

from core.baked import BakedScene
from exporters.gltf import write_glb
from exporters.gltf.extension import NAME

SCHEMAS = Path(__file__).parents[2] / "docs" / "extensions" / NAME / "schema"
# Of Khronos' own schemas, what ours refer to, reduced to what matters here.
KHRONOS = {
    "glTFProperty.schema.json": {
        "type": "object",
        "properties": {"extensions": {"type": "object"}, "extras": {}},
    },
    "glTFid.schema.json": {"type": "integer", "minimum": 0},
    "textureInfo.schema.json": {
        "type": "object",
        "properties": {"index": {"$ref": "glTFid.schema.json"}, "texCoord": {"type": "integer", "minimum": 0}},
        "required": ["index"],
    },
}


def own_schemas() -> dict[str, Any]:
    return {path.name: json.loads(path.read_text(encoding="utf-8")) for path in SCHEMAS.glob("*.schema.json")}


def check(name: str, instance: Any) -> None:
    documents = own_schemas() | {
        name: {"$schema": "https://json-schema.org/draft/2020-12/schema"} | schema for name, schema in KHRONOS.items()
    }
    registry = Registry().with_resources((key, Resource.from_contents(schema)) for key, schema in documents.items())
    Draft202012Validator(documents[name], registry=registry).validate(instance)


@pytest.fixture
def document(scene: BakedScene) -> dict[str, Any]:
    glb = write_glb(replace(scene, user_from_object=np.diag([2.0, 2.0, 2.0, 1.0]), start_camera=1))["scene.glb"]
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length])


@pytest.mark.parametrize("name", sorted(own_schemas()))
def test_schema_is_itself_valid(name: str) -> None:
    Draft202012Validator.check_schema(own_schemas()[name])


def test_root_extension_follows_its_schema(document: dict[str, Any]) -> None:
    check(f"glTF.{NAME}.schema.json", document["extensions"][NAME])


def test_every_optional_property_is_written_where_it_says_something(document: dict[str, Any]) -> None:
    properties = own_schemas()[f"glTF.{NAME}.schema.json"]["properties"]
    assert set(document["extensions"][NAME]) == set(properties) - {"extensions", "extras"}


def test_every_primitive_follows_its_schema(document: dict[str, Any]) -> None:
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            check(f"mesh.primitive.{NAME}.schema.json", primitive["extensions"][NAME])


def test_schema_refuses_a_network_of_another_shape(document: dict[str, Any]) -> None:
    root = document["extensions"][NAME]
    root["networks"][0]["layers"][0]["weights"].pop()
    with pytest.raises(ValidationError):
        check(f"glTF.{NAME}.schema.json", root)


def test_readme_example_names_the_properties_that_are_written(document: dict[str, Any]) -> None:
    readme = (SCHEMAS.parent / "README.md").read_text(encoding="utf-8")
    example = json.loads(readme.split("```json")[1].split("```")[0])
    assert set(example["extensionsUsed"]) == set(document["extensionsUsed"])
    shown, written = (json_file["meshes"][0]["primitives"][0] for json_file in (example, document))
    assert set(shown) <= set(written)
    assert shown["extensions"][NAME] == written["extensions"][NAME]
    assert set(example["extensions"][NAME]) <= set(document["extensions"][NAME])
