"""People who touch, on the bus: handshake, high five, a hand on a shoulder, as the renderers of two sites and gloves see them.

Motions go through their codec to the real world service; what it says goes to two stages, one at each site.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meeting_hands import AHEAD, CLEAR, SHAKE, SIDEWAYS, UP, mirrored, with_hand
from world_site import TICK_NS, WorldSite

from vistel.figure.body import pose_body, standard_body
from vistel.figure.posture.hands import FLAT, RELAXED
from vistel.figure.posture.posture import Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.messages.world.verify import verify
from vistel.render.stage.stage import Instant, Stage
from vistel.wire.topics import BY_NAME
from vistel.wire.world.decoder import WorldDecoder

SKELETON = standard_skeleton()
BODY = standard_body(SKELETON)
PAIR = ("aiko", "bruno")
Act = Callable[[int], dict[str, Posture]]


def _named(postures: dict[str, Posture]) -> dict[str, Posture]:
    return {"aiko": postures["ann"], "bruno": postures["bob"]}


def handshake(k: int) -> dict[str, Posture]:
    """Together by frame 60, three shakes, apart after 140."""
    grip = RELAXED.copy()
    grip[[4, 8, 12, 16]] += 0.5
    u = min(1.0, k / 60) if k < 140 else max(0.0, 1.0 - (k - 140) / 30)
    up = SHAKE + np.array([0.0, 0.03 * np.sin(0.25 * (k - 60)) if 60 < k < 140 else 0.0, 0.0])
    return _named(mirrored(up, -0.15 + 0.154 * u, AHEAD, SIDEWAYS, RELAXED + (grip - RELAXED) * u))


def high_five(k: int) -> dict[str, Posture]:
    """Palms meet at frame 60 at 0.7 m/s, and go apart."""
    press = 0.006 - abs(k - 60) * 0.012 if abs(k - 60) < 15 else -0.17
    return _named(mirrored(CLEAR + np.array([0.0, 1.45, 0.0]), press, UP, AHEAD, FLAT))


def hand_on_shoulder(k: int) -> dict[str, Posture]:
    """aiko lays a hand on bruno's shoulder by frame 60 and takes it off after 140."""
    bruno = Posture(standing().dofs, standing().hands, Stance(CLEAR, np.pi))
    shoulder = pose_joints(SKELETON, bruno).position[JOINT_INDEX["left_upper_arm"]]
    u = min(1.0, k / 60) if k < 140 else max(0.0, 1.0 - (k - 140) / 30)
    aiko = with_hand(shoulder + np.array([-0.03, 0.20 - 0.135 * u, 0.0]), AHEAD, -UP, 0.0, FLAT)
    return {"aiko": aiko, "bruno": bruno}


@dataclass
class Renderer:
    """What the renderer of a site hears, and what it would draw at each tick."""

    site: WorldSite
    name: str
    stage: Stage = field(default_factory=lambda: Stage(0))
    room: WorldDecoder = field(default_factory=WorldDecoder)
    drawn: list[Instant] = field(default_factory=list)

    def __post_init__(self) -> None:
        bus = self.site.network.bus("demo", self.name, self.site.clock)
        self._inboxes = {n: bus.subscribe(BY_NAME[n], queue_all=True) for n in ("participant", "motion", "world_state")}

    def tick(self) -> None:
        now = self.site.clock.now_ns()
        for s in self._inboxes["participant"].take():
            self.stage.receive_participant(s.message)
        for s in self._inboxes["motion"].take():
            self.stage.receive_motion(s.names["participant"], s.message, now)
        for s in self._inboxes["world_state"].take():
            for room in self.room.read(s.message):
                self.stage.receive_world(room, now)
        self.drawn.append(self.stage.instant(now))


def ghosts(instant: Instant) -> dict[tuple[str, str], tuple[int, ...]]:
    """Who deforms whom of the two, and which limbs of the target."""
    return {
        (g.target, g.source): tuple(sorted(g.target_primitives)) for g in instant.world.ghosts if {g.target, g.source} == set(PAIR)
    }


def gap(instant: Instant) -> float:
    """How deep the two are in each other as this site shows them [m]; negative: apart."""
    sets = []
    for who in PAIR:
        posture = next(p.posture for p in instant.people if p.about.name == who)
        b = pose_body(BODY, pose_joints(SKELETON, posture))
        sets.append(PrimitiveSet.of_cone_spheres(b.a, b.b, b.radius_a, b.radius_b))
    return max((float(d) for d in find_contacts(*sets, margin=0.1).depth), default=-0.1)


@dataclass
class Seen:
    """Of a whole scene: instants of both renderers by tick, forces by hand and step, contacts of whole messages."""

    one: list[Instant]
    other: list[Instant]
    forces: list[Any]
    keys: list[Any]


