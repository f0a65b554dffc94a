"""Layers of clothes in motion: skin and what is worn beneath stay under what is over them, and hems go with their cloth."""

from functools import cache

import numpy as np
import pytest

from benchmarks.figures.poking import Covered
from vistel.figure.avatar.avatar import Avatar, clothes
from vistel.figure.body_model.assemble import assemble
from vistel.figure.body_model.model import body_model
from vistel.figure.body_model.person import Person, fit
from vistel.figure.clothes.blazer import BLAZER, blazer
from vistel.figure.clothes.build import Build
from vistel.figure.clothes.legs import LegCut, trousers
from vistel.figure.clothes.outfit import outfit
from vistel.figure.clothes.wardrobe import Outfit
from vistel.figure.clothes.weave import Weave
from vistel.figure.figure import Figure, vertex_normals
from vistel.figure.hems import with_hems_outwards
from vistel.figure.part import joined
from vistel.figure.posture.posture import ELBOW, WRIST, Posture, pose_joints, standing
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX
from vistel.figure.swing.hanging import distances
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import ghosts_of

TURNS = ((0.0, 0.0, 0.0), (1.2, 0.5, 0.2), (-1.2, -0.6, 0.0))
"""Of a wrist [rad]."""


@cache
def bare() -> Avatar:
    """In one grey: a painted skin would take longer than all the rest."""
    return assemble(body_model(), fit(Person("male", 45.0, 1.80, 80.0)).shape, name="bare")


@cache
def dressed(top: str) -> Avatar:
    return joined(bare(), outfit(bare(), Outfit(top)))


def with_wrists(turn: tuple[float, float, float]) -> Posture:
    dofs = standing().dofs.copy()
    for side in ("left", "right"):
        dofs[WRIST[side]], dofs[ELBOW[side]] = turn, 1.2
    return Posture(dofs)


@pytest.mark.parametrize("top", ["sweater", "shirt", "blazer"])
@pytest.mark.parametrize("turn", TURNS)
def test_nothing_comes_through_a_cuff_when_the_hand_turns(top: str, turn: tuple[float, float, float]) -> None:
    avatar = dressed(top)
    covered, names = Covered.of(avatar), np.array(avatar.body.names)
    out = covered.through(Figure(avatar).pose(with_wrists(turn)).vertices)
    at_wrists = np.char.endswith(names[avatar.mesh.limb[covered.vertex]], "forearm")
    assert at_wrists.sum() > 12
    assert not (out[at_wrists] > 0.001).any()


@pytest.mark.parametrize(("top", "most"), [("sweater", 0.08), ("blazer", 0.06)])
def test_the_front_of_a_top_goes_along_with_the_thighs_of_who_sits(top: str, most: float) -> None:
    avatar = dressed(top)
    worn = clothes(avatar)
    thighs = np.array([k for k, name in enumerate(avatar.body.names) if name.endswith("thigh")], np.int32)
    cloth = worn == worn[worn >= 0].min()

    def inside(posture: Posture) -> np.ndarray:
        state = Figure(avatar).pose(posture)
        return -distances(state.vertices[cloth].astype(np.float64), state.posed, thighs).min(axis=1)

    deeper = inside(standard_postures()["sitting"]) - np.maximum(0.0, inside(Posture()))
    # Skin folds there, too, and goes into the thighs.
    assert deeper.max() < most


def test_no_skin_comes_through_where_shirt_and_trousers_meet_on_who_sits() -> None:
    avatar = dressed("blazer")
    covered, names = Covered.of(avatar), np.array(avatar.body.names)
    out = covered.through(Figure(avatar).pose(standard_postures()["sitting"]).vertices)
    belly = covered.skin & np.isin(names[avatar.mesh.limb[covered.vertex]], ["crotch", "pelvis", "abdomen"])
    assert not out[belly].any()


def test_the_buckle_of_a_belt_is_left_out_under_a_jacket() -> None:
    whole = trousers("trousers", Build.of(bare()), LegCut(), Weave(), 0, belt=True)
    jacket = blazer("blazer", Build.of(bare()), BLAZER, Weave(), 0)
    assert len(whole.details) == 1
    assert not whole.beneath(Build.of(bare()), [jacket], 0.02).details


def test_no_heel_comes_through_a_shoe_without_a_sock() -> None:
    body = assemble(body_model(), fit(Person("female", 73.0, 1.59, 64.0, origin=(1.0, 0.0, 0.0))).shape, name="bare")
    avatar = joined(body, outfit(body, Outfit("shirt", bottom="skirt")))
    covered, names = Covered.of(avatar), np.array(body.body.names)
    foot = np.char.endswith(names[avatar.mesh.limb[covered.vertex]], "foot") & covered.skin
    assert foot.any()
    out = covered.through(avatar.mesh.vertices)[foot]
    assert not out.any()


def test_what_is_pushed_through_a_sweater_is_found_and_by_how_much() -> None:
    avatar = dressed("sweater")
    covered, mesh = Covered.of(avatar), avatar.mesh
    arm = avatar.body.names.index("left_forearm")
    row = np.flatnonzero((mesh.limb[covered.vertex] == arm) & covered.skin)
    way = vertex_normals(mesh)[covered.vertex[row]]
    found: list[np.ndarray] = []
    for push in np.arange(0.0, 0.021, 0.002, dtype=np.float32):
        pushed = mesh.vertices.copy()
        pushed[covered.vertex[row]] += push * way
        found.append(covered.through(pushed)[row])
    assert not found[0].any()
    assert (found[-1] > 0.002).mean() > 0.5
    out = np.array(found)
    grew = np.diff(out, axis=0)[(out[:-1] > 0.0) & (out[1:] > 0.0)]
    # Cloth slants at a cuff: what is pushed by 2 mm comes out of it by as much, or somewhat more.
    assert grew.min() > 0.0019
    assert np.median(grew) < 0.0025


def test_a_hem_is_pressed_with_the_cloth_that_it_is_folded_from() -> None:
    avatar = dressed("sweater")
    figure, mesh, worn = Figure(avatar), avatar.mesh, clothes(avatar)
    joints = pose_joints(avatar.skeleton, Posture())
    wrist = joints.position[JOINT_INDEX["left_hand"]]
    ball = wrist + np.array((-0.005, 0.075, 0.0))
    ghost = ghosts_of(PrimitiveSet.of_kinds(["sphere"], [[0.05]], np.eye(3)[None], ball[None]), compliance=0.0)
    posed = figure.pose(Posture(), [ghost]).vertices.copy()
    # The rim of a cuff and the first row of its hem are vertices of their own at the same places.
    cuff = np.flatnonzero((worn >= 0) & (np.linalg.norm(mesh.vertices - wrist, axis=1) < 0.07))
    same = np.linalg.norm(mesh.vertices[cuff][:, None] - mesh.vertices[cuff][None], axis=2) < 1e-6
    one, other = np.nonzero(np.triu(same, 1))
    pressed = np.linalg.norm(posed[cuff] - figure.pose(Posture()).vertices[cuff], axis=1)
    assert pressed[one].max() > 0.005
    assert np.abs(pressed[one] - pressed[other]).max() < 0.0015


def test_normals_of_people_whose_clothes_are_painted_on_are_left() -> None:
    normals = np.zeros((len(bare().mesh.vertices), 3), np.float32)
    assert with_hems_outwards(bare(), normals) is normals
