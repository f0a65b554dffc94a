"""How long figures take to deform: touching nothing, themselves, each other, beside other programs; and how that grows.

Ours: the built-in person of about 10,000 vertices and 55 primitives. Parts are timed alone: `skin` is the rigid component (blended
dual quaternions, normals too), `ghosts` the implicit deformation of the vertices, `normals` those round what it moved, `whole` a
call of `Figure.pose`. The peer is a Numba kernel with four weights per vertex, float32, positions only, in the same process,
alternating. Programs of their own (Blender, MuJoCo, FCL, Warp) run right before or after ours where they are installed
(`benchmarks/fields/deform_peers.py`). Times are processor time of the one thread, medians.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from importlib.metadata import version

import numpy as np

from benchmarks.fields.deform_peers import peer
from benchmarks.fields.deform_scenes import CapsuleBody, body, capsules, hugging
from benchmarks.figures.figure_peers import linear_blend
from benchmarks.row import Row, at_least, at_most, ratio_at_most
from benchmarks.timing import microseconds
from vistel.figure.figure import Figure
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import Posture, Stance, standing
from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.contacts.contact import ContactScene
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.implicit.meshes.embedding import primitive_field

ROUNDS = 60
POSES = 10_000
SLOPE = 4.0 * SURFACE_RATIO * (1.0 - SURFACE_RATIO**2)
"""-dF / d(distance / influence radius) of the quartic at the surface."""


_row = partial(Row, "deform")


def _against(case: str, metric: str, unit: str, value: float, name: str, beside: float, most: float | None) -> Row:
    """A row with a peer and the ratio it should not exceed."""
    return _row(case, metric, unit, value, name, beside, target=None if most is None else ratio_at_most(most))


def run() -> Iterator[Row]:
    """All rows; two to three minutes, most of it random poses, growth and the peers."""
    avatar = builtin_avatar("builtin:person=carla", name="bench", height=1.7)
    people = [Figure(avatar) for _ in range(3)]
    yield from _figures(people)
    yield from _seeing_all()
    yield from _three(people)
    yield from _contact_lists()
    yield from _soft_bodies()
    yield from _growth()
    yield from _interpenetration()


def _figures(people: list[Figure]) -> Iterator[Row]:
    one, two = people[:2]
    a, b = hugging()
    ghost = two.ghosts(two.pose(b).posed)
    mesh, skin = one.avatar.mesh, one.skin
    out, bone, weight = np.empty_like(mesh.vertices), skin.influences.bone, skin.influences.weight
    vertices, normals = np.empty_like(mesh.vertices), np.empty_like(mesh.vertices)
    name = f"Numba {version('numba')} linear blend skinning, {len(mesh.vertices)} vertices"
    blender = peer("blender_peers.py", "skin")
    cases: tuple[tuple[str, Posture, tuple[GhostSource, ...], float | None], ...] = (
        ("nothing near", Posture(), (), 0.1),
        ("arms at the sides", standing(), (), None),
        ("hugging", a, (ghost,), 2.0),
    )
    for case, posture, ghosts, most in cases:
        state = one.pose(posture, ghosts)
        joints, own, matrices = state.joints, state.posed, skin.matrices(state.joints).copy()
        took = microseconds(
            {
                "lbs": lambda m=matrices: linear_blend(mesh.vertices, bone, weight, m, out),
                "skin": lambda j=joints: skin.pose(j, vertices, normals),
                "ghosts": lambda o=own, g=ghosts: one.deformer.solve(vertices, normals, o.a, o.b, g),
                "normals": lambda: one.deformer.update_normals(vertices, normals),
                "whole": lambda p=posture, g=ghosts: one.pose(p, g),
            },
            ROUNDS,
        )
        for part in ("skin", "ghosts", "normals", "whole"):
            yield _against(f"{case}: {part}", "time", "us", took[part], name, took["lbs"], most if part == "ghosts" else None)
        if blender:
            beside = f"Blender {blender['version']} Armature modifier, 10000 vertices"
            yield _against(f"{case}: whole", "time", "us", took["whole"], beside, 1e3 * blender["ms_median"], 0.8)
        report = one.pose(posture, ghosts).report
        yield _row(case, "vertices moved", "1", report.moved)
        yield _row(case, "vertices without a root", "1", report.lost)
        if report.moved:
            each = report.vertex_evaluations
            yield _row(case, "evaluations per moved vertex", "1", each, target=at_most(3))
            yield _row(case, "evaluations per block of 64", "1", report.evaluations)


def _seeing_all() -> Iterator[Row]:
    """23 large balls all round a figure of 23 capsules: every vertex is in the field of each of them."""
    figure = body(capsules(), 10_000)
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(23, 3)) * (1.0, 0.2, 1.0)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    centres = np.array([0.0, 0.9, 0.0]) + directions * rng.uniform(3.25, 4.0, (23, 1))
    balls = PrimitiveSet.of_kinds(["sphere"] * 23, [[3.0]] * 23, np.tile(np.eye(3), (23, 1, 1)), centres)
    ghosts = (ghosts_of(balls, groups=range(23)),)
    vertices, normals, out = figure.vertices.copy(), figure.normals.copy(), figure.vertices.copy()
    count = len(vertices)
    bone, weight = rng.integers(0, 23, (count, 4)).astype(np.int32), np.full((count, 4), 0.25, np.float32)
    matrices = np.tile(np.eye(3, 4, dtype=np.float32).reshape(-1), (23, 1))

    def deform() -> None:
        figure.deformer.solve(vertices, normals, figure.a, figure.b, ghosts)

    took = microseconds(
        {
            "lbs": lambda: linear_blend(figure.vertices, bone, weight, matrices, out),
            "rigid": lambda: np.copyto(vertices, figure.vertices),
            "deform": deform,
        },
        ROUNDS,
    )
    name = f"Numba {version('numba')} linear blend skinning, {count} vertices"
    case = "every vertex sees 23 ghosts: ghosts"
    yield _against(case, "time", "us", took["deform"], name, took["lbs"], 5.5)
    yield _row(case, "vertices moved", "1", int(np.count_nonzero(figure.deformer.moved)))


def _three(people: list[Figure]) -> Iterator[Row]:
    """Three people in a circle, arms round each other: contact lists of all pairs, then all figures."""
    postures: list[Posture] = []
    for k in range(3):
        turn = 2.0 * math.pi * k / 3.0
        place = np.array([0.24 * math.sin(turn), 0.0, 0.24 * math.cos(turn)])
        postures.append(Posture(hugging()[0].dofs, stance=Stance(place, turn + math.pi)))
    posed = [f.pose(p).posed for f, p in zip(people, postures, strict=True)]
    scene = ContactScene([PrimitiveSet.of_cone_spheres(p.a, p.b, p.radius_a, p.radius_b) for p in posed])
    body_of = np.repeat(np.arange(3), np.diff(scene.first))

    def frame() -> None:
        for k in range(3):
            scene.place_cone_spheres(k, posed[k])
        found = scene.find()
        pairs = set(zip(body_of[found.a].tolist(), body_of[found.b].tolist(), strict=True))
        ghosts = [f.ghosts(p) for f, p in zip(people, posed, strict=True)]
        touching: list[list[GhostSource]] = [[], [], []]
        for i, j in pairs:
            touching[i].append(ghosts[j])
            touching[j].append(ghosts[i])
        for k in range(3):
            posed[k] = people[k].pose(postures[k], touching[k]).posed

    took = microseconds({"frame": frame}, ROUNDS)["frame"]
    rate = 1e6 / took
    yield _row("three figures, contact lists and all", "frames", "1/s", rate, target=at_least(500))


def _contact_lists() -> Iterator[Row]:
    for gap in (0.8, 0.4):
        scene = ContactScene([capsules((gap * k, 0.0, 0.05 * k)) for k in range(3)])
        took, found = microseconds({"contacts": scene.find}, 400)["contacts"], len(scene.find())
        case = f"contact lists, 3 x 23 primitives {gap} m apart, {found} contacts"
        yield _row(case, "time", "us", took)
        for engine, call, most in (("mujoco", "MuJoCo mj_collision", 1.5), ("fcl", "FCL managers", 1.0 / 6.0)):
            beside = peer("collision_peers.py", engine, "--gap", str(gap))
            if beside:
                name = f"{call}, {beside['contacts']} contacts"
                yield _against(case, "time", "us", took, name, beside["us_median"], most)


def _soft_bodies() -> Iterator[Row]:
    """A block of skin on a capsule against bodies that are simulated (a harder problem: context, not a race)."""
    ball = PrimitiveSet.of_cone_spheres(np.zeros((1, 3)), np.array([[0.44, 0, 0]]), np.array([0.2]), np.array([0.2]))
    figure = body(ball, 10_648)
    rod = PrimitiveSet.of_cone_spheres(
        np.array([[0.2, 0.27, -1.0]]), np.array([[0.2, 0.27, 1.0]]), np.array([0.1]), np.array([0.1])
    )
    ghosts = (ghosts_of(rod),)
    vertices, normals = figure.vertices.copy(), figure.normals.copy()

    def frame() -> None:
        np.copyto(vertices, figure.vertices)
        np.copyto(normals, figure.normals)
        figure.deformer.deform(vertices, normals, figure.a, figure.b, ghosts)

    took = microseconds({"frame": frame}, ROUNDS)["frame"]
    case = f"a rod on a body of {len(vertices)} vertices"
    yield _row(case, "time", "us", took)
    for engine, title, most in (
        ("warp_xpbd", "Warp XPBD, 10 iterations", 1.0 / 20.0),
        ("mujoco_trilinear", "MuJoCo trilinear flex", 1.0 / 50.0),
    ):
        beside = peer("softbody_peers.py", engine)
        if beside:
            each = 1e3 * beside["ms_per_step_median"] * beside["steps_per_60Hz_frame"]
            yield _against(case, "time", "us", took, f"{title}, {beside['vertices']} nodes, a 60 Hz frame", each, most)


def _growth() -> Iterator[Row]:
    """Times against sizes, and the exponents fitted to them."""
    a, b = np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]])
    rod = PrimitiveSet.of_cone_spheres(a, b, np.array([0.05]), np.array([0.05]))

    def time_of(figure: CapsuleBody, ghosts: tuple[GhostSource, ...], rounds: int) -> float:
        vertices, normals = figure.vertices.copy(), figure.normals.copy()
        calls = {
            "rigid": lambda: np.copyto(vertices, figure.vertices),
            "deform": lambda: figure.deformer.solve(vertices, normals, figure.a, figure.b, ghosts),
        }
        return microseconds(calls, rounds)["deform"]

    def balls(count: int) -> tuple[GhostSource, ...]:
        x = np.linspace(0.0, 1.0, count)
        centres = np.stack([x, np.full(count, 0.05 + 0.5 / count), 0 * x], axis=1)
        turn = np.tile(np.eye(3), (count, 1, 1))
        shapes = PrimitiveSet.of_kinds(["sphere"] * count, [[0.6 / count]] * count, turn, centres)
        return (ghosts_of(shapes, groups=range(count)),)

    sizes = [1_000, 10_000, 100_000, 1_000_000]
    times: list[float] = []
    for size in sizes:
        times.append(time_of(body(rod, size), balls(10), 40 if size <= 100_000 else 5))
        yield _row(f"a rod of {size} vertices under 10 primitives: ghosts", "time", "us", times[-1])
    exponent = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
    yield _row("growth with vertices, 1k to 1M", "exponent", "1", exponent, target=at_most(1.05))
    counts = [10, 30, 100, 300, 1_000]
    figure = body(rod, 10_000)
    times = [time_of(figure, balls(n), 10) for n in counts]
    exponent = float(np.polyfit(np.log(counts), np.log(times), 1)[0])
    yield _row("growth with primitives, 10 to 1,000 over the same rod", "exponent", "1", exponent)


def deepest(poses: int, seed: int = 0) -> tuple[float, int, int]:
    """Random contact poses of two bumpy capsules that deform each other: depth of the deepest vertex with a root, as a share of its
    body's radius; vertices that touch; vertices without a root (pressed past their skeleton)."""
    rng = np.random.default_rng(seed)
    radii = (0.05, 0.04)
    bodies = [
        body(PrimitiveSet.of_cone_spheres(np.array([[-0.1, 0, 0]]), np.array([[0.1, 0, 0]]), r, r), 300, seed=i)
        for i, r in enumerate(np.array([[radii[0]], [radii[1]]]))
    ]
    worst, touching, lost = 0.0, 0, 0
    for _ in range(poses):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))
        away = rng.normal(size=3) * (0.3, 1.0, 1.0)
        shift = away / np.linalg.norm(away) * rng.uniform(0.6, 1.05) * sum(radii)
        frames = ((np.eye(3), np.zeros(3)), (turn, shift))
        placed = [(o.a @ r.T + p, o.b @ r.T + p) for o, (r, p) in zip(bodies, frames, strict=True)]
        for i in range(2):
            o, (r, p) = bodies[i], frames[i]
            vertices, normals = (o.vertices @ r.T + p).astype(np.float32), (o.normals @ r.T).astype(np.float32)
            o.deformer.deform(vertices, normals, *placed[i], [bodies[1 - i].deformer.ghosts(*placed[1 - i])])
            mine, theirs = _field(o, *placed[i], vertices), _field(bodies[1 - i], *placed[1 - i], vertices)
            rooted = o.deformer.lost == 0
            over = (theirs - mine)[rooted & (theirs > 0.05)]
            touching += int(np.count_nonzero(np.abs(over) < 1e-3))
            lost += int(np.count_nonzero(~rooted))
            if len(over):
                reach = float(o.embedding.fit.reach[0])
                worst = max(worst, float(over.max()) / SLOPE * reach)
    return worst, touching, lost


def _field(o: CapsuleBody, a: np.ndarray, b: np.ndarray, points: np.ndarray) -> np.ndarray:
    limbs = replace(o.embedding.limbs, a=a, b=b)
    return primitive_field(points.astype(np.float64), limbs, o.embedding.fit, 0)


def _interpenetration() -> Iterator[Row]:
    worst, touching, lost = deepest(POSES)
    case = f"interpenetration, {POSES} random contact poses"
    yield _row(case, "deepest vertex / radius", "1", worst, target=at_most(1e-3))
    yield _row(case, "vertices in contact", "1", touching)
    yield _row(case, "vertices without a root", "1", lost)
