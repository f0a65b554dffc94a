"""The sound track of a film: each voice in time with the picture of its speaker, and from their direction."""

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F32
from vistel.audio.mixer import PanningMixer
from vistel.audio.opus import FRAME, FRAME_NS, Encoder
from vistel.audio.spatial import Head, SourceDirection, source_direction
from vistel.audio.stream import VoiceStream
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.render.stage.stage import Instant, PersonNow
from vistel.render.view.camera import overview
from vistel.v1.audio_pb2 import Voice

_BITRATE = 96_000
_HEAD = JOINT_INDEX["head"]
_DIRECTIONS_NS = 100_000_000


class FilmSound:
    """From voices and the instants shown to packets for `VideoWriter.put_sound`."""

    def __init__(self, begin_ns: int, delay_s: float, listener: str | None, spatial: bool = True) -> None:
        """begin_ns: of the film; delay_s: of a person's picture, until their playout is known; listener: the participant who
        hears, None for one at the camera; spatial: voices have directions."""
        self._delay_ns = delay_s * 1e9
        self._listener, self._spatial = listener, spatial
        self._streams: dict[str, VoiceStream] = {}
        self._delays: dict[str, float] = {}
        self._directions: Mapping[str, SourceDirection | None] = {}
        self._directions_ns: int | None = None
        self._mixer = PanningMixer()
        self._encoder = Encoder(2, _BITRATE, voice=False, complexity=10, dtx=False)
        self._next_ns = begin_ns + self._encoder.lookahead_ns  # so that the first packet begins with the film

    def receive(self, participant: str, message: Voice) -> None:
        """Take a message of a participant's voice."""
        self._streams.setdefault(participant, VoiceStream()).push(message.header.t_ns, message.opus, message.earlier)

    def until(self, instant: Instant) -> list[tuple[int, bytes]]:
        """Packets of Opus, stereo, and when each begins [ns], from the end of the last call until `instant`. Every frame that
        was captured by then, less the picture's delay, must have been received."""
        out: list[tuple[int, bytes]] = []
        while self._next_ns + FRAME_NS <= instant.now_ns:
            out.append((self._next_ns - self._encoder.lookahead_ns, self._encoder.encode(self._mixed())))
            self._next_ns += FRAME_NS
        for person in instant.people:
            if not person.timing.holding:
                self._delays[person.about.name] = person.timing.delay_ns
        if self._spatial and (self._directions_ns is None or instant.now_ns - self._directions_ns >= _DIRECTIONS_NS):
            self._directions_ns, self._directions = instant.now_ns, self._directions_in(instant)
        return out

    def _mixed(self) -> F32:
        voices: dict[str, F32] = {}
        for name, stream in self._streams.items():
            block = stream.read(self._next_ns, FRAME, self._delays.get(name, self._delay_ns))
            if block is not None:
                voices[name] = block
        mixed = self._mixer.mix(voices, self._directions)
        return np.zeros((FRAME, 2), np.float32) if mixed is None else mixed

    def _directions_in(self, instant: Instant) -> dict[str, SourceDirection | None]:
        heads = {person.about.name: _head_of(person) for person in instant.people}
        listener = _camera_head() if self._listener is None else heads.get(self._listener)
        if listener is None:
            return {}
        return {name: source_direction(listener, head) for name, head in heads.items() if name != self._listener}


def _head_of(person: PersonNow) -> Head:
    limbs = person.about.proportions
    skeleton = standard_skeleton(person.about.height) if limbs is None else limbs.skeleton
    pose = pose_joints(skeleton, person.posture)
    return Head(pose.position[_HEAD], pose.rotation[_HEAD])


def _camera_head() -> Head:
    """A head at the camera, which looks along its -Z and has +X to its right."""
    camera = overview()
    return Head(camera.position, camera.rotation * (-1.0, 1.0, -1.0))
