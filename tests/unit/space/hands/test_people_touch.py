"""People touch people: handshake, high five, a hand on a shoulder. Both deform, both feel the same, the other way round."""

from __future__ import annotations

import numpy as np
import pytest
from meeting_hands import AHEAD, BUILD, CLEAR, SHAKE, SIDEWAYS, UP, mirrored, with_hand
from test_world_steps import SKELETON, STEP_NS

from vistel.figure.posture.hands import FLAT, RELAXED
from vistel.figure.posture.posture import Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.room import meeting_room
from vistel.space.view import HandForce, WorldView
from vistel.space.world import World


class Meeting:
    """Two people in a room, from step to step."""

    def __init__(self) -> None:
        self.world, self.k = World(meeting_room(2)), 0

    def step(self, postures: dict[str, Posture]) -> WorldView:
        self.k += 1
        people = tuple(ParticipantBody(p) for p in ("ann", "bob")) if self.k == 1 else ()
        motions = tuple(MotionInput(who, p, self.k, self.k * STEP_NS) for who, p in sorted(postures.items()))
        return self.world.step(StepInputs(self.k, self.k * STEP_NS, people, motions))


def right(view: WorldView, who: str) -> HandForce | None:
    return next((h for h in view.hands if h.participant == who and h.right and h.touches), None)


def ghosts(view: WorldView) -> set[tuple[str, str]]:
    return {(g.target, g.source) for g in view.ghosts if {g.target, g.source} == {"ann", "bob"}}


def between(view: WorldView) -> list:
    return [c for c in view.contacts if {c.body_a, c.body_b} == {"ann", "bob"}]


def felt_of_each_other(view: WorldView) -> tuple[np.ndarray, np.ndarray]:
    """Force on ann's right hand by bob, and on bob's by ann."""
    ann, bob = right(view, "ann"), right(view, "bob")
    assert ann is not None and bob is not None
    felt = [sum((t.force for t in h.touches if t.body == other), np.zeros(3)) for h, other in ((ann, "bob"), (bob, "ann"))]
    assert np.linalg.norm(felt[0]) > 0.1
    return felt[0], felt[1]


def test_in_a_handshake_both_hands_deform_and_feel_each_other() -> None:
    play = Meeting()
    grip = RELAXED.copy()
    grip[[4, 8, 12, 16]] += 0.5
    apart = mirrored(SHAKE, -0.15, AHEAD, SIDEWAYS, RELAXED)
    assert not between(play.step(apart))
    for k in range(30):
        view = play.step(mirrored(SHAKE, min(0.004, -0.03 + 0.002 * k), AHEAD, SIDEWAYS, RELAXED + (grip - RELAXED) * k / 29))
    assert ghosts(view) == {("ann", "bob"), ("bob", "ann")}
    assert all(c.force > 0.0 and c.depth > 0.0 for c in between(view))
    on_ann, on_bob = felt_of_each_other(view)
    assert on_ann == pytest.approx(-on_bob, abs=1e-6 * float(np.linalg.norm(on_ann)))
    ann, bob = right(view, "ann"), right(view, "bob")
    assert ann is not None and bob is not None
    assert {t.digit for t in ann.touches if t.body == "bob"} and {t.digit for t in bob.touches if t.body == "ann"}
    # Up and down together: the contact goes along.
    low = np.mean([c.point for c in between(view)], axis=0)
    for k in range(12):
        up = SHAKE + np.array([0.0, 0.004 * (k + 1), 0.0])
        view = play.step(mirrored(up, 0.004, AHEAD, SIDEWAYS, grip))
    assert np.mean([c.point for c in between(view)], axis=0)[1] - low[1] == pytest.approx(0.048, abs=0.01)
    view = play.step(apart)
    assert not between(view) and not ghosts(view)
    # Told once that it is over.
    assert [h.touches for h in view.hands if h.right] == [(), ()]


def test_a_high_five_is_short_and_each_feels_the_others_palm() -> None:
    play = Meeting()
    place = CLEAR + np.array([0.0, 1.45, 0.0])
    touched: list[bool] = []
    peak = 0.0
    for k in range(40):
        off = abs(k - 20) * 0.012 - 0.006  # 0.7 m/s, together for a moment
        view = play.step(mirrored(place, -off, UP, AHEAD, FLAT))
        touched.append(bool(between(view)))
        if touched[-1]:
            assert ghosts(view) == {("ann", "bob"), ("bob", "ann")}
            ann, bob = right(view, "ann"), right(view, "bob")
            assert (ann is None) == (bob is None)
            if ann is not None:
                on_ann, on_bob = felt_of_each_other(view)
                # Across the palms; a wrist that is touched as well is not felt by its own hand.
                assert on_ann[2] == pytest.approx(-on_bob[2], rel=0.02)
                peak = max(peak, abs(float(on_ann[2])))
    assert 1 <= sum(touched) <= 6 and not touched[0] and not touched[-1]
    assert peak > 1.0


def test_a_hand_on_a_shoulder_deforms_both_and_is_felt_by_the_hand() -> None:
    play = Meeting()
    bob = standing()
    bob = Posture(bob.dofs, bob.hands, Stance(CLEAR, np.pi))
    pose = pose_joints(SKELETON, bob)
    shoulder = pose.position[JOINT_INDEX["left_upper_arm"]]
    for height in (0.20, 0.16, 0.12, 0.10, 0.08, 0.07, 0.06, 0.05, 0.045, 0.04):
        ann = with_hand(shoulder + np.array([-0.03, height, 0.0]), AHEAD, -UP, 0.0, FLAT)
        view = play.step({"ann": ann, "bob": bob})
        felt = right(view, "ann")
        if felt is not None and np.linalg.norm(felt.force) > 0.5:
            break
    contacts = between(view)
    assert contacts and ghosts(view) == {("ann", "bob"), ("bob", "ann")}
    on = {BUILD.body.names[c.primitive_b if c.body_b == "bob" else c.primitive_a] for c in contacts}
    assert not any("hand" in name or "palm" in name or "index" in name for name in on)  # bob's hand has no part in it
    felt = right(view, "ann")
    assert felt is not None and {t.body for t in felt.touches} == {"bob"}
    assert felt.force[1] > 0.0  # the shoulder bears it
    assert not [h for h in view.hands if h.participant == "bob" and h.touches]


def test_what_two_people_feel_of_each_other_is_the_same_in_a_run_again() -> None:
    play, again = Meeting(), Meeting()
    for k in range(10):
        postures = mirrored(SHAKE, -0.01 + 0.002 * k, AHEAD, SIDEWAYS, RELAXED)
        a, b = play.step(postures), again.step(postures)
        assert [h.force.tobytes() for h in a.hands] == [h.force.tobytes() for h in b.hands]
    assert play.world.snapshot() == again.world.snapshot()
