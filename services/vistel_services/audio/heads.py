"""Where people's heads are, for the direction their voices come from."""

from __future__ import annotations

from typing import Protocol

from vistel.audio.spatial import Head, Place, place_of
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, Skeleton, standard_skeleton
from vistel.messages.postures import posture_of
from vistel.v1.motion_pb2 import Motion
from vistel.wire.bus import Bus
from vistel.wire.motion import MotionDecoder, MotionSample
from vistel.wire.topics import BY_NAME

_HEAD = JOINT_INDEX["head"]
_TALL_M = 1.75


class _Frame(Protocol):
    def sample(self) -> MotionSample: ...


class Heads:
    """Listens to everybody's motion; works out a head only when it is asked for."""

    def __init__(self, bus: Bus, listener: str) -> None:
        self._listener = listener
        self._about = bus.subscribe(BY_NAME["participant"], polled=True)
        self._motion = bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True)
        self._decoders: dict[str, MotionDecoder] = {}
        self._newest: dict[str, _Frame] = {}
        self._skeletons: dict[str, Skeleton] = {}

    def places(self) -> dict[str, Place | None]:
        """Where the listener hears everybody from, as far as it is known."""
        self._take()
        heads = {name: self._head(name, frame) for name, frame in self._newest.items()}
        listener = heads.get(self._listener)
        if listener is None:
            return {}
        return {name: place_of(listener, head) for name, head in heads.items() if name != self._listener}

    def close(self) -> None:
        """Stop listening."""
        self._about.close()
        self._motion.close()

    def _take(self) -> None:
        for sample in self._about.take():
            height = sample.message.height_m
            self._skeletons[sample.message.participant] = standard_skeleton(height if 0.5 <= height <= 2.6 else _TALL_M)
        for sample in self._motion.take():
            self._hear(sample.names["participant"], sample.message)

    def _hear(self, name: str, message: Motion) -> None:
        frame = self._decoders.setdefault(name, MotionDecoder()).open(message)
        if frame is not None:
            self._newest[name] = frame

    def _head(self, name: str, frame: _Frame) -> Head:
        skeleton = self._skeletons.get(name)
        if skeleton is None:
            skeleton = self._skeletons[name] = standard_skeleton(_TALL_M)
        pose = pose_joints(skeleton, posture_of(frame.sample()))
        return Head(pose.position[_HEAD], pose.rotation[_HEAD])
