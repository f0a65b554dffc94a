"""Scene files: TOML to a Scene. Shapes are made of the library's own; a fault is one line: file: key: what was expected."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from vistel.implicit.checks import ShapeError
from vistel.implicit.graph.combine import union
from vistel.implicit.graph.shape import Shape
from vistel.implicit.scene.build import Builder
from vistel.implicit.scene.entries import CombinationEntry, SceneEntry
from vistel.implicit.scene.model import Camera, Light, Scene, SceneError
from vistel.implicit.scene.surface import Material
from vistel.toml import file as toml

MOST_SHAPES = 100_000
"""A file with more shapes than this is refused: reading it takes minutes and gigabytes."""


def load(path: Path | str) -> Scene:
    """Read and check a scene file. Paths in it are relative to it. Raises SceneError, one line per fault."""
    return _checked(toml.read(Path(path), SceneError))


def parse(data: Mapping[str, Any], source: Path | str = "scene") -> Scene:
    """The scene of a file's tables; `source` is named in errors, and paths are relative to it. Raises SceneError."""
    return _checked(toml.TomlFile(source, data))


def _checked(file: toml.TomlFile) -> Scene:
    shapes = file.tables.get("shapes", {})
    count = _count({"of": list(cast("dict[str, Any]", shapes).values())}) - 1 if isinstance(shapes, dict) else 0
    if count > MOST_SHAPES:
        too_many = f"shapes: has {count:,} shapes, expected at most {MOST_SHAPES:,}; make the scene in Python instead"
        raise SceneError(file.described([too_many]))
    entry = file.checked(SceneEntry, SceneError)
    try:
        return _scene(entry, Path(file.source).parent)
    except (SceneError, ShapeError) as e:
        raise SceneError(file.described(str(e).splitlines())) from e


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
