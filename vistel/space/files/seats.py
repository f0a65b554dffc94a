"""Where people sit in a room from a file: our attributes, else nodes called seat or spawn, else its chairs."""

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.space.room import Seat
from vistel.space.things.things import Thing

_CALLED = re.compile(r"^(seat|spawn|sit)(?![a-z])", re.IGNORECASE)
_CHAIRS = ("chair", "stool")


def seat_of(matrix: F64) -> Seat:
    """The seat at a node: matrix (4, 4) to the room [m]; it faces the node's +Z."""
    facing = matrix[:3, 2]
    return Seat(np.array([matrix[0, 3], 0.0, matrix[2, 3]]), _heading(facing))


def nodes_called_seat(nodes: Iterable[tuple[str, F64]]) -> list[Seat]:
    """Seats among nodes (name, matrix to the room), sorted by name."""
    return [seat_of(m) for _, m in sorted((n for n in nodes if _CALLED.match(n[0])), key=lambda n: _natural(n[0]))]


def seats_at_chairs(things: Iterable[Thing]) -> list[Seat]:
    """A seat at each chair, facing the middle of what is no chair (else of the room)."""
    things = list(things)
    chairs = [t for t in things if t.fixed and t.shape in _CHAIRS]
    tables = [t for t in things if t.fixed and t.shape in ("table", "desk")]
    out: list[Seat] = []
    for chair in chairs:
        towards = min(tables, key=lambda t: _away(t, chair)).position if tables else np.zeros(3)
        at = np.array([chair.position[0], 0.0, chair.position[2]])
        out.append(Seat(at, _heading(towards - at)))
    return out


def usd_seats(stage: Any, to_room: F64) -> list[Seat]:
    """Of a stage of others: prims with vistel:seat, else those called so. to_room: (4, 4) from the stage's frame."""
    from pxr import UsdGeom

    cache = UsdGeom.XformCache()
    told: list[tuple[str, F64]] = []
    named: list[tuple[str, F64]] = []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Xformable):
            marked = prim.HasAttribute("vistel:seat")
            if not marked and not _CALLED.match(prim.GetName()):
                continue
            matrix = to_room @ np.array(cache.GetLocalToWorldTransform(prim), np.float64).T
            (told if marked else named).append((prim.GetName(), matrix))
    return [seat_of(m) for _, m in sorted(told, key=lambda n: _natural(n[0]))] or nodes_called_seat(named)


def gltf_seats(path: Path) -> list[Seat]:
    """Of a glTF file. Raises MakingError, OSError."""
    from vistel.figure.making.files.gltf import read_document
    from vistel.figure.making.files.gltf_nodes import Nodes

    nodes = Nodes(read_document(path))
    return nodes_called_seat((nodes.name(k), nodes.matrix[k]) for k in range(len(nodes)))


def _heading(towards: F64) -> float:
    return math.atan2(float(towards[0]), float(towards[2])) + 0.0


def _away(a: Thing, b: Thing) -> float:
    return float(np.hypot(a.position[0] - b.position[0], a.position[2] - b.position[2]))


def _natural(name: str) -> list[tuple[int, str]]:
    """seat_10 after seat_9."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name.lower())]
