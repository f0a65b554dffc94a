"""The voices of a recorded conference for its film: each heard with the picture of who speaks, from where they are."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F32
from vistel.audio.mixer import Panning
from vistel.audio.opus import FRAME, FRAME_NS, Encoder
from vistel.audio.spatial import Head, Place, place_of
from vistel.audio.stream import VoiceStream
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.render.stage.stage import Instant, PersonNow
from vistel.render.view.camera import overview
from vistel.v1.audio_pb2 import Voice

_BITRATE = 96_000
_HEAD = JOINT_INDEX["head"]
_PLACES_NS = 100_000_000


class FilmSound:
    """Takes what microphones heard and what is shown; gives packets as `VideoWriter.put_sound` takes them."""

    def __init__(self, begin_ns: int, delay_s: float, listener: str | None, spatial: bool = True) -> None:
        """begin_ns: of the film; delay_s: of pictures behind what they show, until one says more; listener: through whose ears,
        None from where the room is looked at; spatial: voices come from where people are."""
        self._delay_ns = delay_s * 1e9
        self._listener, self._spatial = listener, spatial
        self._streams: dict[str, VoiceStream] = {}
        self._delays: dict[str, float] = {}
        self._places: Mapping[str, Place | None] = {}
        self._placed_ns: int | None = None
        self._mixing = Panning()
        self._encoder = Encoder(2, _BITRATE, voice=False, complexity=10, dtx=False)
        self._next_ns = begin_ns + self._encoder.lookahead_ns  # so that the first packet begins with the film

    def receive(self, participant: str, message: Voice) -> None:
        """A frame of somebody's voice."""
        self._streams.setdefault(participant, VoiceStream()).push(message.header.t_ns, message.opus, message.earlier)

    def until(self, instant: Instant) -> list[tuple[int, bytes]]:
        """What is heard from where the last call ended until `instant` is shown: when each packet begins [ns], Opus, stereo. Every
        frame that was captured by then, less the picture's delay, is to have been heard."""
        out: list[tuple[int, bytes]] = []
        while self._next_ns + FRAME_NS <= instant.now_ns:
            out.append((self._next_ns - self._encoder.lookahead_ns, self._encoder.encode(self._mixed())))
            self._next_ns += FRAME_NS
        for person in instant.people:
            if not person.timing.holding:
                self._delays[person.about.name] = person.timing.delay_ns
        if self._spatial and (self._placed_ns is None or instant.now_ns - self._placed_ns >= _PLACES_NS):
            self._placed_ns, self._places = instant.now_ns, self._places_in(instant)
        return out

    def _mixed(self) -> F32:
        voices: dict[str, F32] = {}
        for name, stream in self._streams.items():
            block = stream.read(self._next_ns, FRAME, self._delays.get(name, self._delay_ns))
            if block is not None:
                voices[name] = block
        mixed = self._mixing.mix(voices, self._places)
        return np.zeros((FRAME, 2), np.float32) if mixed is None else mixed

    def _places_in(self, instant: Instant) -> dict[str, Place | None]:
        heads = {person.about.name: _head_of(person) for person in instant.people}
        listener = _onlooker() if self._listener is None else heads.get(self._listener)
        if listener is None:
            return {}
        return {name: place_of(listener, head) for name, head in heads.items() if name != self._listener}


def _head_of(person: PersonNow) -> Head:
    limbs = person.about.proportions
    skeleton = standard_skeleton(person.about.height) if limbs is None else limbs.skeleton
    pose = pose_joints(skeleton, person.posture)
    return Head(pose.position[_HEAD], pose.rotation[_HEAD])


def _onlooker() -> Head:
    """Who looks on: a camera looks along its -Z, and +X is to its right."""
    camera = overview()
    return Head(camera.position, camera.rotation * (-1.0, 1.0, -1.0))
