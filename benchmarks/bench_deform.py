"""Deformation of a whole figure against plain linear blend skinning of the same mesh, alternating in one run.

Ours: the built-in person of about 10,000 vertices. Cases: standing and nothing near; hugging a second one,
the limbs of both as ghosts for each other. The parts are timed alone: `skin` is the rigid component
(blended dual quaternions, normals too), `deform` the implicit deformation with its normals, `whole` a call
of `Figure.pose`. The peer is a Numba kernel with four weights per vertex, float32, one thread, positions
only.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from statistics import median

import numba as nb
import numpy as np

from benchmarks.row import Row, machine
from vistel.figure.avatar_builtin import builtin_avatar
from vistel.figure.figure import Figure
from vistel.figure.posture import ELBOW, SHOULDER, Posture, Stance, standing
from vistel.implicit.contact import cone_sphere_contacts

ROUNDS = 60


@nb.njit(cache=True, fastmath=True)
def _linear_blend(points, bone, weight, matrices, out):
    """The peer: sum of four weighted bone matrices times the rest position."""
    for v in range(len(points)):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        p = q = r = np.float32(0.0)
        for j in range(4):
            m, w = matrices[bone[v, j]], weight[v, j]
            p += w * (m[0] * x + m[1] * y + m[2] * z + m[3])
            q += w * (m[4] * x + m[5] * y + m[6] * z + m[7])
            r += w * (m[8] * x + m[9] * y + m[10] * z + m[11])
        out[v, 0], out[v, 1], out[v, 2] = p, q, r


def _microseconds(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median time of each call, all in turn, ROUNDS times."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(ROUNDS):
        for name, call in calls.items():
            begin = time.perf_counter()
            call()
            times[name].append(1e6 * (time.perf_counter() - begin))
    return {name: median(values) for name, values in times.items()}


def hugging() -> tuple[Posture, Posture]:
    """Two people face to face with their arms round each other."""
    dofs = standing().dofs.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[SHOULDER[side]] = (0.1, -sign * 1.25, -sign * 0.25)
        dofs[ELBOW[side]] = 0.9
    return Posture(dofs), Posture(dofs, stance=Stance(np.array([0.05, 0.0, 0.36]), math.pi))


def run() -> Iterator[Row]:
    """All rows; about half a minute, most of it the person and the kernels the first time."""
    avatar = builtin_avatar("builtin:seed=3", name="bench", height=1.7)
    one, two = Figure(avatar), Figure(avatar)
    a, b = hugging()
    state, posed = one.pose(a), two.pose(b).posed
    ghost = two.ghosts(posed)
    mesh, skin = avatar.mesh, one.skin
    matrices = skin.matrices(state.joints)
    out = np.empty_like(mesh.vertices)
    bone, weight = skin.influences.bone, skin.influences.weight
    vertices, normals = np.empty_like(mesh.vertices), np.empty_like(mesh.vertices)

    def lbs() -> None:
        _linear_blend(mesh.vertices, bone, weight, matrices, out)

    for case, posture, ghosts in (("nothing near", standing(), ()), ("hugging", a, (ghost,))):
        state = one.pose(posture, ghosts)
        joints, own = state.joints, state.posed
        skin.pose(joints, vertices, normals)
        rigid, rigid_normals = vertices.copy(), normals.copy()

        def deform(own=own, ghosts=ghosts, rigid=rigid, rigid_normals=rigid_normals) -> None:
            np.copyto(vertices, rigid)
            np.copyto(normals, rigid_normals)
            one.deformer.deform(vertices, normals, own.a, own.b, ghosts)

        took = _microseconds({
            "lbs": lbs,
            "skin": lambda joints=joints: skin.pose(joints, vertices, normals),
            "deform": deform,
            "whole": lambda posture=posture, ghosts=ghosts: one.pose(posture, ghosts),
        })  # fmt: skip
        peer = f"Numba {version('numba')} linear blend skinning, {len(mesh.vertices)} vertices"
        goal = {"deform": ("ratio <= 2.0", 2.0) if case == "hugging" else ("ratio <= 0.1", 0.1)}
        for part in ("skin", "deform", "whole"):
            ratio = took[part] / took["lbs"]
            target, most = goal.get(part, (None, math.inf))
            yield Row("deform", f"{case}: {part}", "time", "us", took[part], peer, took["lbs"], ratio, target,
                      ratio <= most if target else None, machine())  # fmt: skip
        report = one.pose(posture, ghosts).report
        for metric, value, target in (
            ("vertices moved", report.moved, None), ("vertices without a root", report.lost, None),
            ("blocks solved", report.blocks, None), ("evaluations per block", report.evaluations, "<= 3"),
        ):  # fmt: skip
            met = None if target is None else value <= 3.0
            yield Row("deform", case, metric, "1", float(value), None, None, None, target, met, machine())

    took = _microseconds({"contacts": lambda: cone_sphere_contacts(state.posed, posed)})
    found = len(cone_sphere_contacts(state.posed, posed))
    yield Row("deform", f"contact list of two figures, {found} contacts", "time", "us", took["contacts"],
              None, None, None, None, None, machine())  # fmt: skip
