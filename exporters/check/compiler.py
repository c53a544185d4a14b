"""Compiling shader text, where the machine has OpenGL."""

import json
import select
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# (vertex text, fragment text), both complete -> what the driver objects to; empty: nothing.
Compiler = Callable[[str, str], str]

START_S, COMPILE_S = 60.0, 60.0  # a hundred times what a busy machine takes


def gl_compiler() -> Compiler | None:
    """Compiles and links with OpenGL, without a screen; None where moderngl or OpenGL are missing.

    moderngl is optional: it is only needed here. In this process: for texts of unknown origin, see `isolated_compiler`.
    """
    try:
        import moderngl

        context = moderngl.create_context(standalone=True, backend="egl")  # type: ignore[arg-type]
    except Exception:  # moderngl has no class of its own for a machine without OpenGL
        return None

    def compiled(vertex: str, fragment: str) -> str:
        try:
            context.program(vertex_shader=vertex, fragment_shader=fragment).release()
        except moderngl.Error as error:
            return " ".join(str(error).split())
        return ""

    return compiled


@contextmanager
def isolated_compiler(command: list[str] | None = None) -> Iterator[Compiler | None]:
    """`gl_compiler` in a process of its own: what makes a driver crash or hang is an objection like any other.

    Args:
        command: starts the process, see `compiler_process`; None: with this Python.
    """
    process = _Process(command or [sys.executable, "-m", "exporters.check.compiler_process"])
    try:
        yield process.compiled if process.start() else None
    finally:
        process.stop()


class _Process:
    """Answers a line of JSON with a line of JSON; started again after it died."""

    def __init__(self, command: list[str]) -> None:
        self._command = command
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> bool:
        """Whether it can compile."""
        self._process = subprocess.Popen(
            self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        if self._answer(START_S) == "ready":
            return True
        self.stop()
        return False

    def stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def compiled(self, vertex: str, fragment: str) -> str:
        if self._process is None and not self.start():
            return "the driver does not start again"
        assert self._process is not None
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps([vertex, fragment]) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            answer = None
        else:
            answer = self._answer(COMPILE_S)
        if answer is None:
            self.stop()
            return "it crashed, or took too long"
        return answer

    def _answer(self, patience_s: float) -> str | None:
        assert self._process is not None
        assert self._process.stdout is not None
        ready, _, _ = select.select([self._process.stdout], [], [], patience_s)
        line = self._process.stdout.readline() if ready else ""
        return str(json.loads(line)) if line.endswith("\n") else None
