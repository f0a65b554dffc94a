"""Frames of the world: what is written is read again, errors are bounded, broken bytes are refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.wire.world.codec.bits import BitReader, BitWriter, FrameError
from vistel.wire.world.codec.frame import (
    MOST_ENCODED,
    STILL_STEPS,
    Book,
    ChangedLists,
    Moves,
    is_key,
    read_changes,
    read_key,
    write_changes,
    write_key,
)
from vistel.wire.world.codec.poses import STILL, GridPose, place, rounded
from vistel.wire.world.codec.touches import MOST_LEVEL, TouchCode, force_of, level_of

NEITHER = ChangedLists(people=False, grasps=False)
numbers = st.integers(-(2**24), 2**24)


@given(st.lists(st.tuples(numbers, st.integers(0, 14))), st.lists(numbers, max_size=8))
def test_numbers_come_back(values: list[tuple[int, int]], several: list[int]) -> None:
    out = BitWriter()
    for value, order in values:
        out.signed(value, order)
        out.count(abs(value), order)
        out.flag(value > 0)
    out.several(several, 3)
    data = BitReader(out.to_bytes())
    for value, order in values:
        assert (data.signed(order), data.count(order), data.flag()) == (value, abs(value), value > 0)
    assert data.several(len(several), 3) == several
    assert data.left < 8


coordinates = st.floats(-20.0, 20.0)


@given(st.tuples(coordinates, coordinates, coordinates), st.integers(0, 2**32 - 1))
def test_a_rounded_pose_is_off_by_less_than_anybody_sees(at: tuple[float, ...], seed: int) -> None:
    turn = np.random.default_rng(seed).normal(size=4)
    turn /= np.linalg.norm(turn)
    position, rotation = place(rounded(np.array(at), turn))
    assert np.linalg.norm(position - at) <= 0.00044
    assert math.degrees(2.0 * math.acos(min(1.0, abs(float(rotation @ turn))))) <= 0.12


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_place_that_is_none_is_encoded_as_the_middle_of_the_room(bad: float) -> None:
    assert rounded(np.array([0.0, bad, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])) == STILL
    assert rounded(np.zeros(3), np.zeros(4)) == STILL
    far = place(rounded(np.array([1e200, 0.0, -1e200]), np.array([0.0, 0.0, 0.0, 1.0])))[0]
    assert 100.0 < far[0] < 200.0 and -200.0 < far[2] < -100.0


@given(st.floats(0.0, 5e4))
def test_a_force_comes_back_to_half_an_octave(newtons: float) -> None:
    level = level_of(newtons)
    assert 0 <= level <= MOST_LEVEL
    if 0.2 < newtons < 3000.0:
        assert 0.6 < force_of(level) / newtons < 1.6


def flight(n: int, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Thing `n` at step `k` of a curved way that comes to rest at step 60."""
    t = min(k, 60) / 60
    at = np.array([math.sin(2.0 * t + n), 1.0 + t * (1.0 - t), 0.3 * n])
    return at, np.array([math.sin(t + n), 0.0, 0.0, math.cos(t + n)])


def test_steps_of_many_frames_come_back_as_they_were_rounded_and_things_at_rest_are_no_longer_named() -> None:
    writer = Book()
    first = [rounded(*flight(n, 0)) for n in range(6)]
    data = write_key(writer, 1, first, [1, 2], {(0, 3): TouchCode(0b1011, 4)})
    assert is_key(data)
    book, said = read_key(data, 1)
    assert said == ChangedLists(True, True)
    assert book.touches == {(0, 3): TouchCode(0b1011, 4)}
    sizes: list[int] = []
    for k in range(1, 101, 2):
        steps = [Moves(1 + j, {n: rounded(*flight(n, j)) for n in (1, 2, 4)} if j <= 60 else {}) for j in (k, k + 1)]
        touches = {(0, 3): TouchCode(0b1001, 4)} if k < 50 else {(1, 0): TouchCode(1 << 70, 31)}
        data = write_changes(writer, steps, touches, NEITHER)
        assert not is_key(data)
        with pytest.raises(FrameError):
            read_changes(data, book, 3 + k)
        read, said = read_changes(data, book, 2 + k)
        assert said == NEITHER
        assert [s.step for s in read] == [1 + k, 2 + k]
        for step in read:
            for n, pose in step.poses.items():
                want = place(rounded(*flight(n, min(step.step - 1, 60))))
                assert np.array_equal(place(pose)[0], want[0])
                assert abs(float(place(pose)[1] @ want[1])) > 1.0 - 1e-12
        assert book.touches == touches
        assert book.moving == writer.moving
        sizes.append(len(data))
    assert book.moving == ()
    assert max(sizes[5:25]) <= 24  # three things, two steps
    assert sizes[(60 + STILL_STEPS) // 2 + 2 :] and max(sizes[(60 + STILL_STEPS) // 2 + 2 :]) <= 2


def test_when_everything_flies_what_is_published_stays_bounded_and_all_is_exact_once_it_lies() -> None:
    many, still = 200, np.array([0.0, 0.0, 0.0, 1.0])
    ways = np.cumsum(np.random.default_rng(1).normal(0.0, 0.01, (61, many, 3)), axis=0)  # nobody can predict these

    def pose(n: int, k: int) -> GridPose:
        return rounded(ways[min(k, 60), n], still)

    writer = Book()
    data = write_key(writer, 1, [pose(n, 0) for n in range(many)], range(many), {})
    book, _ = read_key(data, 1)
    sizes: list[int] = []
    wrong: list[float] = []
    for k in range(1, 121, 2):
        steps = [Moves(1 + j, {n: pose(n, j) for n in range(many)}) for j in (k, k + 1)]
        data = write_changes(writer, steps, {}, NEITHER)
        sizes.append(len(data))
        for step in read_changes(data, book, 2 + k)[0]:
            wrong += [float(np.linalg.norm(place(p)[0] - ways[min(step.step - 1, 60), n])) for n, p in step.poses.items()]
    assert max(sizes) < 2 * (2 * many + MOST_ENCODED * 64) / 8
    assert max(sizes) > 0.4 * 2 * (2 * many + MOST_ENCODED * 64) / 8
    assert np.percentile(wrong, 99) < 0.15
    assert book.moving == ()
    assert [track.pose for track in book.tracks] == [pose(n, 60) for n in range(many)]


@settings(max_examples=200)
@given(st.binary(max_size=60), st.booleans())
def test_broken_bytes_are_refused_or_harmless(data: bytes, key: bool) -> None:
    book = Book()
    write_key(book, 1, [STILL] * 9, [3, 4], {})
    try:
        if key:
            read_key(b"\x80" + data, 5)
        else:
            for newest in range(2, 6):
                read_changes(data, book, newest)
    except FrameError:
        pass


def test_a_frame_cut_off_anywhere_is_refused() -> None:
    book = Book()
    data = write_key(book, 1, [rounded(*flight(n, 3)) for n in range(4)], [1], {(0, 1): TouchCode(7, 2)})
    for size in range(len(data) - 1):
        with pytest.raises(FrameError):
            read_key(data[:size], 1)
