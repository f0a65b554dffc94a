"""The motion codec: errors within half a step, any frame decodes with its key frame, little on the wire."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.v1.motion_pb2 import Motion
from vistel.wire.motion import (
    COUNTS,
    MOTION_FIELDS,
    PARTS,
    MotionDecoder,
    MotionEncoder,
    MotionSample,
    StalePart,
)

FRAME_NS = 1_000_000_000 // 60
STEP = {p: np.concatenate([np.full(f.count, f.step) for f in MOTION_FIELDS if f.part == p]) for p in PARTS}
LOW = {p: np.concatenate([np.full(f.count, f.low) for f in MOTION_FIELDS if f.part == p]) for p in PARTS}
HIGH = {p: np.concatenate([np.full(f.count, f.high) for f in MOTION_FIELDS if f.part == p]) for p in PARTS}


def flat(sample: MotionSample) -> dict[str, np.ndarray]:
    arrays = {p: getattr(sample, p) for p in PARTS}
    return {p: a.reshape(-1) for p, a in arrays.items() if a is not None}


def random_motion(
    seed: int, count: int, *, face: bool = False, gaze: bool = False, wild: float = 1.0
) -> list[MotionSample]:
    """Values anywhere in their range that wander by `wild` of it from frame to frame."""
    rng = np.random.default_rng(seed)
    values = {p: rng.uniform(LOW[p], HIGH[p]) for p in PARTS}
    out: list[MotionSample] = []
    for i in range(count):
        for p in PARTS:
            values[p] = np.clip(values[p] + wild * rng.normal(0, 0.05, COUNTS[p]) * HIGH[p], LOW[p], HIGH[p])
        out.append(
            MotionSample(
                i + 1, 10**18 + i * FRAME_NS, values["body"], values["hands"].reshape(2, 20), values["stance"],
                values["gaze"] if gaze else None, values["face"] if face else None, StalePart(int(rng.integers(256))),
            )
        )  # fmt: skip
    return out


def over_the_wire(message: Motion) -> Motion:
    return Motion.FromString(message.SerializeToString())


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32), face=st.booleans(), gaze=st.booleans(), wild=st.sampled_from([0.0, 0.01, 1.0]))
def test_every_number_comes_back_within_half_a_step(seed: int, face: bool, gaze: bool, wild: float) -> None:
    encoder, decoder = MotionEncoder(), MotionDecoder()
    for sample in random_motion(seed, 40, face=face, gaze=gaze, wild=wild):
        back = decoder.decode(over_the_wire(encoder.encode(sample)))
        assert back is not None
        assert (back.seq, back.t_ns, back.stale) == (sample.seq, sample.t_ns, sample.stale)
        assert back.hands.shape == (2, 20)
        assert (back.face is None, back.gaze is None) == (not face, not gaze)
        for part, numbers in flat(sample).items():
            assert np.all(np.abs(flat(back)[part] - numbers) <= STEP[part] / 2 + 1e-9), part


def test_body_and_fingers_stay_far_below_three_tenths_of_a_degree() -> None:
    for f in MOTION_FIELDS:
        if f.unit == "rad":
            assert np.degrees(f.step / 2) <= (0.05001 if f.part == "body" else 0.1001)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32), lost=st.integers(0, 119))
def test_losing_a_frame_harms_no_other_unless_it_is_a_key_frame(seed: int, lost: int) -> None:
    encoder, decoder = MotionEncoder(), MotionDecoder()
    samples = random_motion(seed, 120, wild=0.02)
    messages = [encoder.encode(s) for s in samples]
    harmed = []
    for i, message in enumerate(messages):
        if i != lost:
            back = decoder.decode(over_the_wire(message))
            if back is None:
                harmed.append(i)
            else:
                assert np.all(np.abs(back.body - samples[i].body) <= STEP["body"] / 2 + 1e-9)
    key_lost = messages[lost].key_seq == messages[lost].header.seq
    first_key = lost == 0
    assert harmed == [] or key_lost
    if not first_key:
        assert not any(b - a == 1 for a, b in pairwise(harmed)), "every second frame still decodes"


def test_a_late_joiner_waits_less_than_half_a_second() -> None:
    encoder = MotionEncoder()
    messages = [encoder.encode(s) for s in random_motion(3, 240, wild=0.02)]
    for start in range(1, 200):
        decoder = MotionDecoder()
        waited = next(i for i, m in enumerate(messages[start:]) if decoder.decode(m) is not None)
        assert waited * FRAME_NS <= 500_000_000


def test_what_lies_outside_its_range_is_sent_as_the_end_of_the_range() -> None:
    body = np.full(25, 100.0)
    hands = np.full((2, 20), -100.0)
    sample = MotionSample(1, 0, body, hands, np.array([np.nan, np.inf, -1e9, 7.0]))
    back = MotionDecoder().decode(over_the_wire(MotionEncoder().encode(sample)))
    assert back is not None
    assert np.allclose(back.body, HIGH["body"], atol=STEP["body"].max())
    assert np.allclose(back.hands.reshape(-1), LOW["hands"], atol=STEP["hands"].max())
    assert np.allclose(back.stance, [0.0, 0.0, -100.0, np.pi], atol=0.01)


def test_a_camera_that_comes_or_goes_begins_with_a_key_frame() -> None:
    encoder, decoder = MotionEncoder(), MotionDecoder()
    for i, s in enumerate(random_motion(1, 30, face=True, gaze=True, wild=0.0)):
        seen = i % 7 < 3
        now = MotionSample(s.seq, s.t_ns, s.body, s.hands, s.stance, s.gaze if seen else None, s.face if seen else None)
        back = decoder.decode(over_the_wire(encoder.encode(now)))
        assert back is not None
        assert (back.face is not None) == (back.gaze is not None) == seen


def test_a_sender_that_restarts_is_not_decoded_with_its_old_key_frames() -> None:
    decoder = MotionDecoder()
    first = MotionEncoder()
    for s in random_motion(1, 40):
        decoder.decode(first.encode(s))
    second = MotionEncoder()
    later = random_motion(2, 40)
    for n, s in enumerate(later):
        message = second.encode(MotionSample(s.seq, s.t_ns + 5_000_000_000, s.body, s.hands, s.stance))
        if n == 0:
            continue  # its key frame is lost
        back = decoder.decode(message)
        assert back is None or np.all(np.abs(back.body - s.body) <= STEP["body"] / 2 + 1e-9)


@settings(max_examples=300, deadline=None)
@given(data=st.binary(max_size=300))
def test_bytes_of_any_kind_kill_no_decoder(data: bytes) -> None:
    message = Motion()
    try:
        message.ParseFromString(data)
    except Exception:
        return
    back = MotionDecoder().decode(message)
    assert back is None or all(np.isfinite(a).all() for a in flat(back).values())


def test_lists_that_are_too_long_are_refused() -> None:
    message = MotionEncoder().encode(random_motion(1, 1)[0])
    message.body.append(1)
    assert MotionDecoder().decode(message) is None


def test_a_sample_of_the_wrong_shape_says_which_part() -> None:
    with pytest.raises(ValueError, match="body has 24 numbers, expected 25"):
        MotionEncoder().encode(MotionSample(1, 0, np.zeros(24), np.zeros((2, 20)), np.zeros(4)))


def test_a_still_person_stays_well_below_the_budget() -> None:
    encoder = MotionEncoder()
    rng = np.random.default_rng(0)
    total = 0
    for i in range(600):
        body, hands = 0.5 + rng.normal(0, 0.003, 25), 0.4 + rng.normal(0, 0.006, (2, 20))
        message = encoder.encode(MotionSample(10**6 + i, 10**18 + i * FRAME_NS, body, hands, np.array([1, 0, 2, 0.3])))
        message.header.version = 1
        total += len(message.SerializeToString())
    assert total / 600 * 60 * 8 < 50_000
