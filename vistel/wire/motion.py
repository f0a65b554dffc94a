"""The Motion message: a participant's posture in some forty bytes, sixty times a second.

Every number is rounded to a whole number of steps (`MOTION_FIELDS`), foreseen from a key frame, and what is left is
entropy coded. Every second frame is a key frame; it refers to the key frame before it, the frames between to the last
one only, so that losing them harms nothing. At least twice a second a full key frame refers to nothing: a late joiner,
and whoever lost a key frame, goes on there. docs/reference/motion-stream.md has the layout of the bytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vistel.v1.motion_pb2 import Motion
from vistel.wire.motion_codec import kernels as k
from vistel.wire.motion_codec.layout import (
    COUNTS,
    MOTION_FIELDS,
    NUMBERS,
    OPTIONAL,
    PARTS,
    PLACES,
    USUAL_GRAIN,
    MotionField,
    scale,
)
from vistel.wire.motion_codec.lists import ListKey, parts_of, read_key, well_formed
from vistel.wire.motion_codec.model import NEWEST, VERSIONS, tables

__all__ = (
    "COUNTS", "FULL_INTERVAL_NS", "KEY_SPACING", "MOTION_FIELDS", "PARTS", "MotionDecoder", "MotionEncoder", "MotionField",
    "MotionFrame", "MotionSample", "StalePart", "warm_up",
)  # fmt: skip

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

FULL_INTERVAL_NS = 400_000_000
"""From one full key frame to the next, at most."""
FRAME_NS = 1_000_000_000 // 60
KEY_SPACING = 2
"""Frames from one key frame to the next."""
KEYS_KEPT = 8
OLDEST_KEY_NS = 1_000_000_000
"""A frame never refers to a key frame older than this; one that says so is from another life of its sender."""
HOLD = 0.55
"""A number stays as it was sent last until it is this many steps away, so that noise at the edge of two steps does not
make what is still tremble."""
MOST_BYTES = 1024
"""No frame is longer: the worst of all numbers take less."""


class StalePart(IntFlag):
    """Parts whose sensor is silent; their values are the last ones known."""

    LEFT_HAND = 1
    """The tracker's receiver on the left hand; the glove is told apart."""
    RIGHT_HAND = 2
    LEFT_GLOVE = 4
    RIGHT_GLOVE = 8
    HEAD = 16
    CHEST = 32
    FACE = 64
    GAZE = 128
    LEGS = 256


NOTHING_STALE = StalePart(0)
_ALL_STALE = (1 << 9) - 1


@dataclass(frozen=True)
class MotionSample:
    """What a participant does at `t_ns` (conference time at which the sensors were sampled).

    body: (25,) rad and m, order of `MOTION_FIELDS` (that of `vistel.figure.posture`). hands: (2, 20) rad,
    left first. stance: (4,) x, y, z of the feet [m, room frame] and heading [rad]. stale: parts whose sensor is silent.
    What the sensors do not tell is None: gaze: (2,) yaw and pitch [rad]; face: (26,) 13 marks [m, head frame];
    lids: (2,) opening of the left and the right eye, 0 closed .. 1 as at rest. From a source that knows more of the body,
    rotation vectors of joints relative to their parents [rad]: legs: (8, 3) upper leg, lower leg, foot and toes, left first;
    collars: (2, 3), left first; jaw: (3,).
    """

    seq: int
    t_ns: int
    body: F64
    hands: F64
    stance: F64
    gaze: F64 | None = None
    face: F64 | None = None
    stale: StalePart = NOTHING_STALE
    lids: F64 | None = None
    legs: F64 | None = None
    collars: F64 | None = None
    jaw: F64 | None = None


class _Key(NamedTuple):
    """A key frame as both ends know it. values, change: (NUMBERS,) steps, the change since the key frame it referred to,
    `span` frames before; has: (parts,); grain: see `GRAINS_TENTHS`; stale: bits of `StalePart`."""

    seq: int
    t_ns: int
    values: I64
    change: I64
    span: int
    has: NDArray[np.bool_]
    version: int
    grain: int
    stale: int


_NOTHING: I64 = np.zeros(NUMBERS, np.int64)
_BITS = {part: 1 << i for i, part in enumerate(OPTIONAL)}


def _has(mask: int) -> NDArray[np.bool_]:
    return np.array([part not in _BITS or bool(mask & _BITS[part]) for part in PARTS])


_HAS = [_has(mask) for mask in range(1 << len(OPTIONAL))]


