"""The voice of a guest's page: a record for every 20 ms of their microphone, and what of it is believed.

A record is a message of its own: "VP", the kind, a zero, when the first of its samples, once decoded, was captured (conference
time, float64 in milliseconds, little-endian), and one Opus packet. The gateway asks `voice_of` and `VoiceGate`, the guest's site
decodes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable

from vistel.arrays import F32, F64
from vistel.audio.levels import SILENT_DB, Meter
from vistel.audio.opus import FRAME_NS, Decoder, OpusError
from vistel.audio.visemes import to_bytes
from vistel.v1.audio_pb2 import Voice

VOICE = 4
"""The kind of the record; those below are in `vistel.protocol.pages.pointer`."""
MOST_PACKET_BYTES = 320
"""Of a packet: 128 kbit/s, which no voice needs."""
MOST_BYTES_PER_S = 8_000
"""Of a voice over a second: 64 kbit/s."""
MOST_AHEAD_NS = 100_000_000
"""How far a page's estimate of conference time may be ahead."""
MOST_LATE_NS = 2_000_000_000
"""What was captured longer ago is of no use to anybody."""
_BURST = 100
"""Records that may come at once after a page was held up."""
_HEAD = struct.Struct("<2sBBd")
_SILENT_BYTES = 2
"""A packet of so many bytes or fewer is silence."""
_NEAR = 0.5
"""Of a frame: what was captured sooner after the one before says the same again."""


def is_voice(data: bytes) -> bool:
    """Whether a page's record is one of its voice."""
    return data[:3] == b"VP" + bytes((VOICE,))


def voice_record(t_ns: int, opus: bytes) -> bytes:
    """What a page sends for a packet captured at `t_ns`."""
    return _HEAD.pack(b"VP", VOICE, 0, t_ns * 1e-6) + opus


def voice_of(data: bytes, now_ns: int) -> tuple[int, bytes] | None:
    """When the packet of a record was captured [ns], and the packet; None where it is no record, too large or from the future."""
    if not is_voice(data) or not _HEAD.size < len(data) <= _HEAD.size + MOST_PACKET_BYTES:
        return None
    t_ms = _HEAD.unpack_from(data)[3]
    if not math.isfinite(t_ms) or not 0.0 <= t_ms * 1e6 <= now_ns + MOST_AHEAD_NS:
        return None
    return round(t_ms * 1e6), data[_HEAD.size :]


class VoiceGate:
    """Lets through of one voice what is in order, in time, and no more than a voice needs. Time is an argument."""

    def __init__(self) -> None:
        self._newest_ns = -FRAME_NS
        self._at_ns: int | None = None
        self._frames, self._bytes = float(_BURST), float(MOST_BYTES_PER_S)

    def admits(self, t_ns: int, size: int, now_ns: int) -> bool:
        """Whether the packet of `size` bytes captured at `t_ns` is passed on."""
        passed_ns = 0 if self._at_ns is None else max(0, now_ns - self._at_ns)
        self._at_ns = now_ns
        self._frames = min(float(_BURST), self._frames + passed_ns / FRAME_NS)
        self._bytes = min(float(MOST_BYTES_PER_S), self._bytes + passed_ns * 1e-9 * MOST_BYTES_PER_S)
        if now_ns - t_ns > MOST_LATE_NS or t_ns - self._newest_ns < _NEAR * FRAME_NS:
            return False
        if self._frames < 1.0 or self._bytes < size:
            return False
        self._frames, self._bytes, self._newest_ns = self._frames - 1.0, self._bytes - size, t_ns
        return True


class PageVoice:
    """From the records of one page to Voice messages."""

    def __init__(self, visemes: Callable[[F32], F64]) -> None:
        """visemes: reads them from the next samples, as `vistel.speech.visemes`."""
        self._decoder, self._meter, self._gate, self._visemes = Decoder(), Meter(), VoiceGate(), visemes
        self._sounding = False

    def message(self, data: bytes, now_ns: int) -> Voice | None:
        """The message of a record that arrived at `now_ns`; None for what is no voice, and for what the gate holds back."""
        found = voice_of(data, now_ns)
        if found is None or not self._gate.admits(found[0], len(found[1]), now_ns):
            return None
        t_ns, opus = found
        sounded, self._sounding = self._sounding, len(opus) > _SILENT_BYTES
        if not self._sounding:
            return _silence(t_ns) if sounded else None
        try:
            samples = self._decoder.decode(opus)
        except OpusError:
            return None
        level, visemes = self._meter.measure(samples), to_bytes(self._visemes(samples))
        message = Voice(opus=opus, level_db=level.rms_db, clipped=level.clipped, talking=level.talking, visemes=visemes)
        message.header.t_ns = t_ns
        return message


def _silence(t_ns: int) -> Voice:
    """Silence from here on."""
    message = Voice(level_db=SILENT_DB)
    message.header.t_ns = t_ns
    return message
