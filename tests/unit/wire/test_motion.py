"""The motion codec: errors within what a number may be held, any frame decodes with its key frame, little on the wire."""

from __future__ import annotations

import math
import os
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from vistel.v1.motion_pb2 import Motion
from vistel.wire.motion import (
    COUNTS,
    LOSSES,
    MOTION_FIELDS,
    PARTS,
    PLANS,
    Losses,
    MotionDecoder,
    MotionEncoder,
    MotionFrame,
    MotionSample,
    StalePart,
)
from vistel.wire.motion_codec.decoder import ListFrame
from vistel.wire.motion_codec.layout import GRAINS_TENTHS, USUAL_GRAIN, scale
from vistel.wire.motion_codec.references import key_frames

FRAME_NS = 1_000_000_000 // 60
DAMAGED = int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "100000"))
FUZZ = settings(
    max_examples=min(10_000, int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "500"))),
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
STEP = {p: np.concatenate([np.full(f.count, f.step) for f in MOTION_FIELDS if f.part == p]) for p in PARTS}
LOW = {p: np.concatenate([np.full(f.count, f.low) for f in MOTION_FIELDS if f.part == p]) for p in PARTS}
HIGH = {p: np.concatenate([np.full(f.count, f.high) for f in MOTION_FIELDS if f.part == p]) for p in PARTS}
HELD = 0.55
"""How many steps a number may be off."""


def flat(sample: MotionSample) -> dict[str, np.ndarray]:
    arrays = {p: getattr(sample, p) for p in PARTS}
    return {p: a.reshape(-1) for p, a in arrays.items() if a is not None}


def random_motion(
    seed: int, count: int, *, face: bool = False, gaze: bool = False, legs: bool = False, wild: float = 1.0
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
                i + 1,
                10**18 + i * FRAME_NS,
                values["body"],
                values["hands"].reshape(2, 20),
                values["stance"],
                values["gaze"] if gaze else None,
                values["face"] if face else None,
                StalePart(int(rng.integers(512))),
                values["lids"] if gaze else None,
                *((values["legs"], values["collars"], values["jaw"]) if legs else ()),
            )
        )
    return out


def over_the_wire(message: Motion) -> Motion:
    return Motion.FromString(message.SerializeToString())


def near(back: MotionSample, sample: MotionSample, steps: float = HELD) -> bool:
    a, b = flat(back), flat(sample)
    return a.keys() == b.keys() and all(np.all(np.abs(a[p] - b[p]) <= steps * STEP[p] + 1e-9) for p in a)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    face=st.booleans(),
    gaze=st.booleans(),
    legs=st.booleans(),
    wild=st.sampled_from([0.0, 0.01, 1.0]),
    grain=st.integers(0, len(GRAINS_TENTHS) - 1),
)
def test_every_number_comes_back_as_near_as_promised(
    seed: int, face: bool, gaze: bool, legs: bool, wild: float, grain: int
) -> None:
    encoder, decoder = MotionEncoder(grain=grain), MotionDecoder()
    for sample in random_motion(seed, 20, face=face, gaze=gaze, legs=legs, wild=wild):
        back = decoder.decode(over_the_wire(encoder.encode(sample)))
        assert back is not None
        assert (back.seq, back.t_ns, back.stale) == (sample.seq, sample.t_ns, sample.stale)
        assert back.hands.shape == (2, 20)
        # At other grains the ends of a range are up to two steps inside it.
        assert near(back, sample, GRAINS_TENTHS[grain] / 10 * (HELD if grain == USUAL_GRAIN else 2.0))


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    losses=st.sampled_from(LOSSES),
    loss=st.floats(0.0, 0.2),
    twice=st.floats(0.0, 0.2),
    swapped=st.floats(0.0, 0.2),
)
@example(seed=13829, losses="rare", loss=0.0, twice=0.15625, swapped=0.1875)
def test_with_the_frame_it_refers_to_every_frame_decodes_whatever_was_lost_doubled_or_swapped(
    seed: int, losses: Losses, loss: float, twice: float, swapped: float
) -> None:
    """When it comes first. Its repetition may come later than eight key frames, when the one it refers to is not held."""
    rng = np.random.default_rng(seed)
    samples = random_motion(seed, 120, wild=0.02)
    encoder, decoder = MotionEncoder(losses=losses), MotionDecoder()
    messages = [encoder.encode(s) for s in samples]
    order = [i for i in range(120) for _ in range(int(rng.random() >= loss) * (1 + int(rng.random() < twice)))]
    for j in range(len(order) - 1):
        if rng.random() < swapped:
            order[j], order[j + 1] = order[j + 1], order[j]
    refers = references(losses, 120)
    known: set[int] = set()
    for i in order:
        back = decoder.decode(over_the_wire(messages[i]))
        whole = refers[i] is None or refers[i] in known
        assert (back is not None) == whole or i in known
        if back is not None:
            assert near(back, samples[i])
            known.add(i)


