"""One participant's receivers and gloves, filtered and solved. No bus, no clock: times come with the messages."""

import math
from collections.abc import Mapping
from functools import cache

import numpy as np

from vistel.arrays import F64
from vistel.capture.config import Person
from vistel.capture.one_euro import AngleFilter, PoseFilter
from vistel.capture.peaks import PeakHold
from vistel.capture.whole_body import WholeBody, whole_body
from vistel.figure.posture.limits import SIDES
from vistel.figure.posture.posture import HAND_DOF_COUNT, pose_joints, standing
from vistel.figure.posture.retarget import Retargeter
from vistel.figure.posture.sensors import Placement, out_of_frame, receiver_poses
from vistel.figure.posture.solve import PostureSolver, Solved
from vistel.figure.posture.swivel import Comfort
from vistel.figure.skeleton import Skeleton, standard_skeleton
from vistel.v1.device_pb2 import GloveFrame, TrackerFrame, TrackerReceiver

RATE_HZ = 60.0
SILENT_S = 0.25
"""A receiver or glove without a sample for this time counts as silent [s]."""
FAR_M = 5.0
"""A sample of a receiver farther from its transmitter is rejected [m]."""
FINGER_PEAK = math.radians(3.0)
"""A finger that moves out and back by more between two postures is sent at its farthest [rad]."""
START_S = 1.0
"""How long the first posture waits for a sample of every receiver [s]."""

USABLE = (TrackerReceiver.HEALTH_UNSPECIFIED, TrackerReceiver.HEALTH_GOOD, TrackerReceiver.HEALTH_FLAGGED)


