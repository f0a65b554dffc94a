"""The motion of one participant on the bus: in full, and for a crowd once more, thinner."""

from __future__ import annotations

from dataclasses import replace

from vistel.wire.bus import Bus
from vistel.wire.motion import Losses, MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME

THIN_NS = 100_000_000
"""From one frame of the thin motion to the next, at least: a picture shows what was captured so long ago."""
EARLY_NS = 5_000_000
"""A frame may come so much earlier: captures are no exact sixtieths of a second apart."""


class MotionPublication:
    """Publishes samples, each once."""

    def __init__(self, bus: Bus, participant: str, *, crowded: bool, losses: Losses = "rare", repeats: int = 0) -> None:
        """crowded: of the conference; losses, repeats: see `MotionEncoder`."""
        self._full = bus.publish(BY_NAME["motion"], participant=participant)
        self._encoder = MotionEncoder(losses=losses, repeats=repeats)
        self._thin = bus.publish(BY_NAME["motion_thin"], participant=participant) if crowded else None
        self._thin_encoder = MotionEncoder(losses="many")
        self._thin_ns = 0

    @property
    def next_seq(self) -> int:
        """The `seq` of the sample that is put next."""
        return self._full.next_seq

    def put(self, sample: MotionSample) -> None:
        """Send a sample, with the number `next_seq`."""
        self._full.put(self._encoder.encode(sample))
        passed_ns = sample.t_ns - self._thin_ns
        if self._thin is not None and not 0 <= passed_ns < THIN_NS - EARLY_NS:
            self._thin_ns = sample.t_ns
            self._thin.put(self._thin_encoder.encode(replace(sample, seq=self._thin.next_seq)))