@pytest.mark.parametrize("losses", LOSSES)
@pytest.mark.parametrize("late", [1, 4, 7, 10, 13, 20, 40])
def test_a_stream_whose_every_frame_comes_once_more_and_late_decodes_whole(losses: Losses, late: int) -> None:
    """As over two ways of different length. A repetition that was taken for a new key frame would push out what the next
    frames refer to."""
    encoder, decoder = MotionEncoder(losses=losses), MotionDecoder()
    messages = [over_the_wire(encoder.encode(s)) for s in random_motion(7, 120, wild=0.02)]
    for i, message in enumerate(messages):
        assert decoder.decode(message) is not None
        if i >= late:
            decoder.decode(messages[i - late])


def references(losses: Losses, count: int) -> list[int | None]:
    """Which frame each one refers to."""
    plan = PLANS[losses]
    return [None if plan[i % len(plan)] == 0 else i - plan[i % len(plan)] for i in range(count)]


@pytest.mark.parametrize("losses", LOSSES)
def test_lost_frames_are_recovered_from_messages_that_repeat_them(losses: Losses) -> None:
    samples = random_motion(4, 199)
    encoder, decoder = MotionEncoder(losses=losses, repeats=2), MotionDecoder()
    received: list[int] = []
    for sample in samples:
        message = over_the_wire(encoder.encode(sample))
        assert len(message.earlier) == min(2, sample.seq - 1)
        if sample.seq > 1 and sample.seq % 7 in (3, 4):  # two in a row
            continue
        newest = decoder.open(message)
        assert newest is not None
        received += [frame.seq for frame in [*decoder.recovered(), newest]]
    assert received == list(range(1, received[-1] + 1))


def test_repetitions_of_received_frames_and_of_an_earlier_run_change_nothing() -> None:
    samples = random_motion(5, 19)
    encoder, decoder = MotionEncoder(repeats=1), MotionDecoder()
    messages = [over_the_wire(encoder.encode(sample)) for sample in samples]
    for message in messages:
        assert decoder.open(message) is not None
        assert decoder.recovered() == []
    again = MotionEncoder(repeats=1)
    message = over_the_wire(again.encode(samples[0]))
    assert not message.earlier
    message.earlier.add(back=5, t_ns=message.header.t_ns + 1, frame=b"\x01\x02")
    assert decoder.open(message) is not None
    assert decoder.recovered() == []


@pytest.mark.parametrize("losses", LOSSES)
def test_a_receiver_still_holds_what_a_frame_refers_to(losses: Losses) -> None:
    plan = PLANS[losses]
    keys = key_frames(plan)
    assert plan[0] == 0 and all(0 < back <= i for i, back in enumerate(plan) if i)
    for i, back in enumerate(plan):
        assert sum(i - back <= key < i for key in keys) <= 8
    assert len(plan) * FRAME_NS <= 400_000_000


def test_for_many_losses_every_frame_decodes_from_the_last_full_frame_alone() -> None:
    samples = random_motion(6, 120, wild=0.02)
    encoder = MotionEncoder(losses="many")
    messages = [encoder.encode(s) for s in samples]
    full = [i for i, m in enumerate(messages) if MotionDecoder().decode(m) is not None]
    assert max(np.diff(full)) * FRAME_NS < 100_000_000
    for i, message in enumerate(messages):
        decoder = MotionDecoder()
        decoder.decode(messages[max(k for k in full if k <= i)])
        back = decoder.decode(message)
        assert back is not None and near(back, samples[i])