class BodyCapture:
    """From the device frames of one person to postures."""

    def __init__(
        self, person: Person, skeleton: Skeleton | None = None, comfort: Comfort | Mapping[str, Comfort] | None = None
    ) -> None:
        """skeleton: of their avatar; None: a standard one of the person's height. comfort: of the elbow's swivel.

        A person with a measured body is solved with it; the posture is then carried over to the avatar.
        """
        self.person = person
        shown = skeleton or standard_skeleton(person.height_m)
        body = person.body
        learnt = {s: body.comfort.get(s, Comfort()) for s in SIDES} if body is not None else Comfort()
        self._solver = PostureSolver(
            shown if body is None else body.skeleton, person.seat, person.mounts, comfort=comfort or learnt
        )
        self._retargeter = None if body is None else Retargeter(body.skeleton, shown, person.seat)
        self._filters = {receiver: PoseFilter() for receiver in person.stations.values()}
        self._gloves: dict[str, float] = {}
        self._angle_filters = {side: AngleFilter() for side in SIDES}
        self._fingers = {side: PeakHold(FINGER_PEAK) for side in SIDES}
        self._whole: tuple[float, WholeBody | None] = (-math.inf, None)
        self._epoch_ns: int | None = None
        self._newest_ns = 0
        self._solved_ns = 0
        self.rejected = 0
        """Number of rejected samples: not finite, too far, or untrusted by the device."""

    @property
    def newest_ns(self) -> int:
        """Conference time of the newest receiver sample; 0 before the first."""
        return self._newest_ns

    @property
    def solved_ns(self) -> int:
        """Time of the last posture; 0 before the first."""
        return self._solved_ns

    def tracker(self, frame: TrackerFrame) -> bool:
        """Take a tracker's frame. True if a posture is due: samples are about 1/60 s newer than the last one."""
        for r in frame.receivers:
            receiver = self.person.stations.get(r.station)
            if receiver is None or self._seconds(r.t_ns) <= self._filters[receiver].t:
                continue
            pose = receiver_pose(r)
            if pose is None or r.health not in USABLE:
                self.rejected += 1
                continue
            if self.person.distortion is not None:
                pose = self.person.distortion.correct(*pose)
            self._filters[receiver].update(self._seconds(r.t_ns), *out_of_frame(self.person.transmitter, *pose))
            self._newest_ns = max(self._newest_ns, r.t_ns)
        whole = whole_body(frame, self.person.transmitter)
        if whole is not None:
            self._whole = self._seconds(frame.header.t_ns), whole
        if not self._newest_ns:
            return False
        complete = all(f.t > -math.inf for f in self._filters.values())
        if not complete and self._seconds(self._newest_ns) < START_S:
            return False
        return self._newest_ns - self._solved_ns >= 0.75e9 / RATE_HZ

    def glove(self, frame: GloveFrame) -> None:
        """Take a glove's frame."""
        side = self.person.gloves.get(frame.device)
        if side is None:
            return
        if len(frame.angles) != HAND_DOF_COUNT or not all(map(math.isfinite, frame.angles)):
            self.rejected += 1
            return
        angles = np.array(frame.angles, np.float64)
        t = self._seconds(frame.header.t_ns)
        if side not in self._gloves or t > self._gloves[side]:
            self._gloves[side] = t
            self._fingers[side].add(angles, self._angle_filters[side].update(t, angles))

    def solve(self, t_ns: int) -> Solved:
        """The posture at `t_ns`, later than the last one."""
        self._solved_ns = t_ns
        t = self._seconds(t_ns)
        receivers: dict[str, Placement] = {name: f.at(t) for name, f in self._filters.items() if t - f.t < SILENT_S}
        whole_t, whole = self._whole
        fresh = whole is not None and t - whole_t < SILENT_S
        elbows = whole.elbows() if whole is not None and fresh else None
        solved = self._solver.solve(t, receivers, (self._hand("left", t), self._hand("right", t)), elbows)
        posture = solved.posture if self._retargeter is None else self._retargeter.retarget(t, solved.posture)
        stale = solved.stale if whole is None or fresh else solved.stale | {"legs"}
        return Solved(posture if whole is None else whole.add_legs(posture), stale)

    def _seconds(self, t_ns: int) -> float:
        """Seconds since the first sample; small, so that a float keeps nanoseconds."""
        if self._epoch_ns is None:
            self._epoch_ns = t_ns
        return (t_ns - self._epoch_ns) * 1e-9

    def _hand(self, side: str, t: float) -> F64 | None:
        newest = self._gloves.get(side)
        if newest is not None and t - newest <= SILENT_S:
            return self._fingers[side].take()
        whole_t, whole = self._whole
        return whole.fingers(side) if whole is not None and t - whole_t <= SILENT_S else None


def receiver_pose(r: TrackerReceiver) -> Placement | None:
    """The pose that a receiver measured, in its transmitter's frame; None where it is not finite."""
    at, turned = r.position, r.rotation
    p, q = (at.x, at.y, at.z), (turned.x, turned.y, turned.z, turned.w)
    n = math.hypot(*q)
    if not (math.hypot(*p) <= FAR_M and n < math.inf):  # what is no number is not less, either
        return None
    if n == 0.0:
        return np.array(p), np.array([0.0, 0.0, 0.0, 1.0])
    return (np.array(p), np.array(q) / n) if abs(n - 1.0) < 0.1 else None


@cache
def warm_up() -> None:
    """Compile what a posture needs, so that the first one is as quick as the others."""
    skeleton = standard_skeleton()
    solver = PostureSolver(skeleton)
    poses = receiver_poses(skeleton, pose_joints(skeleton, standing()))
    still, fingers = PoseFilter(), AngleFilter()
    elbows = {side: np.array((0.0, -1.0, 0.0)) for side in SIDES}
    for k in range(3):
        fingers.update(k / RATE_HZ, np.zeros(HAND_DOF_COUNT))
        still.update(k / RATE_HZ, *out_of_frame(poses["chest"], *poses["head"]))
        still.at(k / RATE_HZ)
        solver.solve(k / RATE_HZ, poses if k != 1 else {}, elbows=elbows if k == 2 else None)