def seen(folder: Path, act: Act, frames: int) -> Seen:
    async def whole() -> Seen:
        site = WorldSite(folder)
        async with site.open():
            site.away |= {"chidi"}
            site.posture = lambda who, t_s: act(round(t_s * 60))[who]  # type: ignore[method-assign]
            renderers = Renderer(site, "tokyo"), Renderer(site, "paris")
            for _ in range(frames):
                await site.play(1 / 60)
                for r in renderers:
                    r.tick()
            await site.clock.advance_to_ns(site.clock.now_ns() + TICK_NS)
            site.record()
        report = verify(site.log)
        assert report.equal and report.difference == ""
        forces = [m for topic, _, m, _ in site.log if topic == "hand_force"]
        return Seen(renderers[0].drawn, renderers[1].drawn, forces, site.keys())

    return asyncio.run(whole())


def check_both_see_it(s: Seen) -> list[int]:
    """Both renderers show the same pairs with the same limbs; the ticks in which the two touch."""
    touching: list[int] = []
    for k, (a, b) in enumerate(zip(s.one, s.other, strict=True)):
        pairs = ghosts(a)
        assert pairs == ghosts(b), k
        if pairs:
            assert set(pairs) == {PAIR, PAIR[::-1]}, k  # both deform
            assert all(pairs.values())
            touching.append(k)
    assert touching
    return touching


def pushes(forces: list[Any], who: str, other: str) -> dict[int, np.ndarray]:
    """Force (3,) of `other` on the hands of `who` by step [N]."""
    out: dict[int, np.ndarray] = {}
    for m in forces:
        if m.participant == who:
            f = [np.array([t.force.x, t.force.y, t.force.z]) for t in m.touches if t.body == other]
            if f:
                out[m.step] = out.get(m.step, np.zeros(3)) + sum(f, np.zeros(3))
    return out


def test_a_handshake_deforms_both_at_both_sites_and_gloves_feel_opposite_forces(tmp_path: Path) -> None:
    s = seen(tmp_path, handshake, 200)
    touching = check_both_see_it(s)
    assert 70 < len(touching) < 150 and touching[0] > 30 and touching[-1] < 190
    for drawn in (s.one, s.other):  # while they are together in the picture (what is told outlasts a touch by half a second)
        assert min(gap(drawn[k]) for k in range(66, 138, 9)) > 0.0
    # Fingers of both hands close round the other's: the hand's own limbs deform.
    parts = ("hand", "palm", "index")
    hands = {i for i, name in enumerate(BODY.names) if name.startswith("right") and any(d in name for d in parts)}
    for who in PAIR:
        pair = (who, next(p for p in PAIR if p != who))
        assert any(set(ghosts(s.one[k])[pair]) & hands for k in touching)
    one, other = pushes(s.forces, *PAIR), pushes(s.forces, *PAIR[::-1])
    assert len(one.keys() & other.keys()) > 60
    for step in one.keys() & other.keys():
        # Level; upwards each hand also feels the other's forearm, which has no part in what is told of that hand.
        assert one[step][[0, 2]] == pytest.approx(-other[step][[0, 2]], abs=0.03 + 0.03 * float(np.linalg.norm(one[step])))
    contacts = [c for m in s.keys for c in m.contacts if {c.body_a, c.body_b} == set(PAIR)]
    assert contacts and all(c.force > 0.0 for c in contacts)
    # Told once that it is over, to each.
    for who in PAIR:
        assert not [m for m in s.forces if m.participant == who and m.right][-1].touches


def test_a_high_five_is_seen_and_felt_for_a_moment_at_both_sites(tmp_path: Path) -> None:
    s = seen(tmp_path, high_five, 110)
    touching = check_both_see_it(s)
    assert len(touching) <= 40 and touching[0] >= 57
    one, other = pushes(s.forces, *PAIR), pushes(s.forces, *PAIR[::-1])
    both = sorted(one.keys() & other.keys())
    assert 1 <= len(both) <= 8
    peak = max(both, key=lambda step: float(np.linalg.norm(one[step])))
    assert abs(float(one[peak][2])) > 1.0
    assert one[peak][2] == pytest.approx(-other[peak][2], rel=0.03)


def test_a_hand_on_a_shoulder_deforms_the_shoulder_at_both_sites_and_the_hand_feels_it(tmp_path: Path) -> None:
    s = seen(tmp_path, hand_on_shoulder, 200)
    touching = check_both_see_it(s)
    assert touching[0] > 20 and touching[-1] < 190
    middle = s.one[touching[len(touching) // 2]]
    on = {BODY.names[i] for i in ghosts(middle)[("bruno", "aiko")]}
    assert on and not any("hand" in n or "index" in n or "palm" in n for n in on)
    felt = pushes(s.forces, "aiko", "bruno")
    assert len(felt) > 40
    assert all(f[1] > 0.0 for f in felt.values() if np.linalg.norm(f) > 0.2)  # the shoulder bears it
    assert not pushes(s.forces, "bruno", "aiko")  # his own hands have no part in it