@pytest.mark.parametrize(("losses", "most"), [("rare", 8), ("some", 4), ("many", 1)])
def test_no_frame_needs_more_others_than_its_plan_says(losses: Losses, most: int) -> None:
    samples = random_motion(5, 72, wild=0.02)
    encoder = MotionEncoder(losses=losses)
    messages = [encoder.encode(s) for s in samples]
    refers = references(losses, len(messages))
    needed = 0
    for i in range(len(messages)):
        chain = [i]
        while (before := refers[chain[-1]]) is not None:
            chain.append(before)
        decoder = MotionDecoder()
        read = [decoder.decode(messages[k]) for k in reversed(chain)]
        assert read[-1] is not None and near(read[-1], samples[i])
        needed = max(needed, len(chain) - 1)
    assert needed == most


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32), losses=st.sampled_from(LOSSES), every=st.integers(1, 20))
def test_frames_worked_out_late_say_what_they_say_at_once(seed: int, losses: Losses, every: int) -> None:
    encoder, at_once, late = MotionEncoder(losses=losses), MotionDecoder(), MotionDecoder()
    opened: list[tuple[MotionSample | None, MotionFrame | ListFrame | None]] = []
    for sample in random_motion(seed, 60, face=True, wild=0.02):
        message = encoder.encode(sample)
        opened.append((at_once.decode(message), late.open(message)))
    for now, frame in opened[::every]:
        assert now is not None and frame is not None
        then = frame.sample()
        assert all(np.array_equal(a, b) for a, b in zip(flat(now).values(), flat(then).values(), strict=True))


@pytest.mark.parametrize("losses", LOSSES)
@pytest.mark.parametrize("wild", [0.0, 0.02])
def test_a_late_joiner_waits_half_a_second_at_most(wild: float, losses: Losses) -> None:
    encoder = MotionEncoder(losses=losses)
    messages = [encoder.encode(s) for s in random_motion(3, 240, wild=wild)]
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


def test_a_camera_that_comes_or_goes_begins_with_a_full_key_frame() -> None:
    encoder, decoder = MotionEncoder(), MotionDecoder()
    for i, s in enumerate(random_motion(1, 30, face=True, gaze=True, wild=0.0)):
        seen = i % 7 < 3
        now = replace(s, gaze=s.gaze if seen else None, face=s.face if seen else None, lids=None)
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
        message = second.encode(replace(s, t_ns=s.t_ns + 5_000_000_000))
        if n == 0:
            continue  # its key frame is lost
        back = decoder.decode(message)
        assert back is None or near(back, s)


