"""The command line says what the API says, and exits accordingly."""

import json
from pathlib import Path

import numpy as np
import pytest

from service.cli import main
from tests.api.bad_inputs import BAD_INPUTS, BadInput
from tests.api.captures import png, write_files


@pytest.mark.parametrize("case", BAD_INPUTS.values(), ids=BAD_INPUTS.keys())
def test_bad_input_is_one_line_and_status_2_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], case: BadInput
) -> None:
    files = case.files()
    capture = write_files(tmp_path / "capture", files)
    capture = capture / "capture.zip" if "capture.zip" in files else capture
    out = tmp_path / "out"
    options = [word for name, value in case.options.items() for word in (f"--{name}", value)]
    status = main(["convert", str(capture), "-o", str(out), *options])
    printed = capsys.readouterr()
    assert status == 2
    assert f"error [{case.code}]: " in printed.err
    assert "Traceback" not in printed.err
    for word in case.culprit:
        assert word in printed.err
    assert printed.out == ""
    assert not out.exists()


def test_capture_that_is_not_there_is_status_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(tmp_path / "nothing"), "-o", str(tmp_path / "out")]) == 2
    assert "error [capture-not-found]: " in capsys.readouterr().err


def test_photos_that_cannot_be_posed_are_refused_with_a_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for index in range(4):
        (tmp_path / "photos").mkdir(exist_ok=True)
        (tmp_path / "photos" / f"{index}.png").write_bytes(png(np.full((90, 120, 3), 150 + index, np.uint8)))
    out = tmp_path / "out"
    assert main(["convert", str(tmp_path / "photos"), "-o", str(out), "--preset", "draft"]) == 2
    printed = capsys.readouterr().err
    assert "error [poses-not-found]: " in printed
    assert "0 of 4 photos" in printed
    assert {path.name for path in out.iterdir()} == {"capture.json", "capture.png", "posing"}
    lines = json.loads((out / "capture.json").read_bytes())["lines"]
    assert any(line["label"] == "left out" and "4 with hardly any detail" in line["text"] for line in lines)


def test_bad_database_url_is_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--database-url", "mysql://x"]) == 2
    assert "error [option-invalid]: " in capsys.readouterr().err


@pytest.mark.parametrize("command", ["convert", "export", "serve", "worker", "sample", "demo"])
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert command in capsys.readouterr().out
