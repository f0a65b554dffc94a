"""The jitter buffer of one voice: packets in as they arrive, samples out at a wanted delay after their capture.

    time of a sample's capture ── delay ──► time at which it is heard

A missing packet is recovered from the copy in its successor, or concealed. The delay is changed by parts in a thousand by
resampling, which also removes the drift of the sender's sound card; by more by time stretching; in silence it jumps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Decoder, OpusError
from vistel.audio.resample import cubic_resample
from vistel.audio.sample_buffer import SampleBuffer
from vistel.audio.stretch import LEAST_SHIFT, MOST_SHIFT, OVERLAP, RISE, best_shift, fade

_MS = RATE // 1000
_HISTORY = 100 * _MS
_RESTART_FRAMES = 250
"""A packet older by more than five seconds belongs to a stream that began anew."""
_MOST_CONCEALED = 5
"""Frames concealed in a row (the codec fades them out); then the stream is silent until packets arrive."""
_TOLERANCE = _MS // 2
"""A smaller error is not corrected: half a millisecond [samples]."""
_CORRECTED = 2
"""A correction ends when the error is no larger [samples]."""
_SPLICE = 4 * _MS
"""Larger errors are corrected by time stretching, smaller ones by resampling [samples]."""
_JUMP = 250 * _MS
_MOST_RESAMPLING = 0.003
_STRETCH_SHARE = 0.12
"""Time stretching changes the speed by at most this share, on average."""
_QUIET = 0.003
"""Root mean square below which a jump is inaudible."""
_FOLLOW = 0.02
_FADE_OUT = np.linspace(1.0, 0.0, FRAME, dtype=np.float32)


@dataclass
class Counters:
    """Counts of one stream since it began: frames, and splices and jumps."""

    played: int = 0
    recovered: int = 0
    concealed: int = 0
    late: int = 0
    broken: int = 0
    splices: int = 0
    jumps: int = 0


class VoiceStream:
    """The jitter buffer of one voice. All times are conference time [ns]."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._decoder = Decoder()
        self._buffer = SampleBuffer()
        self._packets: dict[int, bytes] = {}
        self._newest = -1
        self._end_slot: int | None = None
        self._anchor_ns: float | None = None
        self._drift = 0.0
        self._last_seen: tuple[int, float] | None = None
        self._position: float | None = None
        self._resampling = False
        self._splice_pause = 0
        self._concealed_in_row = 0
        self._faded_frames = 0
        self._fade_in = False
        self._began = 0.0
        self._delay_ns: float | None = None

    @property
    def delay_ns(self) -> float | None:
        """Delay of the first sample of the last block, capture to ear; None while the stream is silent."""
        return self._delay_ns

    @property
    def drift_ppm(self) -> float:
        """How much faster the sender's samples come than their times [ppm]."""
        return self._drift * 1e6

    def push(self, t_ns: int, packet: bytes, earlier: Sequence[bytes] = ()) -> list[int]:
        """Take a packet whose first decoded sample was captured at `t_ns`; empty: silence from there on. earlier: repeats of
        the packets before it, newest first. Returns which of them were lost and can still be used (1: the one before)."""
        slot = self._slot(t_ns)
        recovered = [back for back, old in enumerate(earlier, 1) if old and self._keep_if_lost(slot - back, old)]
        self._keep(slot, packet)
        return recovered

    def _keep_if_lost(self, slot: int, packet: bytes) -> bool:
        if slot in self._packets or slot * FRAME < self._buffer.end:
            return False
        self._packets[slot] = packet
        self._newest = max(self._newest, slot)
        return True

    def _keep(self, slot: int, packet: bytes) -> None:
        if not packet:
            self._end_slot = slot if slot >= self._newest else self._end_slot
            return
        if self._position is not None and slot * FRAME < self._buffer.end:
            self.counters.late += 1
            return
        self._packets[slot] = packet
        self._newest = max(self._newest, slot)
        if self._end_slot is not None and slot >= self._end_slot and self._position is None:
            self._end_slot = None

    def read(self, t_ns: float, count: int, delay_ns: float) -> F32 | None:
        """(count,) samples to be heard from `t_ns` on, captured about `delay_ns` earlier; None: silence."""
        if self._anchor_ns is None:
            return None
        wanted = self._sample_at(t_ns - delay_ns)
        if self._position is None and not self._start(wanted, count):
            self._delay_ns = None
            return None
        assert self._position is not None
        out = self._produce(wanted, count)
        if out is None:
            self._stop()
            return None
        if self._fade_in:
            self._fade_in = False
            out[:OVERLAP] *= RISE
        self._delay_ns = t_ns - self._time_of(self._began)
        return out

    # Slots and times

    def _slot(self, t_ns: int) -> int:
        """Number of the frame captured at `t_ns`; its first sample has FRAME times that number."""
        if self._anchor_ns is None:
            self._anchor_ns = float(t_ns)
        offset = (t_ns - self._anchor_ns) / FRAME_NS
        slot = round(offset)
        if self._newest >= 0 and abs(slot - self._newest) > _RESTART_FRAMES and slot < self._newest:
            self._restart(t_ns)
            return 0
        slip_ns = (offset - slot) * FRAME_NS
        # The sender's sample rate differs a little from RATE: the anchor follows.
        self._anchor_ns += _FOLLOW * slip_ns
        if self._last_seen is not None and slot > self._last_seen[0]:
            rate = (self._anchor_ns - self._last_seen[1]) / ((slot - self._last_seen[0]) * FRAME_NS)
            self._drift += 0.005 * (-rate - self._drift)
        self._last_seen = (slot, self._anchor_ns)
        return slot

    def _restart(self, t_ns: int) -> None:
        self._packets.clear()
        self._newest, self._end_slot, self._last_seen = -1, None, None
        self._buffer = SampleBuffer()
        self._anchor_ns = float(t_ns)
        self._position = None

    def _sample_at(self, t_ns: float) -> float:
        assert self._anchor_ns is not None
        return (t_ns - self._anchor_ns) * (RATE * 1e-9)

    def _time_of(self, sample: float) -> float:
        assert self._anchor_ns is not None
        return self._anchor_ns + sample / (RATE * 1e-9)

    # Begin and end

    def _start(self, wanted: float, count: int) -> bool:
        """Begin if a packet is due in this block."""
        first = int(wanted) // FRAME
        for old in [s for s in self._packets if s < first]:
            del self._packets[old]
            self.counters.late += 1
        due = min(self._packets, default=None)
        if due is None or (due - 1) * FRAME >= wanted + count:
            return False
        if (due - 1) * FRAME > wanted - count and self._decoder.carries_previous(self._packets[due]):
            due -= 1  # the first frame was lost
        elif due * FRAME >= wanted + count:
            return False
        self._buffer.begin(due * FRAME, _HISTORY + FRAME)
        self._position = float(round(wanted))
        self._resampling, self._splice_pause, self._concealed_in_row, self._faded_frames = False, 0, 0, 0
        self._fade_in = wanted > due * FRAME
        if self._end_slot is not None and self._end_slot <= due:
            self._end_slot = None
        return True

    def _stop(self) -> None:
        self._position = self._delay_ns = None
        if self._end_slot is not None and self._newest < self._end_slot:
            self._packets.clear()

    # Decoding

    def _extend(self, until: int) -> bool:
        """Decode up to sample `until`; False if the stream ends before it."""
        while self._buffer.end < until:
            slot = self._buffer.end // FRAME
            if self._end_slot is not None and slot >= self._end_slot:
                if self._faded_frames == 2:
                    return False
                self._buffer.append(self._decoder.conceal() * _FADE_OUT if self._faded_frames == 0 else np.zeros(FRAME, np.float32))
                self._faded_frames += 1
                continue
            frame = self._frame(slot)
            if frame is None:
                return False
            self._buffer.append(frame)
        return True

    def _frame(self, slot: int) -> F32 | None:
        packet = self._packets.pop(slot, None)
        try:
            if packet is not None:
                out = self._decoder.decode(packet)
                self.counters.played += 1
                self._concealed_in_row = 0
                return out
            following = self._packets.get(slot + 1)
            if following is not None:
                out = self._decoder.recover(following)
                self.counters.recovered += 1
                return out
        except OpusError:
            self.counters.broken += 1
        if self._concealed_in_row >= _MOST_CONCEALED and slot > self._newest:
            return None
        self._concealed_in_row += 1
        self.counters.concealed += 1
        return self._decoder.conceal()

    def _has_arrived(self, until: int) -> bool:
        """Whether packets up to sample `until` have arrived, so that the end need not be concealed."""
        return (until - 1) // FRAME <= self._newest

    # Output

    def _produce(self, wanted: float, count: int) -> F32 | None:
        assert self._position is not None
        error = wanted - self._position
        self._began = self._position
        if abs(error) > _JUMP or (abs(error) > _TOLERANCE and self._is_silent(wanted, count)):
            return self._jump(round(wanted), count)
        self._splice_pause = max(0, self._splice_pause - count)
        if abs(error) > _SPLICE and self._splice_pause == 0:
            out = self._splice(error, count)
            if out is not None:
                return out
        self._resampling = abs(error) > (_CORRECTED if self._resampling else _TOLERANCE)
        if self._resampling:
            return self._resample(error, count)
        at = round(self._position)
        if not self._extend(at + count):
            return None
        self._position = float(at + count)
        return self._buffer.between(at, at + count).copy()

    def _resample(self, error: float, count: int) -> F32 | None:
        """Play a little faster or slower, by resampling."""
        assert self._position is not None
        step = 1.0 + float(np.clip(error / (8 * count), -_MOST_RESAMPLING, _MOST_RESAMPLING))
        first = int(self._position)
        last = self._position + step * count
        if not self._extend(int(last) + 4):
            return None
        begin = max(self._buffer.start, first - 2)
        out = cubic_resample(self._buffer.between(begin, int(last) + 4), self._position - begin, step, count)
        self._position = last
        return out

    def _splice(self, error: float, count: int) -> F32 | None:
        """Skip (error > 0) or repeat some milliseconds, by time stretching; None if that is not possible now."""
        assert self._position is not None
        at = round(self._position)
        most = min(MOST_SHIFT, max(LEAST_SHIFT, int(abs(error))))
        if error > 0:
            if not self._has_arrived(at + most + count + OVERLAP):
                return None
            if not self._extend(at + most + count + OVERLAP):
                return None
            low = at + LEAST_SHIFT
        else:
            if not self._extend(at + count + OVERLAP):
                return None
            low = at - most
            if low < self._buffer.start:
                return None
        high = low + most - LEAST_SHIFT
        offset, similarity = best_shift(self._buffer.between(at, at + OVERLAP), self._buffer.between(low, high + OVERLAP))
        if similarity < 0.35 and abs(error) < 3 * _SPLICE:
            return None
        target = low + offset
        joined = fade(self._buffer.between(at, at + OVERLAP), self._buffer.between(target, target + OVERLAP))
        if not self._extend(target + count):
            return None
        out = np.concatenate((joined, self._buffer.between(target + OVERLAP, target + count)))
        self._position = float(target + count)
        self._began = float(target)
        self._splice_pause = int(abs(target - at) / _STRETCH_SHARE)
        self.counters.splices += 1
        self._resampling = False
        return out

    def _jump(self, to: int, count: int) -> F32 | None:
        """Cross-fade to another position."""
        assert self._position is not None
        at = round(self._position)
        if to < self._buffer.start or not self._extend(max(at + OVERLAP, to + count)):
            return None
        out = self._buffer.between(to, to + count).copy()
        if at >= self._buffer.start:
            out[:OVERLAP] = fade(self._buffer.between(at, at + OVERLAP), out[:OVERLAP])
        self._position = float(to + count)
        self._began = float(to)
        self.counters.jumps += 1
        self._resampling = False
        return out

    def _is_silent(self, wanted: float, count: int) -> bool:
        """Whether there is silence from the position to the wanted one."""
        assert self._position is not None
        low = round(min(self._position, wanted))
        high = round(max(self._position, wanted)) + count
        if low < self._buffer.start:
            return False
        if high > self._buffer.end and not (self._has_arrived(high) and self._extend(high)):
            return False
        part = self._buffer.between(low, high)
        return float(np.dot(part, part)) < _QUIET**2 * len(part)
