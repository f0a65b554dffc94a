"""Publishes the voice of one participant."""

from __future__ import annotations

import itertools
import logging
from collections import deque

from prometheus_client import Counter, Gauge

from vistel.arrays import F32
from vistel.audio.capture import MicrophoneCapture
from vistel.audio.levels import SILENT_DB, Level, Meter
from vistel.audio.microphone_switches import MicrophoneSwitch
from vistel.audio.opus import FRAME_NS, Encoder
from vistel.audio.visemes import to_bytes
from vistel.speech.visemes.reader import VisemeReader
from vistel.v1.audio_pb2 import SoundStatus, Voice
from vistel.wire.bus import Publication
from vistel.wire.link.voice_levels import VoiceLevels
from vistel.wire.uplink import MOST_FRAMES, Uplink

log = logging.getLogger("vistel.audio")

_SENT = Counter("vistel_audio_sent_frames_total", "Voice frames sent", ["participant"])
_CLIPPED = Counter("vistel_audio_clipped_frames_total", "Frames of an over-driven microphone", ["participant"])
_LEVEL = Gauge("vistel_audio_microphone_level_db", "Level of the microphone, 0 = full scale", ["participant"])

_SILENT_BYTES = 2
"""A packet of so many bytes or fewer is silence."""
_CLIP_SHOWN_NS = 1_000_000_000


class VoiceSender:
    """From a microphone to Voice messages; `step` is called every 20 ms."""

    def __init__(
        self,
        participant: str,
        capture: MicrophoneCapture,
        publication: Publication,
        bitrate: int,
        switch: MicrophoneSwitch,
        uplink: Uplink,
        repeats: int = 0,
        levels: Publication | None = None,
    ) -> None:
        """repeats: how many earlier packets each message repeats; levels: where a crowd is told how loud the voice is.

        Where `uplink` is thin, a message carries several frames, each once, and fewer bits of each.
        """
        self._levels = VoiceLevels(levels)
        self.participant, self.switch = participant, switch
        self.level = Level()
        self._capture, self._publication = capture, publication
        self._encoder, self._bitrate, self._uplink = Encoder(1, bitrate), bitrate, uplink
        self._repeats = repeats
        self._earlier: deque[tuple[int, bytes]] = deque(maxlen=max(repeats, MOST_FRAMES - 1))
        self._unsent = 0
        """How many of them were in no message yet."""
        self._meter, self._reader, self._visemes = Meter(), VisemeReader(), b""
        self._sounding = False
        self._clipped_ns: int | None = None
        self._warned = False

    def step(self, now_ns: int) -> None:
        """Publish the new frames."""
        for t_ns, pcm in self._capture.frames(now_ns):
            self._frame(t_ns, pcm)
        if not self._capture.is_open:
            self.level = Level()
            self._end(now_ns)

    def _frame(self, t_ns: int, pcm: F32) -> None:
        self.level = self._meter.measure(pcm)
        if self.level.clipped:
            self._count_clipped(t_ns)
        if not self.switch.open or self.level.idle or self.level.rms_db <= SILENT_DB:
            self._end(t_ns)
            return
        self._visemes = to_bytes(self._reader.feed(pcm))
        self._encoder.set_bitrate(min(self._bitrate, self._uplink.voice[1]))
        packet = self._encoder.encode(pcm)
        if len(packet) <= _SILENT_BYTES:
            self._end(t_ns)
            return
        self._sounds(True)
        self._put(t_ns - self._encoder.lookahead_ns, packet)
        _SENT.labels(self.participant).inc()

    def _sounds(self, whether: bool) -> None:
        self._sounding = whether
        self._uplink.speaks(self.participant, whether)

    def _end(self, t_ns: int) -> None:
        """Publish once that silence begins."""
        if self._sounding:
            self._sounds(False)
            self._visemes = b""
            self._put(t_ns - self._encoder.lookahead_ns, b"")

    def _put(self, t_ns: int, packet: bytes) -> None:
        """Send the frame of `t_ns`, or keep it for the next message; an empty one, which ends a talk, is sent at once."""
        together = self._uplink.voice[0]
        if packet and self._unsent + 1 < together:
            self._earlier.appendleft((t_ns, packet))
            self._unsent += 1
            return
        message = Voice(opus=packet, level_db=self.level.rms_db, clipped=self.level.clipped, visemes=self._visemes)
        message.talking, message.header.t_ns = bool(packet) and self.level.talking, t_ns
        repeated = self._unsent if together > 1 else max(self._unsent, self._repeats)
        for back, (then_ns, earlier) in enumerate(itertools.islice(self._earlier, repeated), 1):
            if t_ns - then_ns == back * FRAME_NS:
                message.earlier.append(earlier)
        self._earlier.appendleft((t_ns, packet))
        self._unsent = 0
        self._publication.put(message)
        self._levels.tell(message)

    def _count_clipped(self, t_ns: int) -> None:
        _CLIPPED.labels(self.participant).inc()
        self._clipped_ns = t_ns
        if not self._warned:
            self._warned = True
            log.warning("event=microphone_clipped participant=%s reason='too loud; turn down its gain'", self.participant)

    def fill(self, message: SoundStatus.Microphone, now_ns: int) -> None:
        """Fill in the status."""
        message.participant, message.source = self.participant, self._capture.about
        message.open, message.detail = self._capture.is_open, self._capture.detail
        message.muted, message.push_to_talk = not self.switch.open, self.switch.push_to_talk
        message.level_db, message.rate_hz = self.level.rms_db, self._capture.rate_hz
        message.clipped = self._clipped_ns is not None and now_ns - self._clipped_ns < _CLIP_SHOWN_NS
        _LEVEL.labels(self.participant).set(self.level.rms_db)

    def close(self) -> None:
        """Close the microphone."""
        self._capture.close()
