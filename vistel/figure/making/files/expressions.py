"""Shapes of expressions as files bring them: glTF's morph targets, VRM's expressions, MakeHuman's targets."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.making.files.gltf import Document
from vistel.figure.making.files.makehuman import read_target
from vistel.figure.making.source import MakingError, SourceMesh, SourceTarget

Bind = tuple[tuple[str, int], int, float]

PREFIX = "vrm:"
"""Before the names of VRM's own expressions, which are made of morph targets."""
_OLD = {"a": "aa", "i": "ih", "u": "ou", "e": "ee", "o": "oh", "blink_l": "blinkLeft", "blink_r": "blinkRight", "joy": "happy",
        "sorrow": "sad", "fun": "relaxed"}  # fmt: skip
"""What VRM 0.x called presets of VRM 1.0."""
_ENDINGS = (".target", ".target.gz")


def vrm_expressions(document: Document) -> dict[str, list[Bind]]:
    """Of each expression that VRM names its morph targets: (("node" or "mesh", number), target, share); empty for plain glTF."""
    out: dict[str, list[Bind]] = {}
    one, zero = document.extension("VRMC_vrm"), document.extension("VRM")
    if one is not None:
        told = one.get("expressions", {})
        for group in ("custom", "preset"):
            for name, row in told.get(group, {}).items():
                binds = row.get("morphTargetBinds", [])
                out[PREFIX + str(name)] = [(("node", int(b["node"])), int(b["index"]), float(b.get("weight", 1.0))) for b in binds]
    elif zero is not None:
        for row in zero.get("blendShapeMaster", {}).get("blendShapeGroups", []):
            preset = str(row.get("presetName", "unknown")).lower()
            name = str(row.get("name", "")) if preset in ("", "unknown") else _OLD.get(preset, preset)
            out[PREFIX + name] = [
                (("mesh", int(b["mesh"])), int(b["index"]), 0.01 * float(b.get("weight", 100.0))) for b in row.get("binds", [])
            ]
    return {name: binds for name, binds in out.items() if binds}


def named(told: Sequence[Any], read: Sequence[F64], binds: Iterable[tuple[str, list[tuple[int, float]]]]) -> list[SourceTarget]:
    """A primitive's morph targets under their names, and the expressions made of them, of each the targets and shares; not those
    that only repeat the name of a target."""
    out = [_sparse(str(told[k]) if k < len(told) else "", offset) for k, offset in enumerate(read)]
    for name, mine in binds:
        known = [(k, share) for k, share in mine if 0 <= k < len(read)]
        if known and name.removeprefix(PREFIX) not in told:
            out.append(_sparse(name, np.sum([share * read[k] for k, share in known], axis=0)))
    return [t for t in out if t.name and len(t.vertex)]


def joined(parts: Iterable[tuple[int, Sequence[SourceTarget]]]) -> tuple[SourceTarget, ...]:
    """Targets of parts of a mesh, each with the number of its first vertex; those of one name are one."""
    found: dict[str, list[SourceTarget]] = {}
    for start, targets in parts:
        for t in targets:
            found.setdefault(t.name, []).append(replace(t, vertex=(t.vertex + start).astype(np.int32)))
    return tuple(
        SourceTarget(name, np.concatenate([t.vertex for t in of]), np.concatenate([t.offset for t in of]))
        for name, of in found.items()
    )


def makehuman_expressions(source: SourceMesh, folder: Path) -> SourceMesh:
    """The mesh with every .target and .target.gz of a folder as an expression under the file's name. Raises MakingError."""
    files = sorted(f for f in folder.iterdir() if f.name.endswith(_ENDINGS)) if folder.is_dir() else [folder]
    if not files:
        raise MakingError(f"{folder}: no {' and no '.join(_ENDINGS)} in it; expected MakeHuman's expression units")
    made: list[SourceTarget] = []
    for file in files:
        vertex, offset = read_target(file, len(source.points))
        made.append(SourceTarget(file.name.split(".")[0], vertex, offset))
    return replace(source, targets=(*source.targets, *made))


def _sparse(name: str, offset: F64) -> SourceTarget:
    vertex = np.flatnonzero(np.abs(offset).max(axis=1, initial=0.0) > 1e-7)
    return SourceTarget(name, vertex.astype(np.int32), offset[vertex])
