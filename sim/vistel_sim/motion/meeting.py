"""A synthetic meeting round a table: people talk, gesture, look at each other, hand a baton over and touch hands.

All of it is a smooth function of time and the conference's seed. The script (`script.py`) moves the hands; this file adds
idle motion: breathing, swaying, gestures while they speak, turning to who speaks.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.hands import OPEN, RELAXED, hand_rotation
from vistel.figure.posture.posture import Posture
from vistel.figure.posture.sensors import RECEIVERS, Placement
from vistel.geometry.rotation import quaternion_from_matrix, slerp
from vistel.jit.kernel_jit import compiled
from vistel_sim.motion.layout import Layout, built_in
from vistel_sim.motion.script import CYCLE_S, Script, write_script
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.source import SimulatedPerson, receivers_of
from vistel_sim.motion.speech import Conversation
from vistel_sim.motion.tracks import Attention, HandState

TICK_HZ = 20.0
"""Postures are computed on this grid, and the poses of sensors interpolated by cubics, with an error below sensor noise."""


_Tick = tuple[F64, F64]
"""(4, 7) position and quaternion of each of RECEIVERS; (2, 20) angles of the hands."""


class Meeting:
    """The built-in motion source (see the module)."""

    def __init__(
        self,
        people: Sequence[SimulatedPerson],
        seats: int,
        seed: int,
        watch: Callable[[float], F64] | None = None,
        write: Callable[[Mapping[str, Sitter], Layout], Script] = write_script,
        layout: Layout | None = None,
    ) -> None:
        """watch: t [s] -> point (3,) of the room that everybody looks at, instead of each other; write: makes the script;
        layout: of the room, by default the built-in one with `seats`."""
        self._watch = watch
        self._people = {p.name: p for p in people}
        self._sitters = {p.name: Sitter(p) for p in people}
        self._talk = Conversation(tuple(self._people), seed)
        self._script: Script = write(self._sitters, layout or built_in(seats))
        self._habits = {name: _Habits(seed * 1009 + i) for i, name in enumerate(self._people)}
        self._ticks: dict[tuple[str, int], _Tick] = {}
        self._fours: dict[tuple[str, int], _Tick] = {}
        self._attention: dict[tuple[str, int], Attention] = {}

    @property
    def participants(self) -> tuple[str, ...]:
        return tuple(self._people)

    def speaking(self, participant: str, t_s: float) -> float:
        return self._talk.loudness(participant, t_s)

    def things(self, t_s: float) -> dict[str, Placement]:
        return self._script.things(t_s % CYCLE_S)

    def hand_angles(self, participant: str, t_s: float) -> F64:
        (_, hands), u = self._around(participant, t_s)
        return _between(hands, u).reshape(2, -1)

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        (receivers, _), u = self._around(participant, t_s)
        rows = _between(receivers, u).reshape(len(RECEIVERS), 7)
        _normalise(rows)
        return {name: (row[:3], row[3:]) for name, row in zip(RECEIVERS, rows, strict=True)}

    def posture(self, participant: str, t_s: float) -> Posture:
        talk = self._talk.weight(participant, t_s)
        habits = self._habits[participant]
        hands: list[HandState] = []
        for row, side in enumerate(("left", "right")):
            state = self._script.hand(participant, side, t_s % CYCLE_S)
            hands.append(habits.gesture(self._sitters[participant], row, state, talk, t_s))
        look = self._look(participant, t_s)
        return self._sitters[participant].posture(hands[0], hands[1], look, habits.sway(t_s, talk), habits.gaze(t_s))

    def _around(self, participant: str, t_s: float) -> tuple[_Tick, float]:
        """Two ticks before a time and two after it, in rows, and how far it is from the second to the third, 0 to 1."""
        k = math.floor(t_s * TICK_HZ)
        key = (participant, k)
        if (four := self._fours.get(key)) is None:
            if len(self._fours) > 16 * len(self._people):
                self._fours.clear()
            ticks = [self._tick(participant, k + i) for i in (-1, 0, 1, 2)]
            receivers = np.array([r for r, _ in ticks])
            # Of a rotation's two quaternions the one near that of the second tick.
            receivers[..., 3:] *= np.where((receivers[..., 3:] * receivers[1, :, 3:]).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
            four = self._fours[key] = receivers.reshape(4, -1), np.array([hands for _, hands in ticks]).reshape(4, -1)
        return four, t_s * TICK_HZ - k

    def _tick(self, participant: str, k: int) -> _Tick:
        key = (participant, k)
        if (found := self._ticks.get(key)) is None:
            if len(self._ticks) > 64 * len(self._people):
                self._ticks.clear()
            posture = self.posture(participant, max(0, k) / TICK_HZ)
            poses = receivers_of(self._people[participant], posture)
            found = self._ticks[key] = np.array([np.concatenate(poses[name]) for name in RECEIVERS]), posture.hands
        return found

    def _look(self, participant: str, t_s: float) -> F64:
        if self._watch is not None:
            return self._watch(t_s)
        cycle = int(t_s // CYCLE_S)
        key = (participant, cycle)
        if key not in self._attention:
            if len(self._attention) > 64:
                self._attention.clear()
            # The last glances of the cycle before are where this one starts from.
            before = self._glances(participant, cycle - 1)[-3:] if cycle else []
            self._attention[key] = Attention(before + self._glances(participant, cycle), 0.6)
        out = np.zeros(3)
        for target, share in self._attention[key].at(t_s):
            out += share * self._point(target, t_s)
        return out

    def _glances(self, participant: str, cycle: int) -> list[tuple[float, str]]:
        start = cycle * CYCLE_S
        work = [(start + a, start + b, what) for a, b, what in self._script.looks.get(participant, [])]
        out = [
            (t, f"head:{whom}")
            for t, whom in self._talk.glances(participant, start, start + CYCLE_S)
            if not any(a <= t < b for a, b, _ in work)
        ]
        for a, b, what in work:
            out += [(a, what), (b, f"head:{self._talk.whom_to_watch(participant, b)}")]
        return sorted(out)

    def _point(self, target: str, t_s: float) -> F64:
        kind, _, name = target.partition(":")
        if kind == "head":
            if name in self._sitters:
                sitter = self._sitters[name]
                return sitter.out_of_seat(np.array([0.0, 0.68 * sitter.person.skeleton.height, 0.05]))
            return np.array([0.0, 1.1, 0.0])
        if kind == "thing":
            return self._script.things(t_s % CYCLE_S)[name][0]
        return self._script.points[name]


class _Habits:
    """The idle motion of one person; phases and tempi are drawn from the seed."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self._phase = rng.uniform(0.0, 2.0 * math.pi, 24)
        self._tempo = rng.uniform(0.88, 1.12, 24)
        self._liveliness = rng.uniform(0.8, 1.15)
        self._favourite = rng.uniform(0.55, 1.0, 2)
        self._palms: dict[float, F64] = {}

    def _wave(self, k: int, hertz: float, t: float) -> float:
        return math.sin(2.0 * math.pi * hertz * float(self._tempo[k]) * t + float(self._phase[k]))

    def sway(self, t: float, talk: float) -> F64:
        """Breathing, weight shifts, nods of the trunk while speaking: rotation vector of the chest [rad]."""
        pitch = 0.010 * self._wave(0, 0.25, t) + 0.020 * self._wave(1, 0.07, t) + 0.020 * talk * self._wave(2, 0.9, t)
        yaw = 0.030 * self._wave(3, 0.05, t) + 0.035 * talk * self._wave(4, 0.45, t)
        roll = 0.014 * self._wave(5, 0.06, t) + 0.012 * talk * self._wave(6, 0.6, t)
        return np.array([pitch + 0.04 * talk, yaw, roll])

    def gaze(self, t: float) -> F64:
        """Small restless movements of the eyes [rad]."""
        return np.array([0.02 * self._wave(7, 0.8, t), 0.012 * self._wave(8, 0.6, t)])

    def gesture(self, sitter: Sitter, row: int, hand: HandState, talk: float, t: float) -> HandState:
        """The hand at its task and, as far as it is free, with gestures of speech."""
        side = 1.0 if row == 0 else -1.0
        k = 9 + 7 * row
        idle = hand.free * (1.0 - talk)
        share = hand.free * talk * self._liveliness * float(self._favourite[row])
        beat = 0.5 + 0.5 * self._wave(k, 0.85, t)
        rise = share * (0.07 + 0.10 * beat * (0.6 + 0.4 * self._wave(k + 1, 0.23, t)))
        out = share * (0.03 + 0.05 * self._wave(k + 2, 0.5, t))
        ahead = share * (0.03 + 0.05 * self._wave(k + 3, 0.37, t))
        drift = 0.004 * idle * self._wave(k + 4, 0.11, t)
        offset = sitter.direction_in_room(np.array([side * out + drift, rise, ahead]))
        turned = slerp(hand.rotation, self._open_palm(sitter, side), min(1.0, share * (0.45 + 0.25 * beat)))
        spread = min(1.0, 0.8 * share * (0.5 + 0.5 * self._wave(k + 5, 0.7, t)))
        fingers = hand.fingers + spread * (OPEN - RELAXED)
        fingers[4::4] += hand.free * 0.05 * (self._wave(k + 6, 0.31, t) + 1.0)
        return HandState(hand.position + offset, turned, fingers, hand.free)

    def _open_palm(self, sitter: Sitter, side: float) -> F64:
        """(4,) quaternion hand to room of a hand held up to explain: fingers ahead and inwards, palm inwards and up."""
        if side not in self._palms:
            fingers = sitter.direction_in_room(np.array([-side * 0.35, 0.25, 0.9]))
            palm = sitter.direction_in_room(np.array([-side * 0.9, 0.3, 0.1]))
            self._palms[side] = quaternion_from_matrix(hand_rotation(side, fingers, palm))
        return self._palms[side]


@compiled
def _between(rows: F64, u: float) -> F64:
    """(n,) between the second and the third of four rows (4, n) (Catmull-Rom)."""
    a, b = 0.5 * (u * (u * (2.0 - u) - 1.0)), 0.5 * (u * u * (3.0 * u - 5.0) + 2.0)
    c, d = 0.5 * (u * (u * (4.0 - 3.0 * u) + 1.0)), 0.5 * (u * u * (u - 1.0))
    out = np.empty(rows.shape[1])
    for i in range(len(out)):
        out[i] = a * rows[0, i] + b * rows[1, i] + c * rows[2, i] + d * rows[3, i]
    return out


@compiled
def _normalise(poses: F64) -> None:
    """Make unit quaternions of the last four numbers of each row."""
    for row in poses:
        row[3:] /= math.sqrt(row[3] * row[3] + row[4] * row[4] + row[5] * row[5] + row[6] * row[6])
