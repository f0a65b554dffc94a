"""A tracked prop: frames of its receiver in, poses of the thing out. No bus, no clock: times come with the messages."""

import numpy as np

from vistel.arrays import F64
from vistel.capture.body import RATE_HZ, USABLE, receiver_pose
from vistel.capture.config import TrackedProp
from vistel.capture.one_euro import PoseFilter
from vistel.figure.posture.sensors import out_of_frame
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver
from vistel.v1.motion_pb2 import Prop


class PropCapture:
    """From the frames of one prop's tracker to Prop messages."""

    def __init__(self, prop: TrackedProp) -> None:
        self.prop = prop
        self._filter = PoseFilter()
        self._epoch_ns: int | None = None
        self._newest_ns = 0
        self._published_ns = 0

    def tracker(self, frame: TrackerFrame) -> Prop | None:
        """Take a tracker's frame; returns a message if one is due, about 1/60 s after the last."""
        health = TrackerReceiver.HEALTH_UNSPECIFIED
        for r in frame.receivers:
            if r.station != self.prop.station or r.t_ns <= self._newest_ns:
                continue
            self._newest_ns, health = r.t_ns, r.health
            pose = receiver_pose(r)
            if pose is not None and r.health in USABLE:
                self._filter.update(self._seconds(r.t_ns), *self._thing(*out_of_frame(self.prop.transmitter, *pose)))
            elif health in USABLE:
                health = TrackerReceiver.HEALTH_UNTRUSTED
        if self._filter.t < 0.0 or self._newest_ns - self._published_ns < 0.75e9 / RATE_HZ:
            return None
        self._published_ns = self._newest_ns
        return self._message(health)

    def _thing(self, position: F64, quaternion: F64) -> tuple[F64, F64]:
        """Pose of the thing from that of its receiver; room frame."""
        p, q = self.prop.receiver
        rotation = matrix_from_quaternion(quaternion) @ matrix_from_quaternion(q).T
        return position - rotation @ p, quaternion_from_matrix(np.ascontiguousarray(rotation))

    def _message(self, health: TrackerReceiver.Health) -> Prop:
        position, quaternion = self._filter.at(self._seconds(self._newest_ns))
        out = Prop(thing=self.prop.thing, health=health)
        out.header.t_ns = self._newest_ns
        at, turn = out.pose.position, out.pose.rotation
        at.x, at.y, at.z = position.tolist()
        turn.x, turn.y, turn.z, turn.w = quaternion.tolist()
        velocity, spin = self._filter.speeds
        out.velocity.x, out.velocity.y, out.velocity.z = velocity.tolist()
        out.spin.x, out.spin.y, out.spin.z = spin.tolist()
        return out

    def _seconds(self, t_ns: int) -> float:
        """Seconds since the first sample; small, so that a float keeps nanoseconds."""
        if self._epoch_ns is None:
            self._epoch_ns = t_ns
        return (t_ns - self._epoch_ns) * 1e-9
