"""The GPU's deformation against the CPU's, in whatever OpenGL this machine has."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from figure_fixture import capsule, tube_person

from vistel.figure.figure import Figure
from vistel.figure.figure_plan import FigurePlanner
from vistel.figure.layers.skin import SkinLayers
from vistel.figure.posture.posture import ELBOW, KNEE, SHOULDER, Posture, Stance, standing
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.deform_plan import FramePlan, Planner
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.implicit.ghosts.constraint import ConstraintGhost
from vistel.implicit.ghosts.force_field import Directional, Radial, Shear
from vistel.implicit.ghosts.mesh_ghosts import blown, faded, pulled
from vistel.implicit.meshes.embedding import Hinge, Limbs, embed
from vistel.render.figures.gpu_deform import GpuDeformer, GpuSkin, SkinShape, choose_engine, constants
from vistel.render.gl.context import GlContext
from vistel.render.gl.programs import source

pytestmark = pytest.mark.gl

F32, F64 = np.ndarray, np.ndarray
CLOSE, MOST = 1e-5, 1e-4
"""How far apart a vertex may lie [m]: all but one in 200, all but one in 1,000. Where two roots lie close, rounding
decides which is found: the CPU engine itself flips there when its input is moved by 1e-7 m."""
IDENTITY = np.array([[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0]], np.float32)
BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


@pytest.fixture(scope="module")
def engine(surface: GlContext) -> Iterator[GpuDeformer]:
    made = GpuDeformer(surface.ctx)
    yield made
    assert surface.ctx.error == "GL_NO_ERROR"
    made.release()


class Arm:
    """Two capsules that share a hinge, closed skins on both, and a third limb beside them; solved by both engines."""

    def __init__(self, engine: GpuDeformer) -> None:
        self.a = np.array([[-0.3, 0.0, 0.0], [0.0, 0.0, 0.0], [0.4, 0.5, 0.0]])
        self.b = np.array([[0.0, 0.0, 0.0], [0.28, 0.0, 0.0], [0.4, 0.8, 0.0]])
        radius = np.array([0.08, 0.07, 0.05]), np.array([0.07, 0.05, 0.05])
        skins = [capsule(self.a[i], self.b[i], radius[0][i], radius[1][i], around=24, along=20, cap=6) for i in range(3)]
        first = np.cumsum([0] + [len(p) for p, _ in skins])
        self.rest = np.concatenate([p for p, _ in skins]).astype(np.float32)
        self.limb = np.repeat(np.arange(3, dtype=np.int32), [len(p) for p, _ in skins])
        self.triangles = np.concatenate([t + n for (_, t), n in zip(skins, first[:-1], strict=True)]).astype(np.int32)
        self.normals = _normals(self.rest, self.triangles)
        limbs = Limbs(self.a, self.b, *radius, np.arange(3, dtype=np.int32), (Hinge(0, 1, 0, 1),), frozenset({(0, 1)}))
        embedding = embed(self.rest, self.limb, limbs)
        self.cpu, self.planner = Deformer(self.triangles, embedding), Planner(self.triangles, embedding)
        self._engine = engine

    def fold(self, angle: float) -> tuple[F32, F32, F64, F64]:
        """Rigid positions and normals, a and b, with the second limb turned about the joint."""
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        vertices, normals, b = self.rest.copy(), self.normals.copy(), self.b.copy()
        child = self.limb == 1
        vertices[child], normals[child] = self.rest[child] @ turn.T, self.normals[child] @ turn.T
        b[1] = turn @ self.b[1]
        return vertices, normals, self.a.copy(), b

    def both(self, ghosts: Sequence[GhostSource] = (), angle: float = 0.0) -> Outcome:
        return self.solve(*self.fold(angle), ghosts)

    def solve(
        self, rigid: F32, normals: F32, a: F64, b: F64, ghosts: Sequence[GhostSource], displacement: F32 | None = None
    ) -> Outcome:
        vertices, turned = rigid.copy(), normals.copy()
        self.cpu.deform(vertices, turned, a, b, ghosts, displacement)
        self.planner.begin(rigid, a, b, ghosts, displacement)
        self.planner.touch(rigid, normals)
        plan = self.planner.end(rigid, normals, IDENTITY)
        n = len(rigid)
        shape = SkinShape.of_places(
            self.planner.places(),
            rigid,
            normals,
            np.zeros((n, 4), np.int32),
            np.tile(np.array((1, 0, 0, 0), np.float32), (n, 1)),
            np.arange(n, dtype=np.int32),
        )
        skin = GpuSkin(self._engine, shape)
        drawn, moved, lost = run(skin, plan, self.planner.places().vertex)
        skin.release()
        return Outcome(rigid, vertices, turned, self.cpu.moved.copy(), self.cpu.lost.copy(), *drawn, moved, lost)


class Outcome:
    """One frame of both engines."""

    def __init__(self, rigid, vertices, normals, moved, lost, gpu_vertices, gpu_normals, gpu_moved, gpu_lost) -> None:
        self.rigid, self.vertices, self.normals, self.moved, self.lost = rigid, vertices, normals, moved, lost
        self.gpu_vertices, self.gpu_normals = gpu_vertices, gpu_normals
        self.gpu_moved, self.gpu_lost = gpu_moved, gpu_lost

    def agree(self) -> None:
        """Same places, same normals, same flags; what did not move lies exactly where it was."""
        assert np.isfinite(self.gpu_vertices).all()
        assert np.isfinite(self.gpu_normals).all()
        found = (self.lost | self.gpu_lost) == 0
        assert found.mean() > 0.97
        assert_close(self.gpu_vertices[found], self.vertices[found])
        still = self.gpu_moved == 0
        np.testing.assert_array_equal(self.gpu_vertices[still], self.rigid[still])
        # Who stands within the solver's tolerance may be moved by one and left by the other.
        apart = (self.moved != self.gpu_moved) & found
        assert np.abs(self.gpu_vertices - self.rigid)[apart].max(initial=0.0) < MOST
        assert (self.lost != self.gpu_lost).mean() < 2e-3  # without a root, rounding decides where the search ends
        turned = np.linalg.norm(self.gpu_normals - self.normals, axis=1)
        assert np.quantile(turned, 0.99) < 2e-3

    @property
    def deepest(self) -> float:
        return float(np.linalg.norm(self.vertices - self.rigid, axis=1).max())


def assert_close(here: F32, there: F32) -> None:
    """Places (n, 3) of the same vertices."""
    away = np.abs(here - there).max(axis=1)
    assert (away > MOST).mean() < 1e-3
    assert np.quantile(away, 0.995) < CLOSE


def run(skin: GpuSkin, plan: FramePlan, order: np.ndarray) -> tuple[tuple[F32, F32], np.ndarray, np.ndarray]:
    """Drawn positions and normals; flags moved and lost (V,) in the mesh's order."""
    out = skin.engine.ctx.buffer(reserve=24 * len(skin.shape.corner))
    skin.run(plan, out)
    rows = np.frombuffer(out.read(), np.float32).reshape(-1, 6)
    _, flags = skin.placed(plan)
    out.release()
    of_vertex = np.zeros(len(order), np.int32)  # eyeballs, which come last, left out
    of_vertex[order] = flags[: len(order)]
    return (rows[:, :3].copy(), rows[:, 3:].copy()), of_vertex & 1, of_vertex >> 1


