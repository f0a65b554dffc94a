"""Avatars: fitting skeleton and primitives to a body of 13,380 vertices, and how closely they hold it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.row import Row, machine
from vistel.figure.avatar import Avatar, builtin_avatar
from vistel.figure.figure import Figure
from vistel.figure.making.make import make_avatar, refit
from vistel.figure.making.read import Extras, read_source
from vistel.figure.making.source import Material, Source
from vistel.figure.posture import Posture, pose_joints

_MAKEHUMAN = Path(__file__).resolve().parents[2] / "shared/data/human/makehuman"
_WITHIN_S, _CLOSE_MM, _MOVED_MM = 20.0, {23: 8.0, 60: 4.0}, 10.0


def run() -> Iterator[Row]:
    """One row per figure. MakeHuman's base mesh where ../shared/data has it, else a built-in person as a mesh without rig."""
    for case, source in _sources():
        make_avatar(source, name="warm", primitives=60)  # compiles
        began = time.perf_counter()
        made = make_avatar(source, name="body", primitives=60)
        took = time.perf_counter() - began
        yield _row(case, "fit, all steps", "s", took, f"value <= {_WITHIN_S:.0f}", took <= _WITHIN_S)
        for count, limit in _CLOSE_MM.items():
            mean = 1e3 * refit(made.avatar, count)[1].mean_distance
            yield _row(
                case, f"mean distance, {count} primitives", "mm", mean, f"value <= {limit:.0f}", mean <= limit
            )
        moved = 1e3 * _moved_at_rest(made.avatar)
        yield _row(case, "furthest vertex moved at rest", "mm", moved, f"value <= {_MOVED_MM:.0f}", moved <= _MOVED_MM)


def _sources() -> Iterator[tuple[str, Source]]:
    if (_MAKEHUMAN / "base.obj").is_file():
        extras = Extras(
            rig=_MAKEHUMAN / "rig.game_engine.json", weights=_MAKEHUMAN / "weights.game_engine.json.gz"
        )
        yield "MakeHuman body, 13380 vertices, rig and weights", read_source(_MAKEHUMAN / "base.obj", extras)
    person = builtin_avatar("builtin:seed=3", name="body", height=1.7)
    mesh = person.mesh
    none = np.zeros(len(mesh.triangles), np.int32)
    yield (
        f"built-in person, {len(mesh.vertices)} vertices, no rig",
        Source(
            "body", mesh.vertices.astype(np.float64), mesh.triangles, np.zeros((0, 2)), np.full(mesh.triangles.shape, -1, np.int32),
            none, ("",), none, (Material(""),),
        ),
    )  # fmt: skip


def _moved_at_rest(avatar: Avatar) -> float:
    figure = Figure(avatar)
    rigid, normals = np.empty_like(avatar.mesh.vertices), np.empty_like(avatar.mesh.vertices)
    figure.skin.pose(pose_joints(avatar.skeleton, Posture()), rigid, normals)
    return float(np.linalg.norm(figure.pose(Posture()).vertices - rigid, axis=1).max())


def _row(case: str, metric: str, unit: str, value: float, target: str, met: bool) -> Row:
    return Row("figure", case, metric, unit, round(value, 3), None, None, None, target, met, machine())