class MotionEncoder:
    """Samples of one participant to messages. Put each message on the bus once, with `sample.seq` as its number.

    `Publication.next_seq` is the number to give a sample. A number that is not above the last one starts
    anew.
    """

    def __init__(self, *, grain: int = USUAL_GRAIN, key_spacing: int = KEY_SPACING, hold: float = HOLD) -> None:
        """grain: index of `GRAINS_TENTHS`, finer or coarser steps as a whole. key_spacing: frames from one key frame to
        the next; 0 leaves only full key frames, for a link that loses much. hold: see HOLD."""
        self._grain, self._spacing, self._hold = grain, key_spacing, hold
        self._tables = tables(NEWEST, grain)
        self._scale = scale(grain)
        self._out = np.zeros(MOST_BYTES, np.uint8)
        self._key: _Key | None = None
        self._sent = np.full(NUMBERS, np.nan)
        self._full_ns = self._mask = self._last_seq = 0

    def encode(self, sample: MotionSample) -> Motion:
        """The message of a sample. Numbers that are not finite are sent as 0."""
        raw, mask = _flat(sample)
        values = self._quantise(raw)
        key = self._reference(sample, mask)
        header = np.zeros(k.HEADER_SIZE, np.int64)
        stale = int(sample.stale) & _ALL_STALE
        if key is None:
            header[k.IS_FULL], header[k.VERSION], header[k.HAS], header[k.GRAIN] = 1, NEWEST, mask, self._grain
            header[k.STALE] = stale or k.SAME
        else:
            header[k.DISTANCE], header[k.SPAN] = sample.seq - key.seq, key.span
            header[k.KEEP] = self._spacing > 0 and sample.seq - key.seq >= self._spacing
            header[k.STALE] = k.SAME if stale == key.stale else stale
        before, change = (_NOTHING, _NOTHING) if key is None else (key.values, key.change)
        has = _HAS[mask]
        size = k.encode_frame(self._out, header, values, before, change, has, *self._tables)
        out = Motion()
        out.header.seq, out.header.t_ns = sample.seq, sample.t_ns
        out.frame = self._out[:size].tobytes()
        self._last_seq, self._mask = sample.seq, mask
        if key is None:
            self._full_ns = sample.t_ns
        if header[k.KEEP] or key is None:
            span = 0 if key is None else sample.seq - key.seq
            moved = values - before if span else _NOTHING
            self._key = _Key(sample.seq, sample.t_ns, values, moved, span, has, NEWEST, self._grain, stale)
        return out

    def _quantise(self, raw: F64) -> I64:
        steps = raw / self._scale.step
        steps[~np.isfinite(steps)] = 0.0
        whole = np.where(np.abs(steps - self._sent) <= self._hold, self._sent, np.rint(steps))
        self._sent = np.minimum(np.maximum(whole, self._scale.low), self._scale.high)
        return self._sent.astype(np.int64)

    def _reference(self, sample: MotionSample, mask: int) -> _Key | None:
        """The key frame to refer to, or None when this one has to be full."""
        key = self._key
        if key is None or sample.seq <= self._last_seq or mask != self._mask:
            return None
        # Due where the next frame would come too late.
        late = sample.t_ns + FRAME_NS - self._full_ns > FULL_INTERVAL_NS
        return None if late or sample.t_ns < key.t_ns else key


class MotionFrame:
    """A message with the key frame it refers to, not yet worked out: who draws ten pictures a second needs few."""

    __slots__ = ("_list", "_message", "_ready", "_reference", "_state", "_whole", "seq", "t_ns")

    def __init__(
        self, message: Motion, reference: _Key | None = None, state: tuple[I64, I64, NDArray[np.uint8]] | None = None,
        ready: _Key | None = None, old: ListKey | None = None,
    ) -> None:  # fmt: skip
        self.seq: int = message.header.seq
        self.t_ns: int = message.header.t_ns
        self._message, self._reference, self._state = message, reference, state
        self._ready, self._list, self._whole = ready, old, True

    def sample(self) -> MotionSample:
        """What the participant does."""
        return self._old_sample(self._list) if self._list is not None else self._new_sample()

    @property
    def whole(self) -> bool:
        """False where working it out has shown that the bytes are damaged; `sample` gives what they say all the same."""
        return self._whole

    def numbers(self) -> tuple[I64, bool]:
        """The whole numbers of a `frame`, (NUMBERS,); and whether its bytes seem undamaged."""
        return self._read().values, self._whole

    def _read(self) -> _Key:
        if self._ready is None:
            assert self._reference is not None and self._state is not None
            self._ready, self._whole = _read(self.seq, self.t_ns, self._reference, self._state)
            self._state = None
        return self._ready

    def _new_sample(self) -> MotionSample:
        frame = self._read()
        values = frame.values * scale(frame.grain).step
        parts = {part: values[PLACES[part]] for i, part in enumerate(PARTS) if frame.has[i]}
        return self._sample(parts, frame.stale)

    def _old_sample(self, key: ListKey) -> MotionSample:
        message = self._message
        return self._sample(parts_of(message, key, message.key_seq != self.seq), message.stale & 0xFF)

    def _sample(self, parts: dict[str, F64], stale: int) -> MotionSample:
        return MotionSample(
            self.seq, self.t_ns, parts["body"], parts["hands"].reshape(2, 20), parts["stance"], parts.get("gaze"),
            parts.get("face"), StalePart(stale & _ALL_STALE), parts.get("lids"), _rows(parts.get("legs")),
            _rows(parts.get("collars")), parts.get("jaw"),
        )  # fmt: skip


