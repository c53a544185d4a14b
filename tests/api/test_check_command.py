"""`polyfield check`: a line for each fault, and the exit status."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from core.baked import BakedScene
from exporters.gltf import write_gltf, write_lq_glb, write_web_glb
from service.cli import main
from tests.unit.exporters import test_check, test_check_compressed
from tests.unit.exporters.test_check import GOOD


@pytest.fixture(autouse=True)
def no_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Starting a driver takes longer than all else, and is tested elsewhere."""
    monkeypatch.setattr("exporters.check.compiler.gl_compiler", lambda: None)
    monkeypatch.setattr("exporters.check.compiler._Process.start", lambda self: False)


@pytest.fixture
def good(tmp_path: Path) -> Path:
    path = tmp_path / "scene.glb"
    path.write_bytes(GOOD)
    return path


def test_good_file_has_no_faults(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(good)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "no faults"
    assert [line for line in lines if not line.startswith("note [")] == ["no faults"]


@pytest.mark.parametrize("write", [write_web_glb, write_lq_glb])
def test_other_variants_are_checked(
    scene: BakedScene,
    tmp_path: Path,
    write: Callable[[BakedScene], dict[str, bytes]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    ((name, data),) = write(test_check.gentle(scene)).items()
    (tmp_path / name).write_bytes(data)
    assert main(["check", str(tmp_path / name)]) == 0, capsys.readouterr().out


ALL_FAULTS = {**test_check.FAULTS, **{f"web, {name}": fault for name, fault in test_check_compressed.FAULTS.items()}}


@pytest.mark.parametrize("name", ALL_FAULTS)
def test_fault_is_a_line_and_status_1(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    damage, code, words = ALL_FAULTS[name]
    path = tmp_path / "damaged.glb"
    path.write_bytes(damage(test_check_compressed.GOOD if name.startswith("web, ") else GOOD))
    assert main(["check", str(path)]) == 1
    printed = capsys.readouterr()
    lines = printed.out.splitlines()
    assert any(f"[{code}]" in line and words in line for line in lines)
    assert lines[-1].split()[1] in ("fault", "faults")
    assert printed.err == ""


def test_json_has_the_same_findings(good: Path, capsys: pytest.CaptureFixture[str]) -> None:
    damage, code, words = test_check.FAULTS["bounds wrong"]
    good.write_bytes(damage(GOOD))
    assert main(["check", "--json", str(good)]) == 1
    found = json.loads(capsys.readouterr().out)
    assert (found["file"], found["faults"]) == (str(good), 1)
    (finding,) = (finding for finding in found["findings"] if finding["severity"] != "note")
    assert finding["code"] == code
    assert words in finding["message"]
    assert set(finding) == {"severity", "code", "subject", "message"}


def test_gltf_is_checked_with_the_files_it_names(
    scene: BakedScene, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, data in write_gltf(test_check.trained_like(scene)).items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "another.bin").write_bytes(b"not named")
    assert main(["check", str(tmp_path / "scene.gltf")]) == 0
    (tmp_path / "page0.color.png").unlink()
    assert main(["check", str(tmp_path / "scene.gltf")]) == 1
    assert "page0.color.png" in capsys.readouterr().out


def test_gltf_does_not_reach_outside_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "secret.bin").write_bytes(b"secret")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "link.bin").symlink_to(tmp_path / "secret.bin")
    for uri in ("../secret.bin", str(tmp_path / "secret.bin"), "link.bin", "%2e%2e/secret.bin", "a\u0000b"):
        document = {"asset": {"version": "2.0"}, "buffers": [{"uri": uri, "byteLength": 6}]}
        (inside / "scene.gltf").write_text(json.dumps(document))
        assert main(["check", str(inside / "scene.gltf")]) == 1
        assert "among the files" in capsys.readouterr().out


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b"\xff\xfe", b"[" * 100_000])
def test_damaged_gltf_is_named(content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.gltf").write_bytes(content)
    assert main(["check", str(tmp_path / "scene.gltf")]) == 1
    assert "error [container] glTF JSON" in capsys.readouterr().out


def test_glb_by_another_name_is_known_by_its_first_bytes(good: Path) -> None:
    assert main(["check", str(good.rename(good.with_suffix(".bin")))]) == 0


def test_what_is_no_file_or_of_another_format_is_status_2(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.usdz").write_bytes(b"PK\x03\x04")
    for path in (tmp_path / "nothing.glb", tmp_path, tmp_path / "scene.usdz", good / "below.glb", "/dev/null"):
        assert main(["check", str(path)]) == 2
        printed = capsys.readouterr()
        assert printed.out == ""
        assert "error [asset-invalid]: " in printed.err
        assert "Traceback" not in printed.err


def test_file_longer_than_a_glb_can_be_is_refused_unread(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with (tmp_path / "long.glb").open("wb") as file:
        file.truncate(2**32)  # takes no disk
    assert main(["check", str(tmp_path / "long.glb")]) == 2
    assert "at most 4294967295 bytes" in capsys.readouterr().err
