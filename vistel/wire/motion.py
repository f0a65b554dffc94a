"""The Motion message: a participant's posture in about 90 bytes, sixty times a second.

Every number is rounded to a whole number of steps (`MOTION_FIELDS`). Four times a second a key frame carries
these numbers themselves; the frames between carry differences, by turns to the last key frame and to the one
before it. So a lost difference harms no other frame, and after a lost key frame every second frame still
decodes. Small numbers take few bytes, and zeros at the end of a list are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vistel.v1.motion_pb2 import Motion

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

KEY_INTERVAL_NS = 250_000_000
KEYS_KEPT = 4
OLDEST_KEY_NS = 4 * KEY_INTERVAL_NS
"""A difference is never to a key frame older than this; one that says so is from another life of its sender."""

DEGREE = float(np.pi / 180)
PI = float(np.pi)


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


NOTHING_STALE = StalePart(0)


@dataclass(frozen=True)
class MotionField:
    """`count` consecutive numbers of the list `part`; the error of each is at most step / 2 within [low, high]."""

    part: str
    name: str
    count: int
    unit: str
    low: float
    high: float
    step: float


_TURN = 0.1 * DEGREE
_FINGER = 0.2 * DEGREE


def _angles(part: str, name: str, count: int, step: float = _TURN) -> MotionField:
    return MotionField(part, name, count, "rad", -PI, PI, step)


MOTION_FIELDS: tuple[MotionField, ...] = (
    _angles("body", "ankle", 1),
    _angles("body", "knee", 1),
    _angles("body", "spine rotation", 3),
    MotionField("body", "spine shift", 3, "m", -1.0, 1.0, 0.0005),
    _angles("body", "neck", 3),
    _angles("body", "left shoulder", 3),
    _angles("body", "left elbow", 1),
    _angles("body", "left wrist", 3),
    _angles("body", "right shoulder", 3),
    _angles("body", "right elbow", 1),
    _angles("body", "right wrist", 3),
    _angles("hands", "left hand", 20, _FINGER),
    _angles("hands", "right hand", 20, _FINGER),
    MotionField("stance", "position", 3, "m", -100.0, 100.0, 0.0005),
    _angles("stance", "heading", 1),
    _angles("gaze", "yaw, pitch", 2),
    MotionField("face", "13 marks x (x, y)", 26, "m", -0.25, 0.25, 0.0002),
)
"""Order, unit, range and step of every number of a Motion; what lies outside the range is sent as its end."""

PARTS = ("body", "hands", "stance", "gaze", "face")


class _Scale(NamedTuple):
    step: F64
    low: I64
    high: I64


def _scale(part: str) -> _Scale:
    fields = [f for f in MOTION_FIELDS if f.part == part]
    step = np.concatenate([np.full(f.count, f.step) for f in fields])
    low = np.concatenate([np.full(f.count, round(f.low / f.step), dtype=np.int64) for f in fields])
    high = np.concatenate([np.full(f.count, round(f.high / f.step), dtype=np.int64) for f in fields])
    return _Scale(step, low, high)


_SCALES = {part: _scale(part) for part in PARTS}
COUNTS = {part: len(scale.step) for part, scale in _SCALES.items()}
_ALL = _Scale(*(np.concatenate(columns) for columns in zip(*_SCALES.values(), strict=True)))
_ENDS = dict(zip(PARTS, accumulate(COUNTS.values()), strict=True))
_PLACES = {part: (end - COUNTS[part], end) for part, end in _ENDS.items()}


@dataclass(frozen=True)
class MotionSample:
    """What a participant does at `t_ns` (conference time at which the sensors were sampled).

    body: (25,) rad and m, order of `MOTION_FIELDS` (that of `vistel.figure.posture`). hands: (2, 20) rad,
    left first. stance: (4,) x, y, z of the feet [m, room frame] and heading [rad]. gaze: (2,) yaw and pitch
    [rad], None without an eye camera. face: (26,) [m, head frame], None without a face camera. stale: parts
    whose sensor is silent.
    """

    seq: int
    t_ns: int
    body: F64
    hands: F64
    stance: F64
    gaze: F64 | None = None
    face: F64 | None = None
    stale: StalePart = NOTHING_STALE


class _Key(NamedTuple):
    seq: int
    t_ns: int
    values: dict[str, I64]


class MotionEncoder:
    """Samples of one participant to messages. Put each message on the bus once, with `sample.seq` as its number.

    `Publication.next_seq` is the number to give a sample. A number that is not above the last one starts
    anew.
    """

    def __init__(self, key_interval_ns: int = KEY_INTERVAL_NS) -> None:
        self._interval_ns = key_interval_ns
        self._keys: list[_Key] = []
        self._last_seq = 0

    def encode(self, sample: MotionSample) -> Motion:
        """The message of a sample. Numbers that are not finite are sent as 0."""
        values = {part: _quantise(part, array) for part, array in _arrays(sample).items()}
        out = Motion()
        out.header.seq = sample.seq
        out.header.t_ns = sample.t_ns
        out.stale = int(sample.stale)
        reference = self._reference(sample, values)
        if reference is None:
            self._keys = [*self._keys[-1:], _Key(sample.seq, sample.t_ns, values)]
        self._last_seq = sample.seq
        out.key_seq = sample.seq if reference is None else reference.seq
        for part, now in values.items():
            numbers = now if reference is None else now - reference.values[part]
            getattr(out, part).extend(_without_zeros(numbers, keep_one=reference is None))
        return out

    def _reference(self, sample: MotionSample, values: dict[str, I64]) -> _Key | None:
        """The key frame to refer to, or None when this sample has to be one."""
        if not self._keys or sample.seq <= self._last_seq:
            self._keys = []
            return None
        last = self._keys[-1]
        if not 0 <= sample.t_ns - last.t_ns < self._interval_ns or last.values.keys() != values.keys():
            return None
        key = self._keys[sample.seq % len(self._keys)]
        fits = key.values.keys() == values.keys() and sample.t_ns - key.t_ns < OLDEST_KEY_NS
        return key if fits else last


class MotionFrame:
    """A message with the key frame it refers to, not yet worked out: who draws ten pictures a second needs few."""

    __slots__ = ("_base", "_has", "_message", "seq", "t_ns")

    def __init__(self, message: Motion, base: I64 | None, has: frozenset[str]) -> None:
        self.seq: int = message.header.seq
        self.t_ns: int = message.header.t_ns
        self._message, self._base, self._has = message, base, has

    def sample(self) -> MotionSample:
        """What the participant does."""
        numbers = _numbers(self._message)
        if self._base is not None:
            numbers += self._base
        values = np.minimum(np.maximum(numbers, _ALL.low), _ALL.high) * _ALL.step
        parts = {part: values[begin:end] for part, (begin, end) in _PLACES.items()}
        return MotionSample(
            self.seq, self.t_ns, parts["body"], parts["hands"].reshape(2, 20), parts["stance"],
            parts["gaze"] if "gaze" in self._has else None, parts["face"] if "face" in self._has else None,
            StalePart(self._message.stale & 0xFF),
        )  # fmt: skip


class _KeyFrame(NamedTuple):
    t_ns: int
    numbers: I64
    has: frozenset[str]


class MotionDecoder:
    """Messages of one participant to samples. A late joiner waits for the first key frame, 0.25 s at most."""

    def __init__(self) -> None:
        self._keys: dict[int, _KeyFrame] = {}

    def decode(self, message: Motion) -> MotionSample | None:
        """The sample, or None: its key frame has not arrived, or the message is broken."""
        frame = self.open(message)
        return None if frame is None else frame.sample()

    def open(self, message: Motion) -> MotionFrame | None:
        """As `decode`, without the work; every message has to be opened, in the order they arrive."""
        if any(len(getattr(message, part)) > COUNTS[part] for part in PARTS):
            return None
        seq, t_ns = message.header.seq, message.header.t_ns
        if message.key_seq == seq:
            has = frozenset(part for part in ("gaze", "face") if len(getattr(message, part)))
            self._keys[seq] = _KeyFrame(t_ns, _numbers(message), has)
            while len(self._keys) > KEYS_KEPT:
                del self._keys[next(iter(self._keys))]
            return MotionFrame(message, None, has)
        key = self._keys.get(message.key_seq)
        if key is None or not 0 <= t_ns - key.t_ns <= OLDEST_KEY_NS:
            return None
        return MotionFrame(message, key.numbers, key.has)


def _arrays(sample: MotionSample) -> dict[str, F64]:
    arrays = {"body": sample.body, "hands": sample.hands, "stance": sample.stance}
    if sample.gaze is not None:
        arrays["gaze"] = sample.gaze
    if sample.face is not None:
        arrays["face"] = sample.face
    return arrays


def _quantise(part: str, values: F64) -> I64:
    scale = _SCALES[part]
    flat = np.asarray(values, dtype=np.float64).reshape(-1)
    if len(flat) != len(scale.step):
        raise ValueError(f"motion: {part} has {len(flat)} numbers, expected {len(scale.step)}")
    steps = np.nan_to_num(np.rint(flat / scale.step), nan=0.0, posinf=0.0, neginf=0.0)
    return np.clip(steps, scale.low, scale.high).astype(np.int64)


def _without_zeros(numbers: I64, *, keep_one: bool) -> list[int]:
    """Zeros at the end left out; `keep_one`: not all, because an empty list in a key frame means "has none"."""
    last = int(np.flatnonzero(numbers)[-1]) + 1 if numbers.any() else int(keep_one)
    return numbers[:last].tolist()


def _numbers(message: Motion) -> I64:
    """All numbers of a message in the order of PARTS, with the zeros that were left out."""
    out = np.zeros(len(_ALL.step), dtype=np.int64)
    for part, (begin, _) in _PLACES.items():
        numbers = getattr(message, part)
        if numbers:
            out[begin : begin + len(numbers)] = numbers
    return out
