"""Compiling shader text, where the machine has OpenGL."""

from collections.abc import Callable

# (vertex text, fragment text), both complete -> what the driver objects to; empty: nothing.
Compiler = Callable[[str, str], str]


def gl_compiler() -> Compiler | None:
    """Compiles and links with OpenGL, without a screen; None where moderngl or OpenGL are missing.

    moderngl is optional: it is only needed here.
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
