"""What each of a crowd does, encoded ahead: the people of the made-up meeting, moved to everybody's seat and out of step."""

from __future__ import annotations

from dataclasses import dataclass, replace

from vistel.conference.model import Conference
from vistel.conference.seats import seat_place
from vistel.figure.posture.posture import Posture, Stance
from vistel.geometry.rotation import rotation_y
from vistel.messages.postures import sample_of
from vistel.space.room import TABLE_SEATS, seat_pose
from vistel.wire.motion import MotionEncoder
from vistel.wire.motion.publication import THIN_HZ
from vistel_sim.motion.meeting import Meeting
from vistel_sim.motion.source import simulated_people

FRAMES = 240
"""Of a loop, at 60 Hz, there and back; a multiple of the frames between full ones of both streams."""
THIN = round(60 / THIN_HZ)
"""Frames from one of the thin motion to the next."""
LATE = 97
"""Frames by which the next one who does the same is behind."""


@dataclass(frozen=True)
class MotionLoop:
    """The frames of one participant, as `Motion.frame` has them: in full, and thin."""

    full: tuple[bytes, ...]
    thin: tuple[bytes, ...]


def motion_loops(conference: Conference, numbers: range) -> list[MotionLoop]:
    """The loops of the participants with these numbers."""
    played = _played()
    out: list[MotionLoop] = []
    for i in numbers:
        own, there = played[i % TABLE_SEATS], seat_pose(TABLE_SEATS, i % TABLE_SEATS)
        here = seat_place(conference.room, i)
        postures = [_moved(own[(k + LATE * (i // TABLE_SEATS)) % FRAMES], there, here) for k in range(FRAMES)]
        full, thin = MotionEncoder(), MotionEncoder(losses="many")
        times = [k * 1_000_000_000 // 60 for k in range(FRAMES)]
        samples = [
            sample_of(p, k + 1, t_ns, gaze=p.gaze, face=None, lids=None)
            for k, (p, t_ns) in enumerate(zip(postures, times, strict=True))
        ]
        out.append(
            MotionLoop(
                tuple(full.encode(s).frame for s in samples),
                tuple(thin.encode(replace(s, seq=1 + k)).frame for k, s in enumerate(samples[::THIN])),
            )
        )
    return out


def _played() -> list[list[Posture]]:
    people = [{"name": f"m{i}", "seat": i} for i in range(TABLE_SEATS)]
    conference = Conference.model_validate({"room": {"seats": TABLE_SEATS}, "sites": [{"name": "one", "participants": people}]})
    meeting = Meeting(list(simulated_people(conference).values()), TABLE_SEATS, 1)
    half = FRAMES // 2
    there = [[meeting.posture(f"m{i}", k / 60) for k in range(half)] for i in range(TABLE_SEATS)]
    return [[*one, *reversed(one)] for one in there]


def _moved(posture: Posture, there: tuple, here: tuple) -> Posture:
    turn = here[1] - there[1]
    position = here[0] + rotation_y(turn) @ (posture.stance.position - there[0])
    return replace(posture, stance=Stance(position, posture.stance.heading + turn))
