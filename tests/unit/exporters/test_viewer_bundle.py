"""A bundle has all that it needs and nothing else."""

import io
import re
import zipfile
from pathlib import Path

import pytest

from core.errors import ViewerMissing
from exporters.viewer import write_viewer_bundle, write_viewer_html, write_viewer_zip
from exporters.viewer.bundle import VIEWER
from exporters.viewer.modules import modules_from, resolved, with_paths_as_names

GLB = b"glTF and so on"
MAP = {"three": "vendor/three/build/three.module.js", "three/addons/": "vendor/three/examples/jsm/"}
installed = pytest.mark.skipif(not (VIEWER / "node_modules" / "three").is_dir(), reason="three.js is not installed")


@installed
def test_bundle_has_page_scene_modules_styles_and_licence() -> None:
    files = write_viewer_bundle(GLB)
    assert files["scene.glb"] == GLB
    assert {"index.html", "js/viewer-page.js", "js/stage.js", "css/viewer.css", "favicon.svg"} <= set(files)
    assert {"vendor/three/build/three.core.js", "vendor/three/examples/jsm/libs/meshopt_decoder.module.js"} <= set(
        files
    )
    assert b"MIT License" in files["vendor/three/LICENSE"]


@installed
def test_bundle_leaves_the_service_s_pages_out() -> None:
    assert not {"js/upload-form.js", "js/job-list.js", "viewer.html", "package.json"} & set(write_viewer_bundle(GLB))


@installed
def test_page_refers_to_nothing_else() -> None:
    files = write_viewer_bundle(GLB)
    named = re.findall(r'(?:src|href|content)="\./([^"]+)"', files["index.html"].decode())
    assert named
    assert set(named) <= set(files)


@installed
def test_single_file_contains_scene_and_licence_and_no_addresses() -> None:
    text = write_viewer_html(GLB, title="<script>")["viewer.html"].decode()
    assert "Permission is hereby granted" in text
    assert "&lt;script&gt;" in text
    outside = [url for url in re.findall(r'(?:src|href)="([^"]*)"', text) if not url.startswith(("data:", "#"))]
    assert outside == []


@installed
def test_archive_is_the_folder_and_always_the_same() -> None:
    (data,) = write_viewer_zip(GLB).values()
    archive = zipfile.ZipFile(io.BytesIO(data))
    assert {name: archive.read(name) for name in archive.namelist()} == write_viewer_bundle(GLB)
    assert write_viewer_zip(GLB)["viewer.zip"] == data


def test_missing_viewer_is_said(tmp_path: Path) -> None:
    with pytest.raises(ViewerMissing, match="make setup"):
        write_viewer_bundle(GLB, viewer=tmp_path)


def test_imports_of_every_kind_are_followed() -> None:
    texts = {
        "js/a.js": 'import {x} from "./b.js";\nimport("./c.js");\nexport * from "three";\nimport "three/addons/d.js";',
        "js/b.js": '/* from "./not.js" */\n// import "./nor.js"\nexport const x = 1;',
        "js/c.js": 'import{y}from"../lib/e.js"',
        "lib/e.js": "export const y = 'from here';",
        "vendor/three/build/three.module.js": "import { z } from './three.core.js';",
        "vendor/three/build/three.core.js": "",
        "vendor/three/examples/jsm/d.js": "",
    }
    assert set(modules_from("js/a.js", MAP, texts.__getitem__)) == set(texts)


def test_imports_are_rewritten_to_paths() -> None:
    text = 'import { a } from "../b.js"; import("three"); const s = "./b.js";'
    rewritten = with_paths_as_names("js/deep/a.js", text, MAP)
    assert rewritten == f'import {{ a }} from "js/b.js"; import("{MAP["three"]}"); const s = "./b.js";'


def test_unknown_name_is_refused() -> None:
    with pytest.raises(KeyError):
        resolved("lodash", "js/a.js", MAP)
