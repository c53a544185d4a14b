"""Shaders are compiled in a process of its own, which may die or hang."""

import sys

import pytest

from exporters.check import check_glb, compiler, isolated_compiler
from tests.unit.exporters.test_check import GOOD, in_shader

ECHO = """
import json, os, sys, time
print(json.dumps("ready"), flush=True)
for line in sys.stdin:
    vertex, fragment = json.loads(line)
    if vertex == "crash":
        os.abort()
    if vertex == "hang":
        time.sleep(60)
    print(json.dumps(fragment), flush=True)
"""


def test_answers_are_those_of_the_process() -> None:
    with isolated_compiler([sys.executable, "-c", ECHO]) as compiled:
        assert compiled is not None
        assert compiled("", "0:1: error\nin two lines") == "0:1: error\nin two lines"
        assert compiled("", "x" * 300_000) == "x" * 300_000  # more than a pipe holds


def test_crash_is_an_objection_and_the_next_text_is_compiled() -> None:
    with isolated_compiler([sys.executable, "-c", ECHO]) as compiled:
        assert compiled is not None
        assert "crashed" in compiled("crash", "")
        assert compiled("", "fine") == "fine"


def test_hanging_is_an_objection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiler, "COMPILE_S", 0.1)
    with isolated_compiler([sys.executable, "-c", ECHO]) as compiled:
        assert compiled is not None
        assert "too long" in compiled("hang", "")


def test_process_that_cannot_compile_is_none() -> None:
    with isolated_compiler([sys.executable, "-c", "raise SystemExit(1)"]) as compiled:
        assert compiled is None


def test_driver_accepts_our_shaders_and_names_a_broken_one() -> None:
    with isolated_compiler() as compiled:
        if compiled is None:
            pytest.skip("no OpenGL here")
        assert check_glb(GOOD, compiled) == []
        broken = in_shader("essl300", "shade", "float covered = 0.0;", "float covered = vec2(0.0);")(GOOD)
        (finding,) = check_glb(broken, compiled)
    assert (finding.severity, finding.subject) == ("error", "essl300, shade")
