"""Messages of one participant to samples.

Of a message that arrives only the first bytes are read: to which frame it refers, and whether that one was received. A
receiver that draws ten pictures a second decodes few of the sixty frames, and those to which they refer.
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
from vistel.wire.motion_codec.sample import BITS, MASKS, PRESENT, MotionSample, sample_of

KEYS_KEPT = 8
OLDEST_KEY_NS = 1_000_000_000
"""A frame never refers to an older key frame than this; one that seems to is from an earlier run of its sender."""
RECENT_KEPT = 64
"""Remembered frames, a second of them: a repetition of one of them replaces no key frame."""
MOST_UNDECODED = 32
"""The longest chain of references that is left undecoded, frames."""
_ZEROS: I64 = np.zeros(NUMBERS, np.int64)


class MotionFrame:
    """A message that is decoded when its numbers are needed.

    seq, t_ns: of the message's header. undecoded: how many frames `sample` decodes, at most.
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
        "_work",
        "intact",
        "seq",
        "t_ns",
        "undecoded",
    )

    def __init__(self, seq: int, t_ns: int, data: U8, work: I64, header: list[int], reference: MotionFrame | None) -> None:
        """data: the bytes; work: as `begin_frame` leaves it; header: its begin; reference: the key frame, None for a full frame."""
        self.seq, self.t_ns = seq, t_ns
        self._data, self._work, self._reference = data, work, reference
        self._values: I64 | None = None
        self._change, self._span = _ZEROS, 0
        self.intact = True
        """False once decoding has shown that its bytes, or those it refers to, are damaged."""
        stale = header[k.STALE]
        if reference is None:
            self._version, self._mask, self._grain = header[k.VERSION], header[k.PARTS], header[k.GRAIN]
            self._stale = 0 if stale == k.SAME else stale
            self.undecoded = 1
        else:
            self._version, self._mask, self._grain = reference._version, reference._mask, reference._grain
            self._stale = reference._stale if stale == k.SAME else stale
            self._span = header[k.DISTANCE]
            self.undecoded = 1 + reference.undecoded

    def sample(self) -> MotionSample:
        """The decoded sample, even if the bytes are damaged: see `intact`."""
        return sample_of(self.seq, self.t_ns, self.numbers() * scale(self._grain).step, self._mask, self._stale)

    def numbers(self) -> I64:
        """(NUMBERS,) in steps."""
        if self._values is None:
            chain: list[MotionFrame] = []
            frame: MotionFrame | None = self
            while frame is not None and frame._values is None:
                chain.append(frame)
                frame = frame._reference
            while chain:
                chain.pop()._decode()
            assert self._values is not None
        return self._values

    def _decode(self) -> None:
        """Needs a decoded reference."""
        values, reference = np.empty(NUMBERS, np.int64), self._reference
        before, change = _ZEROS, _ZEROS
        if reference is not None and reference._values is not None:
            before, change = reference._values, reference._change
            self._work[k.SPAN] = reference._span
        model = table(self._version, self._grain)
        intact = k.decode_frame(self._data, self._work, values, before, change, PRESENT[self._mask], model)
        self.intact = bool(intact) and (reference is None or reference.intact)
        if reference is not None and self._work[k.KEEP]:
            self._change = values - before
        self._values, self._reference, self.undecoded = values, None, 0


class ListFrame:
    """A message of an older version; see `MotionFrame`."""

    __slots__ = ("_key", "_message", "seq", "t_ns")
    intact = True

    def __init__(self, message: Motion, key: ListKey) -> None:
        self.seq: int = message.header.seq
        self.t_ns: int = message.header.t_ns
        self._message, self._key = message, key

    def sample(self) -> MotionSample:
        """The decoded sample."""
        message = self._message
        parts = parts_of(message, self._key, message.key_seq != self.seq)
        numbers, mask = np.zeros(NUMBERS), 0
        for part in PARTS:
            if part in parts:
                numbers[PLACES[part]] = parts[part]
                mask |= BITS.get(part, 0)
        return sample_of(self.seq, self.t_ns, numbers, mask, message.stale & 0xFF)


class MotionDecoder:
    """Decodes the messages of one participant. A late joiner waits for the first full frame, 0.4 s at most."""

    def __init__(self) -> None:
        self._keys: dict[int, MotionFrame] = {}
        self._lists: dict[int, ListKey] = {}
        self._opened: deque[tuple[int, int]] = deque(maxlen=RECENT_KEPT)
        self._recovered: deque[MotionFrame] = deque(maxlen=RECENT_KEPT)

    def decode(self, message: Motion) -> MotionSample | None:
        """The sample; None if its key frame has not arrived or the message is damaged."""
        frame = self.open(message)
        if frame is None:
            return None
        sample = frame.sample()
        return sample if frame.intact else None

    def open(self, message: Motion) -> MotionFrame | ListFrame | None:
        """As `decode`, but decodes when needed; every message has to be opened, in the order of arrival."""
        if not message.frame:
            return self._open_lists(message)
        header = message.header
        for past in message.earlier:
            seq = header.seq - past.back
            if (seq, past.t_ns) not in self._opened and past.t_ns < header.t_ns:
                recovered = self._open(past.frame, seq, past.t_ns)
                if recovered is not None:
                    self._recovered.append(recovered)
        return self._open(message.frame, header.seq, header.t_ns)

    def recovered(self) -> list[MotionFrame]:
        """Lost frames that later messages repeated since the last call, oldest first; older than the newest opened."""
        out = list(self._recovered)
        self._recovered.clear()
        return out

    def _open(self, frame: bytes, seq: int, t_ns: int) -> MotionFrame | None:
        if not frame or len(frame) > MOST_BYTES or frame[-1] == 0:
            return None
        data = np.frombuffer(bytearray(frame), np.uint8)  # not read-only: one kernel for both directions
        work = np.empty(k.WORK_SIZE, np.int64)
        k.begin_frame(data, work)
        header: list[int] = work[: k.HEADER_SIZE].tolist()
        reference = None
        if header[k.IS_FULL]:
            if header[k.VERSION] not in VERSIONS or header[k.PARTS] >= MASKS:
                return None
        else:
            reference = self._keys.get(seq - header[k.DISTANCE])
            if reference is None or not reference.intact or not 0 <= t_ns - reference.t_ns <= OLDEST_KEY_NS:
                return None
        opened = MotionFrame(seq, t_ns, data, work, header, reference)
        known = (seq, t_ns) in self._opened
        if not known:
            self._opened.append((seq, t_ns))
        if opened.undecoded > MOST_UNDECODED:
            opened.numbers()
        held = self._keys.get(seq)
        if header[k.KEEP] and (not known or (held is not None and not held.intact)):
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
