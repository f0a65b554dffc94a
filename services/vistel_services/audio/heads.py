"""The poses of heads, for the directions of voices."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from vistel.audio.spatial import Head, SourceDirection, source_direction
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, Skeleton, standard_skeleton
from vistel.messages.postures import posture_of
from vistel.v1.motion_pb2 import Motion
from vistel.wire.bus import Bus
from vistel.wire.motion import MotionDecoder, MotionSample
from vistel.wire.motion.interest import STRAY_NS, MotionSubscriptions
from vistel.wire.topics import BY_NAME

_HEAD = JOINT_INDEX["head"]
_DEFAULT_HEIGHT_M = 1.75


class _Frame(Protocol):
    t_ns: int

    def sample(self) -> MotionSample: ...


class Heads:
    """Receives everybody's motion; decodes only what `directions` needs."""

    def __init__(self, bus: Bus, listener: str, crowd: Mapping[str, str]) -> None:
        """crowd: see `Conference.crowd`."""
        self._listener = listener
        self._participants = bus.subscribe(BY_NAME["participant"], polled=True)
        self._motion = MotionSubscriptions(bus, crowd, [listener])
        self._decoders: dict[str, MotionDecoder] = {}
        self.far: dict[str, float] = {}
        """How far from the listener everybody was at the last `directions` [m]."""
        self._newest: dict[str, _Frame] = {}
        self._skeletons: dict[str, Skeleton] = {}

    def directions(self) -> dict[str, SourceDirection | None]:
        """The direction from which the listener hears each participant whose motion is known."""
        self._take()
        heads = {name: self._head(name, frame) for name, frame in self._newest.items()}
        listener = heads.get(self._listener)
        if listener is None:
            return {}
        others = {name: head for name, head in heads.items() if name != self._listener}
        self.far = {name: float(np.linalg.norm(head.position - listener.position)) for name, head in others.items()}
        return {name: source_direction(listener, head) for name, head in others.items()}

    def close(self) -> None:
        """Close the subscriptions."""
        self._participants.close()
        self._motion.close()

    def _take(self) -> None:
        for sample in self._participants.take():
            height = sample.message.height_m
            self._skeletons[sample.message.participant] = standard_skeleton(height if 0.5 <= height <= 2.6 else _DEFAULT_HEIGHT_M)
        for sample in self._motion.take():
            self._receive(sample.names["participant"], sample.key, sample.message)

    def _receive(self, name: str, key: str, message: Motion) -> None:
        frame = self._decoders.setdefault(key, MotionDecoder()).open(message)
        known = self._newest.get(name)
        if frame is not None and (known is None or not 0 < known.t_ns - frame.t_ns < STRAY_NS):
            self._newest[name] = frame

    def _head(self, name: str, frame: _Frame) -> Head:
        skeleton = self._skeletons.get(name)
        if skeleton is None:
            skeleton = self._skeletons[name] = standard_skeleton(_DEFAULT_HEIGHT_M)
        pose = pose_joints(skeleton, posture_of(frame.sample()))
        return Head(pose.position[_HEAD], pose.rotation[_HEAD])
