"""The motion of one participant on the bus: in full, and for a crowd once more, thinner."""

from __future__ import annotations

from dataclasses import replace

from vistel.wire.bus import Bus
from vistel.wire.motion import Losses, MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.uplink import Pacer

THIN_HZ = 10.0
"""Frames of the thin motion a second, at most: a picture shows what was captured a tenth of a second ago."""


class MotionPublication:
    """Publishes samples, each once, as many as the uplink has room for."""

    def __init__(self, bus: Bus, participant: str, *, crowded: bool, losses: Losses = "rare", repeats: int = 0) -> None:
        """crowded: of the conference; losses, repeats: see `MotionEncoder`."""
        self._uplink = bus.uplink
        self._full = bus.publish(BY_NAME["motion"], participant=participant)
        self._encoder = MotionEncoder(losses=losses, repeats=repeats)
        self._thin = bus.publish(BY_NAME["motion_thin"], participant=participant) if crowded else None
        self._thin_encoder = MotionEncoder(losses="many")
        self._full_pacer, self._thin_pacer = Pacer(), Pacer()

    @property
    def next_seq(self) -> int:
        """The `seq` of the sample that is put next."""
        return self._full.next_seq

    def put(self, sample: MotionSample) -> None:
        """Send a sample, with the number `next_seq`, if the uplink has room for it."""
        if self._full_pacer.due(sample.t_ns, self._uplink.motion_hz):
            self._full.put(self._encoder.encode(sample))
        if self._thin is not None and self._thin_pacer.due(sample.t_ns, THIN_HZ):
            self._thin.put(self._thin_encoder.encode(replace(sample, seq=self._thin.next_seq)))
