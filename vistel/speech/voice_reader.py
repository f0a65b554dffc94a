"""One participant's voice, from messages to sound for a recogniser, with capture times and quality of transmission."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.audio.stream import VoiceStream
from vistel.speech.features import Resampler
from vistel.v1.audio_pb2 import Voice

BEHIND_NS = 60_000_000
"""Least delay between capture and recognition."""
_BEHIND_MOST_NS = 800_000_000
"""Greatest delay between capture and recognition."""
_FIRST_NS = 150_000_000
"""Delay before any was measured: high, so that the first word is not lost."""
_MARGIN_NS = 2 * FRAME_NS
"""Margin over the transit of recent frames: one is decoded with the one after it, and rounds are a frame apart."""
_FORGET = 0.02
"""How fast the delay falls again after late frames, as a share of the time that passes."""
REST_NS = 1_500_000_000
"""Silence that is passed on; after it nothing is until somebody speaks again."""
_BACKLOG_NS = 2_000_000_000
"""After a stall the sound missed meanwhile is still passed on, up to this length."""
_KEPT_NS = 15_000_000_000
"""How long the quality of transmission is kept: longer than any sentence."""
_FLOOR = 2e-4
"""Root mean square of the noise that replaces silence that was not sent."""


@dataclass(frozen=True)
class Piece:
    """20 ms at SAMPLE_RATE. t_ns: when it was captured; fresh: the first after a rest, so that counting time begins anew."""

    t_ns: int
    sound: F32
    fresh: bool


@dataclass(frozen=True)
class Reception:
    """Quality of transmission of a stretch of a voice. talking: share of its frames in which the talker was above the noise at
    their own microphone; lost: share of its time that was concealed, because its frames never arrived."""

    talking: float
    lost: float


class VoiceReader:
    """`push` messages as they arrive, and `read` at intervals.

    How late frames come depends on the microphone (a wireless one holds sound back by 200 ms) and on who else needs the
    processor: it is measured, and reading is delayed by that much. Delay does not disturb a recogniser, gaps in a sentence do.
    """

    def __init__(self) -> None:
        self._stream = VoiceStream()
        self._resampler = Resampler(float(RATE))
        noise = np.random.default_rng(3).standard_normal(FRAME)
        self._quiet = np.asarray(_FLOOR * noise, np.float32)
        self._silent_ns = REST_NS
        self._next_ns: int | None = None
        self._behind_ns = float(_FIRST_NS)
        self._talking: deque[tuple[int, bool]] = deque()
        self._made_up: deque[int] = deque()
        self._ended = True
        self._gap: list[int] = []

    @property
    def resting(self) -> bool:
        """Nobody speaks; nothing is passed on."""
        return self._silent_ns >= REST_NS

    def push(self, message: Voice, received_ns: int) -> None:
        """A frame, and when it was received."""
        late_ns = received_ns - message.header.t_ns + _MARGIN_NS
        wanted_ns = max(late_ns, self._behind_ns - _FORGET * FRAME_NS)
        self._behind_ns = min(_BEHIND_MOST_NS, max(BEHIND_NS, wanted_ns))
        self._stream.push(message.header.t_ns, message.opus, message.earlier)
        self._ended = not message.opus
        if message.opus:
            self._talking.append((message.header.t_ns, message.talking))

    def read(self, now_ns: int) -> Iterator[Piece]:
        """The sound since the last call, piece by piece, without gaps however long ago that was; nothing while nobody speaks."""
        due_ns = now_ns - round(self._behind_ns - BEHIND_NS)
        if self._next_ns is None or due_ns - self._next_ns > _BACKLOG_NS:
            self._next_ns, self._silent_ns = due_ns, REST_NS
        while self._next_ns <= due_ns:
            piece = self._read(self._next_ns)
            self._next_ns += FRAME_NS
            if piece is not None:
                yield piece
        self._forget(now_ns)

    def reception(self, begin_ns: int, end_ns: int) -> Reception:
        """Between two moments of conference time, not long ago."""
        talking = [spoke for t_ns, spoke in self._talking if begin_ns - FRAME_NS < t_ns < end_ns]
        lost = sum(begin_ns - FRAME_NS < t_ns < end_ns for t_ns in self._made_up)
        return Reception(sum(talking) / max(1, len(talking)), lost * FRAME_NS / max(FRAME_NS, end_ns - begin_ns))

    def _read(self, at_ns: int) -> Piece | None:
        before = self._stream.counters.concealed
        block = self._stream.read(float(at_ns), FRAME, float(BEHIND_NS))
        self._made_up.extend([at_ns - BEHIND_NS] * (self._stream.counters.concealed - before))
        if block is None and not self._ended:
            self._gap.append(at_ns - BEHIND_NS)  # frames are missing though no end was announced
        elif self._gap:
            self._made_up.extend(self._gap if block is not None else ())
            self._gap.clear()
        fresh = self.resting
        self._silent_ns = self._silent_ns + FRAME_NS if block is None else 0
        if self.resting:
            return None
        return Piece(at_ns - BEHIND_NS, self._resampler.feed(self._quiet if block is None else block), fresh)

    def _forget(self, now_ns: int) -> None:
        while self._made_up and self._made_up[0] < now_ns - _KEPT_NS:
            self._made_up.popleft()
        while self._talking and self._talking[0][0] < now_ns - _KEPT_NS:
            self._talking.popleft()
