"""Voices on their way to pages that watch a room: each packet once.

A message to a page is its format, `FORMAT`, and records, little-endian:

| bytes | what |
|---|---|
| 2 | of this record, all together |
| 1 | of the name that follows the head |
| 1 | 1 while somebody speaks, as far as the level tells |
| 8 | when the first sample of the packet, once decoded, was captured: conference time [ms], float64 |
| 4 | how long after its capture the talker's motion is shown in the room's newest frame [ms], float32 |
| | the talker's name, and an Opus packet, mono, 20 ms |
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable

from vistel.audio.opus import FRAME_NS
from vistel.audio.transit import TransitEstimate
from vistel.v1.audio_pb2 import Voice

FORMAT = 2
"""That of a room's frame is 1 (`vistel.render.frames`)."""
_RECORD = struct.Struct("<HBBdf")
_MOST_PACKETS = 100
"""Of all talkers, from one frame of the room to the next."""
_MOST_PACKET_BYTES = 1500
_RESTART_NS = 5_000_000_000
"""A packet older than the newest by more belongs to a voice that began anew."""


def record_of(name: str, t_ns: int, delay_ns: int, opus: bytes, *, talking: bool) -> bytes:
    """A record, see the module."""
    whose = name.encode()
    size = _RECORD.size + len(whose) + len(opus)
    return _RECORD.pack(size, len(whose), talking, t_ns * 1e-6, delay_ns * 1e-6) + whose + opus


class _Talker:
    def __init__(self) -> None:
        self.transit = TransitEstimate()
        self.newest_ns = -_RESTART_NS


class ForwardedVoices:
    """Time is an argument."""

    def __init__(self) -> None:
        self._talkers: dict[str, _Talker] = {}
        self._waiting: deque[tuple[str, int, bytes, bool]] = deque(maxlen=_MOST_PACKETS)

    def receive(self, name: str, message: Voice, received_ns: int) -> None:
        """Take a message of a participant's voice; one of how loud it is counts for nothing."""
        talker, t_ns = self._talkers.setdefault(name, _Talker()), message.header.t_ns
        if talker.newest_ns - t_ns > _RESTART_NS:
            talker.newest_ns = -_RESTART_NS
        if not message.opus:
            return
        talker.transit.observe(received_ns - t_ns, received_ns)
        packets = [(t_ns - back * FRAME_NS, opus) for back, opus in enumerate(message.earlier, 1)]
        for then_ns, opus in [*reversed(packets), (t_ns, message.opus)]:
            if then_ns - talker.newest_ns > FRAME_NS // 2 and 0 < len(opus) <= _MOST_PACKET_BYTES:
                talker.newest_ns = then_ns
                self._waiting.append((name, then_ns, opus, message.talking))

    def records(self, delay_ns: Callable[[str], int]) -> list[tuple[str, bytes]]:
        """Whose they are, and the records of what has come since the last call. delay_ns: from capture to picture, of a talker."""
        out = [(name, record_of(name, t_ns, delay_ns(name), opus, talking=talking)) for name, t_ns, opus, talking in self._waiting]
        self._waiting.clear()
        return out

    def needed_ns(self) -> dict[str, int]:
        """The least time from the capture of a frame to its arrival here that nearly all frames keep to, of each talker."""
        return {name: t.transit.transit_ns for name, t in self._talkers.items() if t.transit.known}
