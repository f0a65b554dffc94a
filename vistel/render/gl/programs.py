"""Shader programs, compiled from the files of `vistel/render/shaders`. `#include "name"` is resolved here."""

import re
from collections.abc import Sequence
from importlib import resources
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray


def source(name: str) -> str:
    """The text of a shader with its includes in place."""
    folder = resources.files("vistel.render") / "shaders"
    text = (folder / name).read_text("utf-8")
    return re.sub(r'#include "([\w./]+)"', lambda m: source(m.group(1)), text)


def program(ctx: moderngl.Context, vertex: str, fragment: str | None = None, defines: Sequence[str] = ()) -> moderngl.Program:
    """`vertex`.vert.glsl with `fragment`.frag.glsl (default: of the same name).

    Variants are compiled apart by `defines`: software GL runs both sides of every branch, so a branch saves nothing.
    """
    lines = "".join(f"#define {d}\n" for d in defines)
    stages = (source(f"{vertex}.vert.glsl"), source(f"{fragment or vertex}.frag.glsl"))
    vertex_text, fragment_text = (t.replace("#version 330\n", f"#version 330\n{lines}", 1) for t in stages)
    return ctx.program(vertex_shader=vertex_text, fragment_shader=fragment_text)


def feedback(
    ctx: moderngl.Context, vertex: str, varyings: tuple[str, ...], constants: str = "", interleaved: bool = False
) -> moderngl.Program:
    """`vertex`.vert.glsl alone, whose `varyings` transform feedback writes: to a buffer each, or `interleaved` to one.

    constants: GLSL put first.
    """
    text = source(f"{vertex}.vert.glsl").replace("#version 330\n", f"#version 330\n{constants}", 1)
    mode = "interleaved" if interleaved else "separate"
    return ctx.program(vertex_shader=text, varyings=varyings, varyings_capture_mode=mode)


def vertex_array(
    ctx: moderngl.Context,
    prog: moderngl.Program,
    content: Sequence[tuple[Any, ...]],
    index: moderngl.Buffer | None = None,
    index_bytes: int = 4,
    skip_errors: bool = False,
) -> moderngl.VertexArray:
    """`Context.vertex_array` of moderngl, which says no types. content: buffer, layout and names of attributes each; index_bytes:
    of one number in `index`; skip_errors: attributes that the program does not use are left out."""
    made: Any = getattr(ctx, "vertex_array")  # noqa: B009  the member has no types
    return made(prog, content, index, index_element_size=index_bytes, skip_errors=skip_errors)


def as_gl(matrix: NDArray[np.floating]) -> bytes:
    """A (4, 4) matrix as OpenGL reads it."""
    return np.ascontiguousarray(matrix.T, np.float32).tobytes()


def put(prog: moderngl.Program, **uniforms: object) -> None:
    """Set uniforms, which nothing else may set; those that are so already, and those the compiler found unused, are skipped."""
    if prog.extra is None:
        prog.extra = {}
    known: dict[str, object] = prog.extra
    for name, value in uniforms.items():
        if known.get(name) == value:
            continue
        known[name] = value
        member: Any = prog.get(name, None)
        if isinstance(value, bytes) and member is not None:
            member.write(value)
        elif member is not None:
            member.value = value
