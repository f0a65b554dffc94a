"""Scene files: TOML to a Scene. Shapes are made of the library's own; a fault is one line: file: key: what was expected."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast, get_args

from pydantic import ValidationError

from vistel.implicit.checks import ShapeError
from vistel.implicit.graph.combine import union
from vistel.implicit.graph.shape import Shape
from vistel.implicit.scene.build import Builder
from vistel.implicit.scene.entries import AnyShape, CombinationEntry, SceneEntry
from vistel.implicit.scene.model import Camera, Light, Scene, SceneError
from vistel.implicit.scene.surface import Material

_KINDS = {k for model in get_args(get_args(AnyShape)[0]) for k in get_args(model.model_fields["kind"].annotation)}

MOST_SHAPES = 100_000
"""A file with more shapes than this is refused: reading it takes minutes and gigabytes."""


def load(path: Path | str) -> Scene:
    """Read and check a scene file. Paths in it are relative to it. Raises SceneError, one line per fault."""
    file = Path(path)
    try:
        data = tomllib.loads(file.read_text("utf-8"))
    except OSError as e:
        raise SceneError(f"{file}: cannot be read: {e.strerror}") from e
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as e:
        raise SceneError(f"{file}: not valid TOML: {e}") from e
    return parse(data, file)


def parse(data: Mapping[str, Any], source: Path | str = "scene") -> Scene:
    """The scene of a file's tables; `source` is named in errors, and paths are relative to it. Raises SceneError."""
    shapes = data.get("shapes", {})
    count = _count({"of": list(cast("dict[str, Any]", shapes).values())}) - 1 if isinstance(shapes, dict) else 0
    if count > MOST_SHAPES:
        raise SceneError(
            f"{source}: shapes: has {count:,} shapes, expected at most {MOST_SHAPES:,}; make the scene in Python instead"
        )
    try:
        entry = SceneEntry.model_validate(dict(data))
    except ValidationError as e:
        faults = [x for x in e.errors() if x["loc"][-1:] != ("str",)] or e.errors()  # a table, not a name, was meant
        raise SceneError("\n".join(dict.fromkeys(f"{source}: {_key(x['loc'])}: {_said(x)}" for x in faults))) from e
    except ShapeError as e:
        raise SceneError(f"{source}: shapes: {e}") from e
    try:
        return _scene(entry, Path(source).parent)
    except (SceneError, ShapeError) as e:
        raise SceneError("\n".join(f"{source}: {line}" for line in str(e).splitlines())) from e


def _scene(entry: SceneEntry, folder: Path) -> Scene:
    build = Builder(entry, folder)
    view = entry.camera
    camera = Camera(view.position, view.target, view.up, math.radians(view.field_of_view), view.height)
    lights: list[Light] = []
    for i, lamp in enumerate(entry.lights):
        try:
            lights.append(Light(lamp.position, lamp.towards, lamp.colour, lamp.shadows))
        except SceneError as e:
            raise SceneError(f"lights[{i}]: {str(e).removeprefix('light: ')}") from e
    seen: list[Shape] = [build.shape(name, "show") for name in _shown(entry)]
    shape = None if not seen else seen[0] if len(seen) == 1 else union(*seen)
    meshes = [build.mesh(m, f"meshes[{i}]") for i, m in enumerate(entry.meshes)]
    if shape is None and not meshes:
        raise SceneError("shapes: is empty and there are no meshes, expected something to see")
    return Scene(camera, shape, meshes, lights, Material(), entry.background, entry.size, entry.threshold)


def _shown(entry: SceneEntry) -> list[str]:
    """The names of `show`, or of all shapes that no other shape is made of."""
    if entry.show is not None:
        return entry.show
    used: set[str] = set()
    pending: list[Any] = list(entry.shapes.values())
    while pending:
        shape = pending.pop()
        if isinstance(shape, CombinationEntry):
            for part in shape.of:
                if isinstance(part, str):
                    used.add(part)
                else:
                    pending.append(part)
        elif isinstance(volume := getattr(shape, "volume", None), str):
            used.add(volume)
    return [name for name in entry.shapes if name not in used]


def _count(shape: object) -> int:
    """How many shapes are written in a table and inside it."""
    count, pending = 0, [shape]
    while pending:
        table = pending.pop()
        if isinstance(table, dict):
            count += 1
            parts = cast("dict[str, object]", table).get("of")
            pending += cast("list[object]", parts) if isinstance(parts, list) else []
    return count


def _key(loc: tuple[int | str, ...]) -> str:
    """A key as it is written; the words pydantic adds for the member of a union are left out."""
    out = ""
    for i, part in enumerate(loc):
        if isinstance(part, int):
            out += f"[{part}]"
        elif not (_of_pydantic(part) or (i > 1 and part in _KINDS and _is_shape(loc[:i]))):
            out += f".{part}" if out else part
    return out or "file"


def _of_pydantic(word: str) -> bool:
    return (
        not re.fullmatch(r"[\w .-]+", word) or word.startswith(("function-", "tagged-", "constrained-")) or word in ("str", "float")
    )


def _is_shape(before: tuple[int | str, ...]) -> bool:
    """Whether a key is that of a shape's table: shapes.NAME, or an element of `of`."""
    return before[-2] == "shapes" or isinstance(before[-1], int) or _of_pydantic(before[-1])


def _said(error: Any) -> str:
    """pydantic's message, with what was found for plain values."""
    text = str(error["msg"]).removeprefix("Value error, ")
    found = error.get("input")
    return f"is {found!r}: {text}" if isinstance(found, str | int | float | bool) and "expected" not in text else text
