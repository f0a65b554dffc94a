"""What people do with things together, measured: flights against parabolas, tugs against strengths, stacks against time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_together import FAR
from test_world_steps import Play, at, reaching, take_baton

from vistel.figure.posture.posture import Posture
from vistel.space.hands.claims import ClaimChange
from vistel.space.holding.sharing import STRENGTH
from vistel.space.inputs import StepInputs
from vistel.space.room import BATON, TABLE_HEIGHT, meeting_room
from vistel.space.view import WorldView
from vistel.space.world import World

G, DT = 9.81, 1.0 / 60.0


def thrown(up: float, ahead: float) -> list[np.ndarray]:
    """Where a baton is from the step in which a hand lets it go, over the room's middle, until it is low."""
    play = Play("ann")
    take_baton(play)
    for k in range(50):
        play.step({"ann": reaching(at(0.0, 0.008 * k, 0.0), 1.0)})
    place = at(0.0, 0.4, 0.0)
    for k in range(30):
        place = place + np.array([0.0, up * DT * min(1.0, k / 10), ahead * DT * min(1.0, k / 10)])
        play.step({"ann": reaching(place, 1.0 if k < 24 else max(0.0, 1.0 - (k - 23) / 3))})
        if not play.grasps():
            break
    assert play.grasps() == []
    first = play.thing(BATON)
    out = [first.position]
    speed = first.velocity.copy()
    while out[-1][1] > TABLE_HEIGHT + 0.15 and len(out) < 90:
        place = place + np.array([0.0, 0.02, -0.02])  # the hand goes away
        play.step({"ann": reaching(place, 0.0)})
        out.append(play.thing(BATON).position)
    return [speed, *out]


@pytest.mark.parametrize(("up", "ahead"), [(1.0, 1.0), (0.0, 1.5)])
def test_what_is_thrown_flies_along_the_parabola_to_within_a_few_millimetres(up: float, ahead: float) -> None:
    speed, *flight = thrown(up, ahead)
    assert speed[2] == pytest.approx(ahead, rel=0.12)
    way = np.array(flight) - flight[0]
    n = len(way)
    assert n > 12
    t = np.arange(n) * DT
    parabola = speed[None, :] * t[:, None] - 0.5 * G * np.outer(t * t, (0.0, 1.0, 0.0))
    # Steps in which the speed changes first fall short by g t dt / 2 of substeps of a quarter.
    assert np.abs(way - parabola).max() < 0.5 * G * t[-1] * DT / 4 + 0.004


def two_fingers(grip: np.ndarray, closing: float, heading: float) -> Posture:
    """Holds with thumb, index and middle finger; the others stay straight."""
    posture = reaching(grip, closing, heading)
    hands = posture.hands.copy()
    hands[1, 12:] = 0.0
    return replace(posture, hands=hands)


@pytest.mark.parametrize("names", [("ann", "bob"), ("bob", "ann")])
def test_a_tug_goes_to_the_whole_hand_and_not_to_two_fingers_whoever_they_are(names: tuple[str, str]) -> None:
    weak, strong = names
    play = Play(*sorted(names))
    for k in range(25):
        play.step({weak: two_fingers(at(0.0, 0.0, 0.0), k / 20 if k < 20 else 1.0, 0.0)})
    for k in range(26):
        play.step({weak: two_fingers(at(0.0, 0.01 * k, 0.0), 1.0, 0.0)})
    assert play.grasps() == [weak]
    for k in range(40):
        hands = {weak: two_fingers(at(0.0, 0.25, 0.0), 1.0, 0.0), strong: reaching(FAR, min(1.0, k / 25), np.pi)}
        play.step(hands)
    assert sorted(play.grasps()) == sorted(names)
    engaged = {g.participant: sum(g.engaged) for g in play.world._state.grasps}
    assert engaged[weak] < engaged[strong]
    pulls: list[float] = []
    for k in range(60):
        off = np.array([0.0012 * (k + 1), 0.0, 0.0])
        play.step({weak: two_fingers(at(0.0, 0.25, 0.0), 1.0, 0.0), strong: reaching(FAR + off, 1.0, np.pi)})
        if play.grasps() == [strong]:
            break
        pulls.append(max((float(np.linalg.norm(h.pull)) for h in play.views[-1].hands), default=0.0))
    assert play.grasps() == [strong]
    bears = STRENGTH * (1 + engaged[weak]) / 5
    assert bears * 0.9 < max(pulls) < STRENGTH  # it slipped at what the weak hand bears, long before the strong one's limit
    last = [e for v in play.views for e in v.claims if e.change is ClaimChange.GRANTED][-1]
    assert last.participant == strong


def test_five_boxes_on_each_other_stand_still_for_ten_seconds() -> None:
    room = meeting_room(3)
    box = room.thing("box")
    half = max(float(p.params[1]) for p in box.primitives)
    stack = tuple(replace(box, id=f"b{k}", position=np.array([-0.25, TABLE_HEIGHT + half * (2 * k + 1), 0.22])) for k in range(5))
    world = World(replace(room, things=(*room.things, *stack)))
    view: WorldView | None = None
    start: np.ndarray | None = None
    for k in range(1, 661):
        view = world.step(StepInputs(k, k * 16_666_667))
        if k == 60:
            start = np.array([s.position for s in view.states if s.id in {b.id for b in stack}])
    assert view is not None and start is not None
    end = np.array([s.position for s in view.states if s.id in {b.id for b in stack}])
    assert np.abs(end - start).max() < 0.0005
    assert all(s.resting for s in view.states if s.id in {b.id for b in stack})
