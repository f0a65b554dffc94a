"""Samples of one participant to messages."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64, I64
from vistel.v1.motion_pb2 import Motion
from vistel.wire.motion_codec import codec_kernels as k
from vistel.wire.motion_codec.layout import NUMBERS, USUAL_GRAIN, scale
from vistel.wire.motion_codec.model import NEWEST, table
from vistel.wire.motion_codec.references import PLANS, Losses, key_frames
from vistel.wire.motion_codec.sample import ALL_STALE, PRESENT, MotionSample, flat

FULL_INTERVAL_NS = 400_000_000
"""From one full key frame to the next, at most."""
FRAME_NS = 1_000_000_000 // 60
HYSTERESIS = 0.55
"""A number stays at its last sent value until it is this many steps away, so that noise does not make what is still
tremble."""
MOST_BYTES = 1024
"""No frame is longer."""
_ZEROS: I64 = np.zeros(NUMBERS, np.int64)


class _Sent(NamedTuple):
    """A frame that others may refer to. values: (NUMBERS,) steps; change: (NUMBERS,) since its own reference, `span` frames
    before."""

    seq: int
    values: I64
    change: I64
    span: int
    stale: int


class MotionEncoder:
    """Encodes the samples of one participant. Publish each message once; `Publication.next_seq` is the `seq` to give a sample.

    A `seq` that is not above the last one starts the stream anew.
    """

    def __init__(
        self, *, grain: int = USUAL_GRAIN, losses: Losses = "rare", hysteresis: float = HYSTERESIS, repeats: int = 0
    ) -> None:
        """grain: index of `GRAINS_TENTHS`. losses: how often single frames are expected to be lost; the more often, the less
        each loss costs and the larger the frames. hysteresis: see HYSTERESIS. repeats: how many earlier frames each
        message repeats."""
        self._grain, self._hysteresis = grain, hysteresis
        self._plan = PLANS[losses]
        self._key_frames = key_frames(self._plan)
        self._table = table(NEWEST, grain)
        self._scale = scale(grain)
        self._out = np.zeros(MOST_BYTES, np.uint8)
        self._work = np.zeros(k.WORK_SIZE, np.int64)
        self._last_values = np.full(NUMBERS, np.nan)
        self._sent: list[_Sent] = []
        self._recent: deque[tuple[int, int, bytes]] = deque(maxlen=repeats)
        self._full_ns = self._last_ns = self._mask = self._last_seq = 0

    def encode(self, sample: MotionSample) -> Motion:
        """The message of a sample. Numbers that are not finite are sent as 0."""
        raw, mask = flat(sample)
        values = self._quantise(raw)
        if self._must_be_full(sample, mask):
            self._sent.clear()
            self._full_ns = sample.t_ns
        place = len(self._sent)
        key = self._sent[place - self._plan[place]] if place else None
        stale = int(sample.stale) & ALL_STALE
        header = [0] * k.HEADER_SIZE
        header[k.STALE] = k.SAME if stale == (0 if key is None else key.stale) else stale
        span = 0
        if key is None:
            header[k.IS_FULL], header[k.VERSION], header[k.PARTS], header[k.GRAIN] = 1, NEWEST, mask, self._grain
        else:
            span = sample.seq - key.seq
            header[k.DISTANCE], header[k.SPAN], header[k.KEEP] = span, key.span, int(place in self._key_frames)
        self._work[: k.HEADER_SIZE] = header
        before, change = (_ZEROS, _ZEROS) if key is None else (key.values, key.change)
        size = k.encode_frame(self._out, self._work, values, before, change, PRESENT[mask], self._table)
        self._sent.append(_Sent(sample.seq, values, values - before if span else _ZEROS, span, stale))
        self._last_seq, self._last_ns, self._mask = sample.seq, sample.t_ns, mask
        out = Motion()
        out.header.seq, out.header.t_ns = sample.seq, sample.t_ns
        out.frame = self._out[:size].tobytes()
        for seq, t_ns, frame in self._recent:
            if seq < sample.seq:
                out.earlier.add(back=sample.seq - seq, t_ns=t_ns, frame=frame)
        self._recent.append((sample.seq, sample.t_ns, out.frame))
        return out

    def _quantise(self, raw: F64) -> I64:
        values, s = np.empty(NUMBERS, np.int64), self._scale
        k.quantise(raw, s.step, s.low, s.high, self._hysteresis, self._last_values, values)
        return values

    def _must_be_full(self, sample: MotionSample, mask: int) -> bool:
        if not self._sent or len(self._sent) == len(self._plan) or sample.seq <= self._last_seq or mask != self._mask:
            return True
        # Full already if the next frame would come too late.
        late = sample.t_ns + FRAME_NS - self._full_ns > FULL_INTERVAL_NS
        return late or sample.t_ns < self._last_ns
