"""Messages of one participant to samples.

A message that arrives is only looked at: which frame it refers to, whether that one was heard. Who draws ten pictures a
second has few of the sixty frames worked out, with those that they refer to.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from vistel.arrays import I64, U8
from vistel.v1.motion_pb2 import Motion
from vistel.wire.motion_codec import codec_kernels as k
from vistel.wire.motion_codec.encoder import MOST_BYTES
from vistel.wire.motion_codec.layout import NUMBERS, PARTS, PLACES, scale
from vistel.wire.motion_codec.lists import ListKey, parts_of, read_key, well_formed
from vistel.wire.motion_codec.model import VERSIONS, table
from vistel.wire.motion_codec.sample import BITS, MASKS, THERE, MotionSample, sample_of

KEYS_KEPT = 8
OLDEST_KEY_NS = 1_000_000_000
"""A frame never refers to a key frame older than this; one that says so is from another life of its sender."""
HEARD_KEPT = 64
"""Frames that are known to have been opened, a second of them: their repetitions push no key frame out."""
MOST_WAITING = 32
"""So many frames that refer to each other are left to be worked out, no more."""
_NOTHING: I64 = np.zeros(NUMBERS, np.int64)


class MotionFrame:
    """A message whose numbers are worked out when they are asked for.

    seq, t_ns: of the message's header. waiting: how many frames may have to be worked out for this one.
    """

    __slots__ = (
        "_change",
        "_data",
        "_grain",
        "_mask",
        "_reference",
        "_span",
        "_stale",
        "_values",
        "_version",
        "_whole",
        "_work",
        "seq",
        "t_ns",
        "waiting",
    )

    def __init__(self, seq: int, t_ns: int, data: U8, work: I64, reference: MotionFrame | None) -> None:
        """data: the bytes; work: what `kernels.begin_frame` has left; reference: the key frame, None for a full frame."""
        self.seq, self.t_ns = seq, t_ns
        self._data, self._work, self._reference = data, work, reference
        self._values: I64 | None = None
        self._change, self._span, self._whole = _NOTHING, 0, True
        stale = int(work[k.STALE])
        if reference is None:
            self._version, self._mask, self._grain = int(work[k.VERSION]), int(work[k.HAS]), int(work[k.GRAIN])
            self._stale = 0 if stale == k.SAME else stale
            self.waiting = 1
        else:
            self._version, self._mask, self._grain = reference._version, reference._mask, reference._grain
            self._stale = reference._stale if stale == k.SAME else stale
            self._span = int(work[k.DISTANCE])
            self.waiting = 1 + reference.waiting

    def sample(self) -> MotionSample:
        """What the participant does."""
        return sample_of(self.seq, self.t_ns, self._worked_out() * scale(self._grain).step, self._mask, self._stale)

    @property
    def whole(self) -> bool:
        """False where working it out has shown that its bytes, or those it refers to, are damaged; `sample` gives what they
        say all the same."""
        return self._whole

    def numbers(self) -> tuple[I64, bool]:
        """The whole numbers, (NUMBERS,); and whether the bytes seem undamaged."""
        return self._worked_out(), self._whole

    def _worked_out(self) -> I64:
        if self._values is None:
            chain: list[MotionFrame] = []
            frame: MotionFrame | None = self
            while frame is not None and frame._values is None:
                chain.append(frame)
                frame = frame._reference
            while chain:
                chain.pop()._work_out()
            assert self._values is not None
        return self._values

    def _work_out(self) -> None:
        """The numbers, those of the reference being known."""
        values, reference = np.empty(NUMBERS, np.int64), self._reference
        before, change = _NOTHING, _NOTHING
        if reference is not None and reference._values is not None:
            before, change = reference._values, reference._change
            self._work[k.SPAN] = reference._span
        whole = k.decode_frame(self._data, self._work, values, before, change, THERE[self._mask], table(self._version, self._grain))
        self._whole = bool(whole) and (reference is None or reference._whole)
        if reference is not None and self._work[k.KEEP]:
            self._change = values - before
        self._values, self._reference, self.waiting = values, None, 0


class ListFrame:
    """A message as older versions sent it; see `MotionFrame`."""

    __slots__ = ("_key", "_message", "seq", "t_ns")
    whole = True

    def __init__(self, message: Motion, key: ListKey) -> None:
        self.seq: int = message.header.seq
        self.t_ns: int = message.header.t_ns
        self._message, self._key = message, key

    def sample(self) -> MotionSample:
        """What the participant does."""
        message = self._message
        parts = parts_of(message, self._key, message.key_seq != self.seq)
        numbers, mask = np.zeros(NUMBERS), 0
        for part in PARTS:
            if part in parts:
                numbers[PLACES[part]] = parts[part]
                mask |= BITS.get(part, 0)
        return sample_of(self.seq, self.t_ns, numbers, mask, message.stale & 0xFF)


class MotionDecoder:
    """Messages of one participant to samples. A late joiner waits for the first full key frame, 0.5 s at most."""

    def __init__(self) -> None:
        self._keys: dict[int, MotionFrame] = {}
        self._lists: dict[int, ListKey] = {}
        self._opened: deque[tuple[int, int]] = deque(maxlen=HEARD_KEPT)
        self._regained: deque[MotionFrame] = deque(maxlen=HEARD_KEPT)

    def decode(self, message: Motion) -> MotionSample | None:
        """The sample, or None: its key frame has not arrived, or the message is broken."""
        frame = self.open(message)
        if frame is None:
            return None
        sample = frame.sample()
        return sample if frame.whole else None

    def open(self, message: Motion) -> MotionFrame | ListFrame | None:
        """As `decode`, without the work; every message has to be opened, in the order they arrive."""
        if not message.frame:
            return self._open_lists(message)
        header = message.header
        for past in message.earlier:
            seq = header.seq - past.back
            if (seq, past.t_ns) not in self._opened and past.t_ns < header.t_ns:
                regained = self._open(past.frame, seq, past.t_ns)
                if regained is not None:
                    self._regained.append(regained)
        return self._open(message.frame, header.seq, header.t_ns)

    def regained(self) -> list[MotionFrame]:
        """What later messages have brought of lost ones since the last call, oldest first; older than the newest opened."""
        out = list(self._regained)
        self._regained.clear()
        return out

    def _open(self, frame: bytes, seq: int, t_ns: int) -> MotionFrame | None:
        if not frame or len(frame) > MOST_BYTES or frame[-1] == 0:
            return None
        data = np.frombuffer(bytearray(frame), np.uint8)  # not read-only: one kernel for both directions
        work = np.empty(k.WORK_SIZE, np.int64)
        k.begin_frame(data, work)
        reference = None
        if work[k.IS_FULL]:
            if work[k.VERSION] not in VERSIONS or work[k.HAS] >= MASKS:
                return None
        else:
            reference = self._keys.get(seq - int(work[k.DISTANCE]))
            if reference is None or not reference.whole or not 0 <= t_ns - reference.t_ns <= OLDEST_KEY_NS:
                return None
        opened = MotionFrame(seq, t_ns, data, work, reference)
        known = (seq, t_ns) in self._opened
        if not known:
            self._opened.append((seq, t_ns))
        if opened.waiting > MOST_WAITING:
            opened.numbers()
        held = self._keys.get(seq)
        if work[k.KEEP] and (not known or (held is not None and not held.whole)):
            self._keys.pop(seq, None)
            self._keys[seq] = opened
            if len(self._keys) > KEYS_KEPT:
                del self._keys[next(iter(self._keys))]
        return opened

    def _open_lists(self, message: Motion) -> ListFrame | None:
        if not well_formed(message):
            return None
        seq = message.header.seq
        if message.key_seq == seq:
            key = self._lists[seq] = read_key(message)
            while len(self._lists) > 4:
                del self._lists[next(iter(self._lists))]
            return ListFrame(message, key)
        found = self._lists.get(message.key_seq)
        if found is None or not 0 <= message.header.t_ns - found.t_ns <= OLDEST_KEY_NS:
            return None
        return ListFrame(message, found)
