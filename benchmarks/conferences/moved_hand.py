"""A conference whose first person moves a hand at known times; everybody else sits still. Its simulated devices, at their ports.

python -m benchmarks.conferences.moved_hand CONFERENCE.toml RUN
"""

import asyncio
import contextlib
import signal
import sys
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


def moved(t_ns: int) -> float:
    """How far the hand is at a conference time, 0 to 1: to and fro, half-way at each multiple of EVERY_NS."""
    number, since_ns = divmod(t_ns + MOVE_NS // 2, EVERY_NS)
    u = ease(min(1.0, since_ns / MOVE_NS))
    return u if number % 2 else 1.0 - u


class MovedHand:
    """Motion source. start_ns: conference time of its beginning."""

    def __init__(self, people: Sequence[SimulatedPerson], start_ns: int) -> None:
        self._sitters, self._start_ns = {p.name: Sitter(p) for p in people}, start_ns

    @property
    def participants(self) -> tuple[str, ...]:
        """Whom this source moves."""
        return tuple(self._sitters)

    def posture(self, participant: str, t_s: float) -> Posture:
        """As `MotionSource`."""
        sitter = self._sitters[participant]
        scale = sitter.person.skeleton.height / REFERENCE_HEIGHT
        u = moved(self._start_ns + round(t_s * 1e9)) if participant == self.participants[0] else 0.0
        hands: list[HandState] = []
        for side in (1.0, -1.0):
            fingers, palm = np.array([0.0, 0.75, 0.66]), np.array([-side, 0.0, 0.0])
            height = HEIGHTS[0] + (HEIGHTS[1] - HEIGHTS[0]) * (u if side > 0 else 0.0)
            wrist = np.array([side * 0.2, height * scale, 0.34])
            rotation = hand_rotation(side, sitter.direction_in_room(fingers), sitter.direction_in_room(palm))
            hands.append(HandState(sitter.out_of_seat(wrist), quaternion_from_matrix(rotation), FLAT, 0.0))
        return sitter.posture(hands[0], hands[1], np.array([0.0, 1.1, 0.0]), np.zeros(3), np.zeros(2))

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


async def _run(file: Path, run: Path) -> None:
    conference, paths, clock = load(file), RunPaths(run, run), SystemClock()
    task = asyncio.current_task()
    assert task is not None
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    start_ns = clock.now_ns()
    motion = MovedHand(list(simulated_people(conference).values()), start_ns)
    with contextlib.suppress(asyncio.CancelledError):
        await run_devices(simulators(conference, motion, paths, clock, start_ns))


if __name__ == "__main__":
    event_loop.run(_run(Path(sys.argv[1]), Path(sys.argv[2])))