class MotionDecoder:
    """Messages of one participant to samples. A late joiner waits for the first full key frame, 0.5 s at most."""

    def __init__(self) -> None:
        self._keys: dict[int, _Key] = {}
        self._lists: dict[int, ListKey] = {}

    def decode(self, message: Motion) -> MotionSample | None:
        """The sample, or None: its key frame has not arrived, or the message is broken."""
        frame = self.open(message)
        if frame is None:
            return None
        sample = frame.sample()
        return sample if frame.whole else None

    def open(self, message: Motion) -> MotionFrame | None:
        """As `decode`, without the work; every message has to be opened, in the order they arrive."""
        if not message.frame:
            return self._open_lists(message)
        data = np.frombuffer(bytearray(message.frame), np.uint8)  # not read-only: one kernel for both directions
        if len(data) > MOST_BYTES or data[-1] == 0:
            return None
        header, state = np.zeros(k.HEADER_SIZE, np.int64), np.zeros(k.STATE_SIZE, np.int64)
        k.begin_frame(data, header, state)
        seq, t_ns = message.header.seq, message.header.t_ns
        if header[k.IS_FULL]:
            version, mask = int(header[k.VERSION]), int(header[k.HAS])
            if version not in VERSIONS or mask >= len(_HAS):
                return None
            reference = _Key(seq, t_ns, _NOTHING, _NOTHING, 0, _HAS[mask], version, int(header[k.GRAIN]), 0)
        else:
            found = self._keys.get(seq - int(header[k.DISTANCE]))
            if found is None or not 0 <= t_ns - found.t_ns <= OLDEST_KEY_NS:
                return None
            reference = found
            header[k.SPAN] = reference.span
        if not header[k.KEEP]:
            return MotionFrame(message, reference, (header, state, data))
        key, whole = _read(seq, t_ns, reference, (header, state, data))
        if not whole:
            return None
        self._keys.pop(seq, None)
        self._keys[seq] = key
        while len(self._keys) > KEYS_KEPT:
            del self._keys[next(iter(self._keys))]
        return MotionFrame(message, ready=key)

    def _open_lists(self, message: Motion) -> MotionFrame | None:
        """What older versions sent."""
        if not well_formed(message):
            return None
        seq = message.header.seq
        if message.key_seq == seq:
            key = self._lists[seq] = read_key(message)
            while len(self._lists) > 4:
                del self._lists[next(iter(self._lists))]
            return MotionFrame(message, old=key)
        found = self._lists.get(message.key_seq)
        if found is None or not 0 <= message.header.t_ns - found.t_ns <= OLDEST_KEY_NS:
            return None
        return MotionFrame(message, old=found)


def warm_up() -> None:
    """Have the codec compiled, so that the first frame is as quick as the others."""
    encoder, decoder = MotionEncoder(), MotionDecoder()
    for seq in (1, 2):
        decoder.decode(encoder.encode(MotionSample(seq, 0, np.zeros(25), np.zeros((2, 20)), np.zeros(4))))


def _read(seq: int, t_ns: int, reference: _Key, state: tuple[I64, I64, NDArray[np.uint8]]) -> tuple[_Key, bool]:
    """The numbers of a frame whose header has been read; False where the bytes are damaged."""
    header, coder, data = state
    values = np.zeros(NUMBERS, np.int64)
    full = bool(header[k.IS_FULL])
    whole = k.decode_frame(
        data, header, coder, values, reference.values, reference.change, reference.has,
        *tables(reference.version, reference.grain),
    )  # fmt: skip
    stale = reference.stale if header[k.STALE] == k.SAME else int(header[k.STALE])
    span = 0 if full else int(header[k.DISTANCE])
    change = _NOTHING if full or not header[k.KEEP] else values - reference.values
    return _Key(seq, t_ns, values, change, span, reference.has, reference.version, reference.grain, stale), bool(whole)


def _rows(values: F64 | None) -> F64 | None:
    return None if values is None else values.reshape(-1, 3)


def _flat(sample: MotionSample) -> tuple[F64, int]:
    """All numbers in order (absent ones 0), and which optional parts there are."""
    out = np.zeros(NUMBERS)
    mask = 0
    for part in PARTS:
        values: F64 | None = getattr(sample, part)
        if values is None:
            continue
        flat = np.asarray(values, np.float64).reshape(-1)
        if len(flat) != COUNTS[part]:
            raise ValueError(f"motion: {part} has {len(flat)} numbers, expected {COUNTS[part]}")
        out[PLACES[part]] = flat
        mask |= _BITS.get(part, 0)
    return out, mask
