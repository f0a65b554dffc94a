"""A conference whose first person moves a hand at known times; everybody else sits still. Its simulated devices, at their ports.

python -m benchmarks.conferences.moved_hand CONFERENCE.toml --run RUN [--site SITE] [--touching]
"""

import argparse
import asyncio
import contextlib
import signal
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.conference.files import load
from vistel.conference.paths import RunPaths
from vistel.figure.posture.hands import FLAT, hand_rotation
from vistel.figure.posture.posture import Posture
from vistel.figure.posture.sensors import Placement
from vistel.figure.skeleton import REFERENCE_HEIGHT
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.geometry.smoothstep import ease
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock
from vistel_sim.device import run_devices
from vistel_sim.limbs import own_limbs
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.source import SimulatedPerson, receivers_of, simulated_people
from vistel_sim.motion.tracks import HandState
from vistel_sim.process import simulators

EVERY_NS = 1_237_000_000
"""From one move to the next: no multiple of the period of devices, pictures or messages."""
MOVE_NS = 140_000_000
"""How long a move takes."""
HEIGHTS = 1.05, 1.2
"""Of the wrist before and after a move, of somebody of average height [m]: 2 m/s at most."""
HELD_OUT = 0.92
"""Height of the hand that the second person holds out over the middle of the table, to be touched [m]."""
TOUCHING = 0.16, 0.01
"""How far above it the wrist of the first person's hand is before and after a move [m]."""
SHORT = 0.09
"""So far before the middle each of these wrists is, so that palm lies on hand [m]."""


def moved(t_ns: int) -> float:
    """How far the hand is at a conference time, 0 to 1: to and fro, half-way at each multiple of EVERY_NS."""
    number, since_ns = divmod(t_ns + MOVE_NS // 2, EVERY_NS)
    u = ease(min(1.0, since_ns / MOVE_NS))
    return u if number % 2 else 1.0 - u


class MovedHand:
    """Motion source. start_ns: conference time of its beginning; touching: it comes down on the second person's."""

    def __init__(self, people: Sequence[SimulatedPerson], start_ns: int, *, touching: bool = False) -> None:
        self._sitters, self._start_ns, self._touching = {p.name: Sitter(p) for p in people}, start_ns, touching

    @property
    def participants(self) -> tuple[str, ...]:
        """Whom this source moves."""
        return tuple(self._sitters)

    def posture(self, participant: str, t_s: float) -> Posture:
        """As `MotionSource`."""
        return self.posture_at(participant, moved(self._start_ns + round(t_s * 1e9)))

    def posture_at(self, participant: str, u: float) -> Posture:
        """Where the hand has gone so far, 0 to 1."""
        sitter, number = self._sitters[participant], self.participants.index(participant)
        scale = sitter.person.skeleton.height / REFERENCE_HEIGHT
        rises = 0.0 if self._touching or number else u * (HEIGHTS[1] - HEIGHTS[0])
        left, right = (_beside(sitter, side, (HEIGHTS[0] + up) * scale) for side, up in ((1.0, rises), (-1.0, 0.0)))
        if self._touching and number < 2:
            above = 0.0 if number else TOUCHING[0] + u * (TOUCHING[1] - TOUCHING[0])
            right = _over_the_table(sitter, HELD_OUT + above)
        return sitter.posture(left, right, np.array([0.0, 1.1, 0.0]), np.zeros(3), np.zeros(2))

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        """As `MotionSource`."""
        return receivers_of(self._sitters[participant].person, self.posture(participant, t_s))

    def hand_angles(self, participant: str, t_s: float) -> F64:
        """As `MotionSource`."""
        return np.stack((FLAT, FLAT))

    def speaking(self, participant: str, t_s: float) -> float:
        """As `MotionSource`."""
        return 0.0

    def things(self, t_s: float) -> dict[str, Placement]:
        """As `MotionSource`."""
        return {}


def _beside(sitter: Sitter, side: float, height: float) -> HandState:
    """A hand in front of the body. side: 1 left, -1 right."""
    fingers, palm = np.array([0.0, 0.75, 0.66]), np.array([-side, 0.0, 0.0])
    rotation = hand_rotation(side, sitter.direction_in_room(fingers), sitter.direction_in_room(palm))
    return HandState(sitter.out_of_seat(np.array([side * 0.2, height, 0.34])), quaternion_from_matrix(rotation), FLAT, 0.0)


def _over_the_table(sitter: Sitter, height: float) -> HandState:
    """The right hand flat over the room's middle, its palm down."""
    middle = sitter.into_seat(np.zeros(3))
    ahead = middle * (1.0, 0.0, 1.0) / np.hypot(middle[0], middle[2])
    wrist = middle - SHORT * ahead
    rotation = hand_rotation(-1.0, sitter.direction_in_room(ahead), np.array([0.0, -1.0, 0.0]))
    place = sitter.out_of_seat(wrist) * (1.0, 0.0, 1.0) + (0.0, height, 0.0)
    return HandState(place, quaternion_from_matrix(rotation), FLAT, 0.0)


async def _run(file: Path, run: Path, site: str | None, touching: bool) -> None:
    conference, paths, clock = load(file), RunPaths(run, run), SystemClock()
    task = asyncio.current_task()
    assert task is not None
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    start_ns, limbs = clock.now_ns(), own_limbs(conference)
    motion = MovedHand(list(simulated_people(conference, limbs).values()), start_ns, touching=touching)
    with contextlib.suppress(asyncio.CancelledError):
        await run_devices(simulators(conference, motion, paths, clock, start_ns, site=site, limbs=limbs))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conference", type=Path)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--site")
    parser.add_argument("--touching", action="store_true")
    given = parser.parse_args()
    event_loop.run(_run(given.conference, given.run, given.site, given.touching))
