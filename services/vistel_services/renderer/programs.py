"""The renderer's shaders, read from `shaders/` beside this file. `#include "name"` is resolved here."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import resources

import moderngl
import numpy as np
from numpy.typing import NDArray


def source(name: str) -> str:
    """The text of a shader with its includes in place."""
    folder = resources.files("vistel_services.renderer") / "shaders"
    text = (folder / name).read_text("utf-8")
    return re.sub(r'#include "([\w.]+)"', lambda m: source(m.group(1)), text)


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


def as_gl(matrix: NDArray[np.floating]) -> bytes:
    """A (4, 4) matrix as OpenGL reads it."""
    return np.ascontiguousarray(matrix.T, np.float32).tobytes()


def put(prog: moderngl.Program, **uniforms: object) -> None:
    """Set uniforms; those the compiler found unused are skipped."""
    for name, value in uniforms.items():
        if name in prog:
            member = prog[name]
            if isinstance(value, bytes):
                member.write(value)  # type: ignore[union-attr]
            else:
                member.value = value  # type: ignore[union-attr]
