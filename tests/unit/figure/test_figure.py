"""A figure as a whole: rest, articulation through the implicit model, touching oneself, others and things."""

import math

import numpy as np
import pytest
from figure_fixture import tube_person
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.figure import Figure, vertex_normals
from vistel.figure.figure_limbs import limbs_of
from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, Stance, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.implicit.meshes.embedding import embed


@pytest.fixture(scope="module")
def person():
    return tube_person()


@pytest.fixture(scope="module")
def figure(person):
    return Figure(person)


def ball(centre, radius=0.09, compliance=0.0):
    shape = PrimitiveSet.of_kinds(["sphere"], [[radius]], np.eye(3)[None], np.array([centre], float))
    return ghosts_of(shape, compliance=compliance)


def arms(elbow: float = 0.0, shoulder=(0.0, 0.0, 0.0)) -> Posture:
    dofs = np.zeros(25)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[ELBOW[side]] = elbow
        dofs[SHOULDER[side]] = (shoulder[0], sign * shoulder[1], sign * shoulder[2])
    return Posture(dofs)


def rigid_only(figure, posture, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(Deformer, "deform", lambda *_: None)
        return figure.pose(posture).vertices.copy()


def test_wrinkles_survive_on_a_figure_but_not_where_it_is_touched(figure):
    high = np.full(len(figure.avatar.mesh.vertices), 0.003, np.float32)
    plain = figure.pose(Posture()).vertices.copy()
    laid = figure.pose(Posture(), (), high).vertices
    assert np.linalg.norm(laid - plain, axis=1) == pytest.approx(0.003, abs=1e-6)
    chest = figure.pose(Posture()).joints.position[JOINT_INDEX["head"]] - (0.0, 0.3, 0.0)
    touching = [ball(np.add(chest, (0.0, 0.0, 0.14)))]
    pressed = figure.pose(Posture(), touching).vertices.copy()
    assert figure.moved.sum() > 10
    moved = figure.moved > 0
    extra = np.linalg.norm(figure.pose(Posture(), touching, high).vertices - pressed, axis=1)
    assert extra[moved].min() < 1e-4
    assert extra.max() == pytest.approx(0.003, abs=1e-5)
    np.testing.assert_array_equal(figure.pose(Posture()).vertices, plain)  # and it leaves nothing behind


def test_the_rest_posture_moves_nothing(figure, person):
    state = figure.pose(Posture())
    assert state.report.moved == 0
    np.testing.assert_allclose(state.vertices, person.mesh.vertices, atol=1e-7)


def test_vertices_nothing_touches_stay_exactly_where_the_joints_put_them(figure, monkeypatch):
    posture = arms(2.0, (0.2, -0.5, -0.6))
    rigid = rigid_only(figure, posture, monkeypatch)
    state = figure.pose(posture, [ball((0.0, 1.6, 0.19))])
    still = figure.moved == 0
    assert still.any()
    assert (~still).any()
    np.testing.assert_array_equal(state.vertices[still], rigid[still])


def test_a_bent_elbow_is_shaped_by_the_implicit_model(figure, person, monkeypatch):
    posture = arms(math.radians(150))
    rigid = rigid_only(figure, posture, monkeypatch)
    state = figure.pose(posture)
    elbow = state.joints.position[JOINT_INDEX["left_lower_arm"]]
    near = np.linalg.norm(rigid - elbow, axis=1) < 0.09
    assert np.count_nonzero(np.linalg.norm(state.vertices - rigid, axis=1)[near] > 1e-3) > 10
    assert state.report.lost <= 4


def test_folded_forearm_and_upper_arm_meet_in_the_crease_without_overlap(figure, person):
    state = figure.pose(arms(math.radians(140)))
    limb = person.mesh.limb
    names = list(person.body.names)
    upper, fore = names.index("left_upper_arm"), names.index("left_forearm")
    elbow = state.joints.position[JOINT_INDEX["left_lower_arm"]]
    u = state.posed.b[upper] - state.posed.a[upper]
    w = state.posed.b[fore] - state.posed.a[fore]
    # The plane that halves the angle: every limb's skin stays on its own side, a mesh edge's length aside.
    across = w / np.linalg.norm(w) + u / np.linalg.norm(u)
    across /= np.linalg.norm(across)
    beyond = np.linalg.norm(state.vertices - elbow, axis=1) > 0.06
    assert np.max(((state.vertices - elbow) @ across)[(limb == upper) & beyond]) < 0.012
    assert np.min(((state.vertices - elbow) @ across)[(limb == fore) & beyond]) > -0.012


def test_a_hand_pressed_on_the_chest_dents_both(figure, person):
    posture = arms(2.3, (0.0, -1.3, -0.45))
    state = figure.pose(posture)
    limb = np.array(person.body.names)[person.mesh.limb]
    hand = np.char.find(limb.astype(str), "left_palm") >= 0
    chest = np.isin(limb, ["chest", "breast", "waist"])
    touching = state.report.delta.max() > 0
    assert touching
    assert figure.moved[chest].any()
    assert figure.moved[hand].any() or figure.moved[np.char.startswith(limb.astype(str), "left_")].any()


def shown_field(figure, posed, points):
    """What others see of a figure at points of its skin: the largest field of the vertex's own and adjacent limbs."""
    e = figure.embedding
    fields, out = figure.fields(posed, points), np.zeros(len(points))
    for g in range(e.limbs.groups):
        rows = np.flatnonzero(e.group == g)
        same = [g] + [k for of, k in e.overlap if of == g]
        out[rows] = fields[np.ix_(same, rows)].max(axis=0)
    return out


@pytest.mark.parametrize("apart", [0.48, 0.46, 0.42, 0.36])
def test_two_figures_agree_on_their_contact_surface(person, apart):
    one, two = Figure(person), Figure(person)
    # The left side of one against the right of the other.
    a, b = Posture(standing().dofs), Posture(standing().dofs, stance=Stance(np.array([apart, 0.0, 0.02]), 0.2))
    posed_a, posed_b = one.pose(a).posed, two.pose(b).posed
    for figure, posture, own, foreign in ((one, a, posed_a, posed_b), (two, b, posed_b, posed_a)):
        alone = figure.pose(posture).vertices.copy()
        state = figure.pose(posture, [one.ghosts(foreign)])
        assert state.report.delta.max() > 0.005
        theirs = figure.fields(foreign, state.vertices).max(axis=0)
        overlap = (theirs - shown_field(figure, own, state.vertices))[figure.deformer.lost == 0]
        # Nobody is inside the other, at joints as little as elsewhere, and they share a surface.
        assert overlap.max() <= 1e-4
        pressed = (np.linalg.norm(state.vertices - alone, axis=1) > 1e-3)[figure.deformer.lost == 0]
        assert np.count_nonzero(np.abs(overlap[pressed]) <= 1e-4) > 20
        # Caps of the palm's tubes that lie inside other tubes have little room.
        assert state.report.lost < 0.04 * state.report.moved


def test_posing_is_deterministic_and_reuses_its_buffers(figure):
    posture, other = arms(1.2, (0.1, -0.3, 0.2)), arms(0.3)
    first = figure.pose(posture, [ball((0.0, 1.6, 0.19))])
    kept = first.vertices.copy()
    second = figure.pose(other)
    assert second.vertices is first.vertices
    np.testing.assert_array_equal(figure.pose(posture, [ball((0.0, 1.6, 0.19))]).vertices, kept)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_any_posture_and_any_ghosts_give_finite_skin_within_its_room(figure, seed):
    rng = np.random.default_rng(seed)
    dofs = rng.uniform(-1.2, 1.2, 25)
    dofs[5:8] *= 0.03
    dofs[[0, 1, 14, 21]] = rng.uniform(0, 2.5, 4)
    dofs[0] *= 0.2
    posture = Posture(dofs, rng.uniform(0, 1.6, (2, 20)))
    ghosts = [ball(rng.normal(size=3) * 0.3 + (0, 1.2, 0), 0.12, float(c)) for c in (0.0, 0.3, 1.0)]
    state = figure.pose(posture, ghosts)
    assert np.isfinite(state.vertices).all()
    assert np.isfinite(state.normals).all()
    np.testing.assert_allclose(np.linalg.norm(state.normals, axis=1), 1.0, atol=1e-3)
    low, high = state.posed.a.min(axis=0) - 0.35, state.posed.a.max(axis=0) + 0.35
    assert np.all(state.vertices > low)
    assert np.all(state.vertices < high)


def test_a_person_is_calibrated_with_weights_near_one(figure):
    e = figure.embedding
    assert np.isfinite(e.weight).all()
    assert 0.5 < np.median(e.weight) < 1.5
    assert len(e.limbs.hinges) == 4
    assert np.all((e.mu >= 0) & (e.mu <= 1) & (e.alpha >= 0) & (e.alpha <= 1))
    assert np.all(e.mu[e.hinge < 0] == 0.0)


def test_skin_that_faces_along_its_limb_is_not_thrown_aside_by_a_touch(person):
    """A nostril: in the normal's direction the field hardly changes."""

    mesh, normals = person.mesh, vertex_normals(person.mesh)
    limbs = limbs_of(person.skeleton, person.body)
    free = embed(mesh.vertices, mesh.limb, limbs)
    arm = np.flatnonzero(mesh.limb == person.body.names.index("left_forearm"))
    along = normals.copy()
    along[arm[::2]] = (1.0, 0.0, 0.0)
    held = embed(mesh.vertices, mesh.limb, limbs, None, along)
    middle = arm[np.abs(mesh.vertices[arm, 0] - mesh.vertices[arm, 0].mean()) < 0.08]
    odd = np.isin(middle, arm[::2])
    assert np.all(held.outward[middle[odd]] < 0.3 * free.outward[middle[odd]])
    np.testing.assert_allclose(held.inward[middle[~odd]], free.inward[middle[~odd]])