def test_a_person_who_holds_still_does_not_tremble_from_noise_smaller_than_a_step() -> None:
    rng = np.random.default_rng(4)
    encoder, decoder = MotionEncoder(), MotionDecoder()
    values = {p: (0.3 * HIGH[p] // STEP[p] + 0.5) * STEP[p] for p in PARTS}  # on the edge of two steps
    seen: list[np.ndarray] = []
    for i in range(120):
        noisy = {p: v + 0.05 * rng.uniform(-1, 1, len(v)) * STEP[p] for p, v in values.items()}
        sample = MotionSample(i + 1, i * FRAME_NS, noisy["body"], noisy["hands"].reshape(2, 20), noisy["stance"])
        back = decoder.decode(encoder.encode(sample))
        assert back is not None
        seen.append(np.concatenate([back.body, back.hands.reshape(-1), back.stance]))
    assert len(np.unique(np.array(seen), axis=0)) == 1


@FUZZ
@given(data=st.binary(min_size=1, max_size=120), known=st.booleans())
def test_fuzz_bytes_of_any_kind_kill_no_decoder(data: bytes, known: bool) -> None:
    decoder = MotionDecoder()
    if known:
        for message in _SENT[:5]:
            decoder.decode(message)
    message = Motion(frame=data)
    message.header.seq, message.header.t_ns = 6, 10**18 + 5 * FRAME_NS
    sane(decoder.decode(message))


@FUZZ
@given(
    at=st.integers(0, 11),
    changes=st.lists(st.tuples(st.integers(0, 200), st.integers(0, 255)), min_size=1, max_size=4),
    cut=st.integers(0, 200),
)
def test_fuzz_damaged_frames_give_nothing_or_a_posture(at: int, changes: list[tuple[int, int]], cut: int) -> None:
    decoder = MotionDecoder()
    for message in (*_SENT[:at], _damaged(_SENT[at], changes, cut // 20), *_SENT[at + 1 :]):
        sane(decoder.decode(message))


def _damaged(message: Motion, changes: list[tuple[int, int]], cut: int) -> Motion:
    frame = bytearray(message.frame)
    for place, value in changes:
        frame[place % len(frame)] = value
    return Motion(header=message.header, frame=bytes(frame[: max(1, len(frame) - cut)]))


def test_fuzz_a_hundred_thousand_damaged_frames_give_nothing_or_numbers_in_their_range() -> None:
    """A million in `make fuzz`; every eighth is no frame at all."""
    rng = np.random.default_rng(9)
    step, low, high = scale(0)  # the widest ranges: a damaged frame may name another grain
    before, whole, bad = MotionDecoder(), 0, 0
    sent = _sent("many")
    places, bytes_ = rng.integers(1 << 20, size=(DAMAGED, 3)), rng.integers(256, size=(DAMAGED, 3), dtype=np.uint8)
    noise = rng.integers(256, size=1 << 16, dtype=np.uint8)
    for k in range(DAMAGED):
        if k % 4 == 0:
            before.decode(sent[0])
        message = sent[1 + k % 4]
        frame = np.frombuffer(message.frame, np.uint8).copy()
        if k % 8 == 0:
            frame = noise[places[k, 0] % 65_000 :][: 1 + places[k, 1] % 120]
        else:
            frame[places[k] % len(frame)] = bytes_[k]
        opened = before.open(Motion(header=message.header, frame=frame[: len(frame) - (k % 7 == 0)].tobytes()))
        if isinstance(opened, MotionFrame):
            numbers = opened.numbers()
            whole += opened.intact
            bad += int(np.any(numbers < low) or np.any(numbers > high))
    assert bad == 0
    assert whole > DAMAGED // 10
    assert np.isfinite(step).all()


def sane(back: MotionSample | None) -> None:
    """Numbers in their range: finite, and every rotation they stand for has a quaternion of length 1."""
    if back is not None:
        for part, numbers in flat(back).items():
            assert np.all((numbers >= LOW[part] - STEP[part]) & (numbers <= HIGH[part] + STEP[part]))
        angle = float(np.linalg.norm(back.body[8:11]))
        assert math.isfinite(angle)


def _sent(losses: Losses = "rare") -> list[Motion]:
    encoder = MotionEncoder(losses=losses)
    return [encoder.encode(s) for s in random_motion(8, 12, face=True, gaze=True, legs=True, wild=0.003)]


_SENT = _sent()


@settings(max_examples=300, deadline=None)
@given(data=st.binary(max_size=300))
def test_messages_of_any_kind_kill_no_decoder(data: bytes) -> None:
    message = Motion()
    try:
        message.ParseFromString(data)
    except Exception:
        return
    back = MotionDecoder().decode(message)
    assert back is None or all(np.isfinite(a).all() for a in flat(back).values())


def test_a_version_of_the_future_is_not_understood() -> None:
    sample = random_motion(1, 1)[0]
    encoder = MotionEncoder()
    encoder.encode(sample)
    frame = bytearray(MotionEncoder().encode(sample).frame)
    decoded = [MotionDecoder().decode(Motion(frame=bytes([b, *frame[1:]]))) for b in range(256)]
    assert sum(d is None for d in decoded) > 200  # the version stands in the first bytes


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
    assert total / 600 * 60 * 8 < 36_000


def test_lists_of_older_versions_still_mean_what_they_meant() -> None:
    """A key frame and a difference to it, as they stand in old logs: steps of 0.1 and 0.2 degrees, 0.5 mm, 0.2 mm."""
    decoder = MotionDecoder()
    key = Motion(key_seq=7, body=[100, -50, 0, 0, 0, 20], hands=[0, 30], stance=[2000, 0, -400, 900], gaze=[0], face=[5], stale=64)
    key.header.seq, key.header.t_ns = 7, 10**9
    change = Motion(key_seq=7, body=[-1], face=[0, 10])
    change.header.seq, change.header.t_ns = 8, 10**9 + FRAME_NS
    orphan = Motion(key_seq=3)
    orphan.header.seq, orphan.header.t_ns = 9, 10**9 + 2 * FRAME_NS
    first, second = decoder.decode(over_the_wire(key)), decoder.decode(over_the_wire(change))
    assert decoder.decode(orphan) is None
    assert first is not None and second is not None
    assert np.degrees(first.body[:2]) == pytest.approx([10.0, -5.0]) and first.body[5] == pytest.approx(0.01)
    assert np.degrees(first.hands[0, 1]) == pytest.approx(6.0)
    assert first.stance == pytest.approx([1.0, 0.0, -0.2, math.pi / 2])
    assert first.gaze is not None and first.face is not None and first.face[0] == pytest.approx(0.001)
    assert first.stale == StalePart.FACE and first.lids is None and first.legs is None
    assert np.degrees(second.body[0]) == pytest.approx(9.9) and second.face is not None
    assert second.face[:2] == pytest.approx([0.001, 0.002])
    too_long = Motion(key_seq=10, body=[1] * 26)
    too_long.header.seq = 10
    assert decoder.decode(too_long) is None
