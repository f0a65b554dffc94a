"""One talker as heard at one place: packets in as they come, sound out at any time, a wanted delay after its capture.

    time of a sample's capture ── delay ──► time at which it is heard

Packets wait, by their place in the stream, until they are needed. A missing one is recovered from the copy in its
successor, or made up. The delay is moved by parts in a thousand by resampling, which also takes up the drift of the
sender's sound card, and by more by time stretching; in silence it jumps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Decoder, OpusError
from vistel.audio.resample import cubic
from vistel.audio.stretch import LEAST_SHIFT, MOST_SHIFT, OVERLAP, RISE, best_shift, fade
from vistel.audio.tape import Tape

_MS = RATE // 1000
_HISTORY = 100 * _MS
_RESTART_FRAMES = 250
"""A packet further off than five seconds belongs to a stream that began anew."""
_GUESSED_MOST = 5
"""Frames made up in a row (the codec fades them out itself); then the stream is silent until it returns."""
_CLOSE = _MS // 2
"""A smaller error is left alone: half a millisecond [samples]."""
_HIT = 2
"""A correction goes on until the error is no larger [samples]."""
_SPLICE = 4 * _MS
"""Errors from here on are stretched away, smaller ones resampled."""
_JUMP = 250 * _MS
_NUDGE = 0.003
_STRETCH_SHARE = 0.12
"""How much of the time stretching may take or give, on average."""
_QUIET = 0.003
"""Root mean square below which a jump is not heard."""
_FOLLOW = 0.02
_FADE_OUT = np.linspace(1.0, 0.0, FRAME, dtype=np.float32)


@dataclass
class Counters:
    """Of one stream since it began, in frames; jumps and splices as often as they happened."""

    played: int = 0
    recovered: int = 0
    concealed: int = 0
    late: int = 0
    broken: int = 0
    splices: int = 0
    jumps: int = 0


class VoiceStream:
    """See the module. Times are conference time; every one is an argument."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._decoder = Decoder()
        self._tape = Tape()
        self._packets: dict[int, bytes] = {}
        self._newest = -1
        self._ends: int | None = None
        self._anchor_ns: float | None = None
        self._drift = 0.0
        self._last_seen: tuple[int, float] | None = None
        self._position: float | None = None
        self._nudging = False
        self._rest = 0
        self._guessed = 0
        self._tail = 0
        self._fresh = False
        self._began = 0.0
        self._delay_ns: float | None = None

    @property
    def delay_ns(self) -> float | None:
        """From capture to ear of the first sample of the last block; None while the stream is silent."""
        return self._delay_ns

    @property
    def drift_ppm(self) -> float:
        """How much faster the sender's samples come than their times say."""
        return self._drift * 1e6

    def push(self, t_ns: int, packet: bytes, earlier: Sequence[bytes] = ()) -> list[int]:
        """A packet whose first decoded sample was captured at `t_ns`; empty: silence from there on. `earlier`: the packets
        before it once more, newest first. Which of them were lost (1: the one before) and can be used is returned."""
        slot = self._slot(t_ns)
        regained = [back for back, old in enumerate(earlier, 1) if old and self._fill(slot - back, old)]
        self._take(slot, packet)
        return regained

    def _fill(self, slot: int, packet: bytes) -> bool:
        if slot in self._packets or slot * FRAME < self._tape.end:
            return False
        self._packets[slot] = packet
        self._newest = max(self._newest, slot)
        return True

    def _take(self, slot: int, packet: bytes) -> None:
        if not packet:
            self._ends = slot if slot >= self._newest else self._ends
            return
        if self._position is not None and slot * FRAME < self._tape.end:
            self.counters.late += 1
            return
        self._packets[slot] = packet
        self._newest = max(self._newest, slot)
        if self._ends is not None and slot >= self._ends and self._position is None:
            self._ends = None

    def read(self, t_ns: float, count: int, delay_ns: float) -> F32 | None:
        """(count,) samples to be heard from `t_ns` on, captured about `delay_ns` before; None: silence."""
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
        if self._fresh:
            self._fresh = False
            out[:OVERLAP] *= RISE
        self._delay_ns = t_ns - self._time_of(self._began)
        return out

    # Places in the stream

    def _slot(self, t_ns: int) -> int:
        """The number of the frame captured at `t_ns`; its place on the tape is FRAME times that."""
        if self._anchor_ns is None:
            self._anchor_ns = float(t_ns)
        offset = (t_ns - self._anchor_ns) / FRAME_NS
        slot = round(offset)
        if self._newest >= 0 and abs(slot - self._newest) > _RESTART_FRAMES and slot < self._newest:
            self._restart(t_ns)
            return 0
        slip_ns = (offset - slot) * FRAME_NS
        # The sender's samples may not quite last as long as their times say: the line is moved along with them.
        self._anchor_ns += _FOLLOW * slip_ns
        if self._last_seen is not None and slot > self._last_seen[0]:
            rate = (self._anchor_ns - self._last_seen[1]) / ((slot - self._last_seen[0]) * FRAME_NS)
            self._drift += 0.005 * (-rate - self._drift)
        self._last_seen = (slot, self._anchor_ns)
        return slot

    def _restart(self, t_ns: int) -> None:
        self._packets.clear()
        self._newest, self._ends, self._last_seen = -1, None, None
        self._tape = Tape()
        self._anchor_ns = float(t_ns)
        self._position = None

    def _sample_at(self, t_ns: float) -> float:
        assert self._anchor_ns is not None
        return (t_ns - self._anchor_ns) * (RATE * 1e-9)

    def _time_of(self, sample: float) -> float:
        assert self._anchor_ns is not None
        return self._anchor_ns + sample / (RATE * 1e-9)

    # Beginning and ending

    def _start(self, wanted: float, count: int) -> bool:
        """Begin when something is due in this block."""
        first = int(wanted) // FRAME
        for old in [s for s in self._packets if s < first]:
            del self._packets[old]
            self.counters.late += 1
        due = min(self._packets, default=None)
        if due is None or (due - 1) * FRAME >= wanted + count:
            return False
        if (due - 1) * FRAME > wanted - count and self._decoder.carries_previous(self._packets[due]):
            due -= 1  # the first frame was lost on its way
        elif due * FRAME >= wanted + count:
            return False
        self._tape.begin(due * FRAME, _HISTORY + FRAME)
        self._position = float(round(wanted))
        self._nudging, self._rest, self._guessed, self._tail = False, 0, 0, 0
        self._fresh = wanted > due * FRAME
        if self._ends is not None and self._ends <= due:
            self._ends = None
        return True

    def _stop(self) -> None:
        self._position = self._delay_ns = None
        if self._ends is not None and self._newest < self._ends:
            self._packets.clear()

    # Decoding

    def _extend(self, until: int) -> bool:
        """Decode until sample `until` is on the tape; False when the stream has ended before."""
        while self._tape.end < until:
            slot = self._tape.end // FRAME
            if self._ends is not None and slot >= self._ends:
                if self._tail == 2:
                    return False
                self._tape.append(self._decoder.conceal() * _FADE_OUT if self._tail == 0 else np.zeros(FRAME, np.float32))
                self._tail += 1
                continue
            frame = self._frame(slot)
            if frame is None:
                return False
            self._tape.append(frame)
        return True

    def _frame(self, slot: int) -> F32 | None:
        packet = self._packets.pop(slot, None)
        try:
            if packet is not None:
                out = self._decoder.decode(packet)
                self.counters.played += 1
                self._guessed = 0
                return out
            following = self._packets.get(slot + 1)
            if following is not None:
                out = self._decoder.recover(following)
                self.counters.recovered += 1
                return out
        except OpusError:
            self.counters.broken += 1
        if self._guessed >= _GUESSED_MOST and slot > self._newest:
            return None
        self._guessed += 1
        self.counters.concealed += 1
        return self._decoder.conceal()

    def _have(self, until: int) -> bool:
        """Whether packets up to there have come, so that nothing would have to be made up at the end."""
        return (until - 1) // FRAME <= self._newest

    # Sound

    def _produce(self, wanted: float, count: int) -> F32 | None:
        assert self._position is not None
        error = wanted - self._position
        self._began = self._position
        if abs(error) > _JUMP or (abs(error) > _CLOSE and self._silent_here(wanted, count)):
            return self._jump(round(wanted), count)
        self._rest = max(0, self._rest - count)
        if abs(error) > _SPLICE and self._rest == 0:
            out = self._splice(error, count)
            if out is not None:
                return out
        self._nudging = abs(error) > (_HIT if self._nudging else _CLOSE)
        if self._nudging:
            return self._nudge(error, count)
        at = round(self._position)
        if not self._extend(at + count):
            return None
        self._position = float(at + count)
        return self._tape.between(at, at + count).copy()

    def _nudge(self, error: float, count: int) -> F32 | None:
        """Play a little faster or slower."""
        assert self._position is not None
        step = 1.0 + float(np.clip(error / (8 * count), -_NUDGE, _NUDGE))
        first = int(self._position)
        last = self._position + step * count
        if not self._extend(int(last) + 4):
            return None
        begin = max(self._tape.start, first - 2)
        out = cubic(self._tape.between(begin, int(last) + 4), self._position - begin, step, count)
        self._position = last
        return out

    def _splice(self, error: float, count: int) -> F32 | None:
        """Leave out (error > 0) or repeat some milliseconds where it is not heard; None when that cannot be done now."""
        assert self._position is not None
        at = round(self._position)
        most = min(MOST_SHIFT, max(LEAST_SHIFT, int(abs(error))))
        if error > 0:
            if not self._have(at + most + count + OVERLAP):
                return None
            if not self._extend(at + most + count + OVERLAP):
                return None
            low = at + LEAST_SHIFT
        else:
            if not self._extend(at + count + OVERLAP):
                return None
            low = at - most
            if low < self._tape.start:
                return None
        high = low + most - LEAST_SHIFT
        offset, alike = best_shift(self._tape.between(at, at + OVERLAP), self._tape.between(low, high + OVERLAP))
        if alike < 0.35 and abs(error) < 3 * _SPLICE:
            return None
        target = low + offset
        joined = fade(self._tape.between(at, at + OVERLAP), self._tape.between(target, target + OVERLAP))
        if not self._extend(target + count):
            return None
        out = np.concatenate((joined, self._tape.between(target + OVERLAP, target + count)))
        self._position = float(target + count)
        self._began = float(target)
        self._rest = int(abs(target - at) / _STRETCH_SHARE)
        self.counters.splices += 1
        self._nudging = False
        return out

    def _jump(self, to: int, count: int) -> F32 | None:
        """Go on elsewhere, faded over."""
        assert self._position is not None
        at = round(self._position)
        if to < self._tape.start or not self._extend(max(at + OVERLAP, to + count)):
            return None
        out = self._tape.between(to, to + count).copy()
        if at >= self._tape.start:
            out[:OVERLAP] = fade(self._tape.between(at, at + OVERLAP), out[:OVERLAP])
        self._position = float(to + count)
        self._began = float(to)
        self.counters.jumps += 1
        self._nudging = False
        return out

    def _silent_here(self, wanted: float, count: int) -> bool:
        """Whether nothing is said where we are and where we would go; only what is decoded already is looked at."""
        assert self._position is not None
        low = round(min(self._position, wanted))
        high = round(max(self._position, wanted)) + count
        if low < self._tape.start:
            return False
        if high > self._tape.end and not (self._have(high) and self._extend(high)):
            return False
        part = self._tape.between(low, high)
        return float(np.dot(part, part)) < _QUIET**2 * len(part)