def _normals(vertices: F32, triangles: np.ndarray) -> F32:
    out, p = np.zeros((len(vertices), 3)), vertices[triangles].astype(float)
    for c in range(3):
        np.add.at(out, triangles[:, c], np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
    return (out / np.linalg.norm(out, axis=1, keepdims=True)).astype(np.float32)


def thing(kind: str, params: Sequence[float], centre: Sequence[float], compliance: float = 1.0) -> GhostSource:
    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[[c, -s, 0], [s, c, 0], [0, 0, 1]]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return ghosts_of(PrimitiveSet.of_kinds([kind], [params], turn, np.array([centre])), compliance=compliance)


def ball(centre: Sequence[float] = (0.12, 0.1, 0.01), compliance: float = 1.0) -> GhostSource:
    return thing("sphere", [0.06], centre, compliance)


@pytest.fixture(scope="module")
def arm(engine: GpuDeformer) -> Arm:
    return Arm(engine)


def test_nothing_near_moves_nothing(arm: Arm) -> None:
    seen = arm.both([ball((0.0, 2.0, 0.0))])
    assert not seen.moved.any()
    assert not seen.gpu_moved.any()
    np.testing.assert_array_equal(seen.gpu_vertices, seen.rigid)
    np.testing.assert_array_equal(seen.gpu_normals, arm.normals)


@pytest.mark.parametrize("angle", [0.3, 1.2, 2.2])
def test_a_folded_joint_creases_alike(arm: Arm, angle: float) -> None:
    seen = arm.both(angle=angle)
    assert seen.moved.any()
    seen.agree()


@pytest.mark.parametrize("compliance", [0.0, 0.2, 1.0, 5.0], ids=lambda c: f"compliance={c}")
def test_a_ball_presses_in_alike(arm: Arm, compliance: float) -> None:
    seen = arm.both([ball(compliance=compliance)])
    assert seen.deepest > 0.003
    assert seen.lost.mean() < 0.01
    seen.agree()


def test_balls_from_three_sides_press_a_folded_arm_alike(arm: Arm) -> None:
    balls = [ball(), ball((-0.1, -0.11, 0.0)), ball((-0.12, 0.02, 0.1), 0.0)]
    arm.both(balls, angle=0.8).agree()


@pytest.mark.parametrize(
    ("kind", "params", "centre"),
    [
        ("sphere", [0.06], (0.12, 0.1, 0.01)),
        ("cone_sphere", [-0.1, 0, 0, 0.1, 0, 0, 0.03, 0.05], (0.12, 0.09, 0.01)),
        ("rounded_polygon", [0.02, -0.1, 0.0, -0.1, 0.1, 0.0, -0.1, 0.1, 0.0, 0.1, -0.1, 0.0, 0.1], (0.1, 0.07, 0.0)),
        ("superellipsoid", [0.07, 0.05, 0.06, 0.4, 0.6], (0.12, 0.1, 0.01)),
        ("superellipsoid", [0.07, 0.05, 0.06, 1.6, 0.2], (0.12, 0.1, 0.01)),
        ("supertoroid", [0.03, 0.03, 0.03, 2.0, 0.8, 1.0], (0.12, 0.1, 0.01)),
        ("supertoroid", [0.03, 0.02, 0.03, 2.0, 0.3, 0.7], (0.12, 0.1, 0.01)),
    ],
)
def test_every_kind_of_primitive_presses_in_alike(arm: Arm, kind: str, params: list[float], centre: tuple) -> None:
    for compliance in (0.0, 1.0):
        seen = arm.both([thing(kind, params, centre, compliance)])
        assert seen.deepest > 0.002
        seen.agree()


def test_several_primitives_act_as_their_union_alike(arm: Arm) -> None:
    mixed = PrimitiveSet.of_kinds(
        ["sphere", "superellipsoid", "cone_sphere"],
        [[0.05], [0.05, 0.04, 0.05, 0.5, 1.0], [-0.05, 0, 0, 0.08, 0, 0, 0.03, 0.02]],
        np.broadcast_to(np.eye(3), (3, 3, 3)),
        np.array([(0.08, 0.1, 0.0), (0.14, 0.09, 0.02), (0.1, 0.08, -0.03)]),
    )
    seen = arm.both([ghosts_of(mixed, compliance=0.5)])
    assert seen.deepest > 0.004
    seen.agree()


PULLS = [
    ConstraintGhost("ball", "arm", origin=(0.12, 0.12, 0.0), direction=(0.0, -1.0, 0.0), radius=0.05, plateau=plateau)
    for plateau in (0.0, 0.4)
]


@pytest.mark.parametrize(
    "ghost",
    [
        blown(Directional((0, 1, 0), 2.0), BOX),
        blown(Shear((1, 0, 0), (0, 1, 0), 8.0), BOX),
        blown(Radial((0.05, 0.05, 0.0), 0.25, 0.6), BOX),
        blown(Radial((0.05, 0.0, 0.0), 0.3, -0.3), BOX),
        faded(ball(), 0.6),
        pulled(replace(ball((0.12, 0.16, 0.0)), depth=np.zeros(1, np.float32)), PULLS[:1]),
        pulled(ball((0.12, 0.12, 0.0)), PULLS),
    ],
    ids=["wind", "shear", "expansion", "compression", "fading", "held", "held and touching"],
)
def test_every_effect_moves_alike(arm: Arm, ghost: GhostSource) -> None:
    for ghosts, angle in (([ghost], 0.0), ([ball((-0.1, -0.11, 0.0)), ghost], 0.9)):
        seen = arm.both(ghosts, angle)
        assert seen.deepest > 0.001
        seen.agree()


@pytest.mark.parametrize("angle", [0.0, 0.9])
@pytest.mark.parametrize("near", [None, 0.03, 0.01, -0.005], ids=["alone", "far", "near", "pressed"])
def test_wrinkles_survive_and_are_flattened_alike(arm: Arm, near: float | None, angle: float) -> None:
    wrinkles = (0.002 * np.sin(np.arange(len(arm.rest)))).astype(np.float32)
    wrinkles[::3] = 0.0
    ghosts = [] if near is None else [ball((0.12, 0.11 + near, 0.0))]
    rigid, normals, a, b = arm.fold(angle)
    seen = arm.solve(rigid, normals, a, b, ghosts, wrinkles)
    assert np.isfinite(seen.gpu_vertices).all()
    found = (seen.lost | seen.gpu_lost) == 0
    assert_close(seen.gpu_vertices[found], seen.vertices[found])
    assert np.quantile(np.linalg.norm(seen.gpu_normals - seen.normals, axis=1), 0.99) < 3e-3
    if near is None and angle == 0.0:
        along = ((seen.gpu_vertices - rigid) * normals).sum(axis=1)
        np.testing.assert_allclose(along, wrinkles, atol=1e-6)
        np.testing.assert_array_equal(seen.gpu_vertices[::3], rigid[::3])


def test_penetrations_and_zones_come_from_the_same_vertices(arm: Arm) -> None:
    rigid, normals, a, b = arm.fold(0.0)
    report = arm.cpu.deform(rigid.copy(), normals.copy(), a, b, [ball()])
    poisoned, around = np.full_like(rigid, np.nan), np.full_like(rigid, np.nan)
    poisoned[arm.planner.middles] = rigid[arm.planner.middles]
    read = 0
    for blocks in (lambda: arm.planner.begin(poisoned, a, b, [ball()]), lambda: arm.planner.touch(poisoned, around)):
        near = arm.planner.index[blocks()]
        poisoned[near], around[near] = rigid[near], normals[near]
        read += len(np.unique(near))
    plan = arm.planner.end(poisoned, around, IDENTITY)
    whole = plan.words.copy()
    arm.planner.begin(rigid, a, b, [ball()])
    arm.planner.touch(rigid, normals)
    np.testing.assert_array_equal(whole, arm.planner.end(rigid, normals, IDENTITY).words)
    assert report.delta.max() > 0.0
    assert 0 < read < 0.7 * len(rigid)


@pytest.mark.parametrize("fault", ["vertex", "normal", "zero normal", "ghost", "swallowed", "inside out"])
def test_bad_input_makes_no_nan_and_moves_nothing_far(arm: Arm, fault: str) -> None:
    rigid, normals, a, b = arm.fold(0.4)
    ghost = ball((0.0, 0.0, 0.0)) if fault == "swallowed" else ball()
    row = int(np.argmin(np.linalg.norm(rigid - (0.12, 0.06, 0.0), axis=1)))
    if fault == "vertex":
        rigid[row] = np.nan
    elif fault == "normal":
        normals[row] = np.nan
    elif fault == "zero normal":
        normals[row] = 0.0
    elif fault == "ghost":
        ghost.rows[:, 0] = np.nan
    elif fault == "inside out":
        normals = -normals
    seen = arm.solve(rigid, normals, a, b, [ghost])
    finite = np.isfinite(rigid).all(axis=1)
    assert np.isfinite(seen.gpu_vertices[finite]).all()
    assert np.abs(seen.gpu_vertices - rigid)[finite].max() < 0.3
    if fault in ("zero normal", "inside out"):
        found = (seen.lost | seen.gpu_lost) == 0
        assert_close(seen.gpu_vertices[found], seen.vertices[found])
    if fault in ("vertex", "normal"):
        assert seen.gpu_moved[row] == 0
        assert seen.gpu_lost[row] == 1


class Person:
    """A person whole: rigid skin, deformation and corners by both engines."""

    def __init__(self, engine: GpuDeformer, layered: bool) -> None:
        self.avatar = tube_person()
        self.figure = Figure(self.avatar)
        if layered:
            self.figure.layers = SkinLayers(self.figure)
        self.planner = FigurePlanner(self.figure)
        self.skin = GpuSkin(engine, SkinShape.of(self.planner))

    def agree(self, posture: Posture, ghosts: Sequence[GhostSource] = ()) -> None:
        """Every drawn corner lies where the other engine puts it, with the same normal."""
        state = self.figure.pose(posture, ghosts)
        lost = self.figure.deformer.lost > 0
        parts = list(
            zip((self.avatar.mesh, *self.avatar.eyeballs), ((state.vertices, state.normals), *state.eyeballs), strict=True)
        )
        places = np.concatenate([v[m.corner_vertex] for m, (v, _) in parts])
        normals = np.concatenate([n[m.corner_vertex] for m, (_, n) in parts])
        (gpu_places, gpu_normals), _, gpu_lost = run(
            self.skin, self.planner.plan(posture, ghosts).plan, self.planner.planner.places().vertex
        )
        found = np.ones(len(places), np.bool_)
        corner = self.avatar.mesh.corner_vertex
        found[: len(corner)] = ~(lost | (gpu_lost > 0))[corner]
        assert (lost != (gpu_lost > 0)).mean() < 2e-3
        assert_close(gpu_places[found], places[found])
        assert np.isfinite(gpu_places).all()
        assert np.quantile(np.linalg.norm(gpu_normals - normals, axis=1), 0.99) < 5e-3


@pytest.fixture(scope="module")
def person(engine: GpuDeformer) -> Person:
    return Person(engine, layered=False)


@pytest.fixture(scope="module")
def layered(engine: GpuDeformer) -> Person:
    return Person(engine, layered=True)


def embracing(forward: float = 0.0, turned: float = 0.0) -> Posture:
    dofs = standing().dofs.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[SHOULDER[side]] = (0.1, -sign * 1.25, -sign * 0.25)
        dofs[ELBOW[side]] = 0.9
    return Posture(dofs, stance=Stance(np.array([0.05 if forward else 0.0, 0.0, forward]), turned))


def test_a_person_bends_alike(person: Person) -> None:
    dofs = standing().dofs.copy()
    for side in ("left", "right"):
        dofs[ELBOW[side]] = 2.0
    person.agree(Posture(dofs))
    assert person.figure.moved.any()


def test_bulges_beside_folded_joints_stand_out_alike(person: Person) -> None:
    table, dofs = person.figure.skin.bulges, standing().dofs.copy()
    fitted = table.copy()
    dofs[KNEE], dofs[ELBOW["left"]], dofs[ELBOW["right"]] = 1.4, 2.0, 0.6
    table[:, :, 0], table[:, :, 1] = 0.0, 0.0
    flat = person.figure.pose(Posture(dofs)).vertices.copy()
    table[:, 1:, 0], table[:, 1:, 1] = 0.2, 0.1
    try:
        person.agree(Posture(dofs))
        assert np.linalg.norm(person.figure.pose(Posture(dofs)).vertices - flat, axis=1).max() > 3e-3
    finally:
        table[:] = fitted


@pytest.mark.parametrize("angle", [0.0, 1.2, 2.4])
def test_layers_under_the_skin_show_alike(layered: Person, angle: float) -> None:
    dofs = standing().dofs.copy()
    dofs[KNEE] = 0.7 * angle
    for side in ("left", "right"):
        dofs[ELBOW[side]] = angle
    layered.agree(Posture(dofs))
    assert layered.figure.layers is not None
    assert np.abs(layered.figure.layers.moved).max() > 1e-3


def test_two_people_hug_alike(person: Person) -> None:
    other = embracing(0.36, np.pi)
    ghosts = person.figure.ghosts(person.figure.pose(other).posed)
    person.agree(embracing(), [ghosts])
    assert person.figure.moved.mean() > 0.05


def test_a_rigid_thing_presses_a_person_alike(person: Person) -> None:
    person.agree(standing(), [thing("superellipsoid", [0.15, 0.1, 0.12, 0.5, 0.5], (0.0, 1.3, 0.2), 0.0)])
    assert person.figure.moved.any()


def test_the_engine_is_the_cpu_where_the_cpu_draws(surface: GlContext) -> None:
    capability = replace(surface.capability, software=True)
    assert choose_engine("auto", capability) == "cpu"
    assert choose_engine("auto", replace(capability, software=False)) == "gpu"
    assert choose_engine("gpu", capability) == "gpu"
    with pytest.raises(ValueError, match="engine: expected"):
        choose_engine("abacus", capability)


@pytest.mark.parametrize("name", ["deform/skin", "deform/solve", "deform/corner"])
def test_shaders_are_glsl_330_though_drivers_take_more(name: str, tmp_path: Path) -> None:
    validator = shutil.which("glslangValidator")
    if validator is None:
        pytest.skip("glslangValidator (Debian: glslang-tools) is not on this machine")
    file = tmp_path / f"{Path(name).name}.vert"
    file.write_text(source(f"{name}.vert.glsl").replace("#version 330\n", f"#version 330\n{constants()}", 1))
    done = subprocess.run([validator, str(file)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_a_skin_given_back_leaves_no_error(engine: GpuDeformer, arm: Arm) -> None:
    arm.both([ball()])
    assert isinstance(engine.ctx, moderngl.Context)
    assert engine.ctx.error == "GL_NO_ERROR"
