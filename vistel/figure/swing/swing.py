"""What hangs on one person, from picture to picture. Time is an argument.

It moves in steps that lie at whole multiples of `STEP_S` of the conference's time, whenever pictures are drawn, and bones are taken
to go along parabolas from picture to picture. So it is the same at all sites but for some millimetres; and as it forgets within a
second or two, a site that begins later soon has it, too.
"""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.body import Body, PosedBody, pose_body
from vistel.figure.posture.posture import JointPose
from vistel.figure.swing.hanging import Hanging, HungMesh
from vistel.figure.swing.swing_kernels import (
    advance,  # pyright: ignore[reportUnknownVariableType]
    follow,  # pyright: ignore[reportUnknownVariableType]
    spread,  # pyright: ignore[reportUnknownVariableType]
    turn,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.geometry.smoothstep import smooth

STEP_NS = 8_000_000
"""[ns]"""
STEP_S = STEP_NS * 1e-9
DAMPING = 5.0
"""By the air and within cloth and hair [1/s]."""
LONGEST_NS = 250_000_000
"""Between two pictures [ns]: who was not seen for longer is taken to have been still."""
FARTHEST = 0.25
"""By which the bones may move what hangs between two pictures [m]: more is no motion, but another place."""
_SETTLES = 120
"""Steps to rest."""
_SETTLING = 9.0
"""Damping meanwhile [1/s]."""
_LIES = 0.5
"""Thighs that rise or fall less, as a share of their length, lie on something."""
_RAISED = 0.6
_HANGS = 0.95
"""How far thighs fall that are raised, and that hang, as a share of their length."""
_BELOW = 10.0
"""How far under the thighs a seat is that is none [m]."""
_TELLS = 0.3
"""Share of a span of time: a shorter one before it does not tell how it curves."""
_SEEN = 2e-4
"""Less than that nobody sees [m]."""


@dataclass(frozen=True, eq=False)
class _Instant:
    """Where the bones have all that `advance` needs; when [ns]."""

    places: F64
    at_ns: int


class Swing:
    """The pendulums of one person. Not for two threads at once."""

    def __init__(self, hanging: Hanging, body: Body) -> None:
        self.hanging = hanging
        self._body = _part(body, hanging.solid)
        self._radius = np.column_stack((self._body.radius_a, self._body.radius_b))
        self._thighs = [k for k, name in enumerate(self._body.names) if name.endswith("thigh")]
        count = len(hanging)
        self._x, self._v, self._held = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((2, count, 3))
        self._last: tuple[_Instant, ...] = ()
        self.steps = 0
        """How many the last picture took."""

    @property
    def places(self) -> F64:
        """(N, 3) of the pendulums after the last step, room frame [m]."""
        return self._x

    def skin(self, matrix: F32) -> tuple[F64, F64]:
        """(M, 3) places of the skin that they may lie on, and its normals there."""
        of = self.hanging.skin
        place, normal = np.empty_like(of.place), np.empty_like(of.normal)
        follow(matrix, of.bone, of.weight, of.place, place)
        turn(matrix, of.bone, of.weight, of.normal, normal)
        return place, normal

    def step(self, joints: JointPose, matrix: F32, at_ns: int | None) -> F64:
        """(N, 3) how far pendulums are from where the bones have them, room frame [m]: zero for a pose that is not finite.

        matrix: (B, 12) of all bones, as of `RigidSkin.matrices`. at_ns: when; None: at rest in this pose.
        """
        now = self._instant(joints, matrix, at_ns or 0)
        if not np.isfinite(now.places).all():
            self._last = ()
            return np.zeros_like(self._x)
        if at_ns is None or not self._goes_on(now):
            self._settle(now)
            self._last = ()
        else:
            self._swing(now)
        free = np.where(self.hanging.lap, self._upright(pose_body(self._body, joints)), 1.0)[:, None]
        if at_ns is None:
            return free * self._held[1]
        if not self._last or at_ns > self._last[-1].at_ns:
            self._last = (*self._last[-1:], now)
        share = (at_ns % STEP_NS) / STEP_NS
        return free * ((1.0 - share) * self._held[0] + share * self._held[1])

    def _instant(self, joints: JointPose, matrix: F32, at_ns: int) -> _Instant:
        h, posed = self.hanging, pose_body(self._body, joints)
        place, root = np.empty_like(h.place), np.empty_like(h.root)
        follow(matrix, h.bone, h.weight, h.place, place)
        follow(matrix, h.root_bone, h.root_weight, h.root, root)
        places = np.concatenate((place, root, posed.a, posed.b, *self.skin(matrix), [self._seat(posed)]))
        return _Instant(places, at_ns)

    def _seat(self, posed: PosedBody) -> F64:
        """(3,) the middle of what is sat on: under thighs that lie; else below the floor."""
        a, b = posed.a[self._thighs], posed.b[self._thighs]
        middle = (0.5 * (a + b)).mean(axis=0) if len(a) else np.zeros(3)
        lie = len(a) > 0 and bool((np.abs(a - b)[:, 1] < _LIES * np.linalg.norm(a - b, axis=1)).all())
        middle[1] = (a[:, 1] - posed.radius_a[self._thighs]).mean() if lie else middle[1] - _BELOW
        return middle

    def _upright(self, posed: PosedBody) -> float:
        """1 while the thighs hang, 0 while they are raised: between belly and thighs no cloth swings."""
        way = posed.a[self._thighs] - posed.b[self._thighs]
        down = way[:, 1] / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
        return float(smooth((down.min(initial=1.0) - _RAISED) / (_HANGS - _RAISED)))

    def _goes_on(self, now: _Instant) -> bool:
        if not self._last or not 0 <= now.at_ns - self._last[-1].at_ns <= LONGEST_NS:
            return False
        n = len(self._x)
        return bool(np.abs(now.places[:n] - self._last[-1].places[:n]).max() < FARTHEST)

    def _settle(self, now: _Instant) -> None:
        self._x[:], self._v[:] = now.places[: len(self._x)], 0.0
        self._advance(now, now, np.zeros_like(now.places), _SETTLING, 1.0, 0.0, _SETTLES)
        self._v[:], self._held[0] = 0.0, self._held[1]

    def _swing(self, now: _Instant) -> None:
        last = self._last[-1]
        span, first = now.at_ns - last.at_ns, last.at_ns // STEP_NS + 1
        count = now.at_ns // STEP_NS + 1 - first
        if count > 0:
            curve = _curve(*self._last, now)
            self._advance(last, now, curve, DAMPING, (first * STEP_NS - last.at_ns) / span, STEP_NS / span, count)

    def _advance(self, last: _Instant, now: _Instant, curve: F64, damping: float, share: float, each: float, count: int) -> None:
        h, self.steps = self.hanging, count
        fixed = self._radius, h.clear, h.off, h.length, h.stiff, h.tie, h.longest, damping, STEP_S
        advance(self._x, self._v, self._held, last.places, now.places, curve, *fixed, share, each, count)


def _part(body: Body, only: I32) -> Body:
    kept: list[int] = only.tolist()
    return Body(
        tuple(body.names[k] for k in kept), body.joint[only], body.a[only], body.b[only], body.radius_a[only], body.radius_b[only]
    )


def _curve(*of: _Instant) -> F64:
    """What places add to the straight way from `last` to `now` at share u of it, by u (u - 1): a parabola through the last three
    instants, nothing where there are only two or the first two are too near each other to tell."""
    first, last, now = of[0], of[-2], of[-1]
    before, span = last.at_ns - first.at_ns, now.at_ns - last.at_ns
    if before < _TELLS * span:
        return np.zeros_like(now.places)
    return (span / (before + span)) * ((now.places - last.places) - (span / before) * (last.places - first.places))


class SwungLevel:
    """What hangs on one level of detail."""

    def __init__(self, mesh: HungMesh, hanging: Hanging) -> None:
        self._mesh, self._length = mesh, hanging.length
        self._offsets = np.zeros((len(mesh.near), 3), np.float32)

    def lay(self, vertices: F32, normals: F32, swung: F64) -> None:
        """Move a posed skin (V, 3) by what `Swing.step` gave (N, 3), in place."""
        if self._spread(swung):
            self._mesh.part.lay(vertices, normals, self._offsets, np.eye(3))

    def add(self, swung: F64, out: F32) -> None:
        """The same added to offsets (V, 3) in the room, for engines that move the skin elsewhere."""
        if self._spread(swung):
            out[self._mesh.part.vertex] += self._offsets

    def _spread(self, swung: F64) -> bool:
        if np.abs(swung).max() < _SEEN:
            return False
        spread(swung / self._length[:, None], self._mesh.near, self._mesh.share, self._offsets)
        return True
