"""A talker as heard: lost, late and disordered packets, moving delays, silence, senders that begin again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from voice_sounds import START_NS, longest_quiet_ms, packets, vowel

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.audio.stream import VoiceStream

VOWEL = vowel(6.0)
PACKETS = packets(VOWEL)


def heard(
    stream: VoiceStream, arriving: list[tuple[int, int, bytes]], blocks: int, delay_ns: Callable[[int], float]
) -> tuple[F32, list[float | None]]:
    """What is heard in blocks from START_NS on, and the delay of each."""
    arriving, at = sorted(arriving), 0
    out, delays = [], []
    for block in range(blocks):
        now_ns = START_NS + block * FRAME_NS
        while at < len(arriving) and arriving[at][0] <= now_ns:
            stream.push(*arriving[at][1:])
            at += 1
        pcm = stream.read(float(now_ns), FRAME, delay_ns(block))
        out.append(np.zeros(FRAME, np.float32) if pcm is None else pcm)
        delays.append(stream.delay_ns)
    return np.concatenate(out), delays


def on_time(sent: list[tuple[int, bytes]], late_ns: int = 30_000_000) -> list[tuple[int, int, bytes]]:
    return [(t_ns + late_ns, t_ns, packet) for t_ns, packet in sent]


def test_what_is_heard_is_what_was_said_the_wanted_delay_later() -> None:
    said = VOWEL * (0.3 + 0.7 * (np.sin(2 * np.pi * 1.3 * np.arange(len(VOWEL)) / RATE) > 0)).astype(np.float32)
    sound, delays = heard(VoiceStream(), on_time(packets(said)), 250, lambda b: 100e6)
    assert {d for d in delays if d is not None} == {100e6}
    lag = np.argmax(np.correlate(sound[RATE : 3 * RATE], said[RATE : 2 * RATE], "valid"))
    assert lag == pytest.approx(0.1 * RATE, abs=0.001 * RATE)


@pytest.mark.parametrize("seed", range(4))
def test_ten_per_cent_loss_with_jitter_leaves_no_gap_above_sixty_milliseconds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arriving = [
        (t_ns + 30_000_000 + int(rng.integers(50_000_000)), t_ns, packet) for t_ns, packet in PACKETS if rng.random() >= 0.1
    ]
    stream = VoiceStream()
    sound, _ = heard(stream, arriving, 280, lambda b: 130e6)
    assert stream.counters.recovered + stream.counters.concealed >= 15
    assert stream.counters.late == 0
    assert longest_quiet_ms(sound[RATE // 2 : 5 * RATE], 0.03) <= 60.0


@pytest.mark.parametrize("lost", [{60}, {60, 61}, {60, 90, 91, 120}])
def test_frames_that_their_successors_carry_once_more_are_heard_as_if_nothing_had_been_lost(lost: set[int]) -> None:
    whole, _ = heard(VoiceStream(), on_time(PACKETS), 200, lambda b: 130e6)
    stream, out, at = VoiceStream(), [], 0
    regained: list[int] = []
    for block in range(200):
        while at <= min(block - 2, len(PACKETS) - 1):
            earlier = [packet for _, packet in reversed(PACKETS[max(0, at - 2) : at])]
            if at not in lost:
                regained += [at - back for back in stream.push(*PACKETS[at], earlier)]
            at += 1
        pcm = stream.read(float(START_NS + block * FRAME_NS), FRAME, 130e6)
        out.append(np.zeros(FRAME, np.float32) if pcm is None else pcm)
    assert set(regained) == lost
    assert stream.counters.recovered == stream.counters.concealed == stream.counters.late == 0
    assert np.array_equal(np.concatenate(out)[40 * FRAME :], whole[40 * FRAME :])


def test_two_frames_in_a_row_that_one_message_repeats_by_halves_are_both_recovered() -> None:
    """The second is there once more; in it is a coarse copy of the first."""
    stream, recovered = VoiceStream(), 0
    for k, (t_ns, packet) in enumerate(PACKETS[:100]):
        if k not in (60, 61):
            stream.push(t_ns, packet, [PACKETS[k - 1][1]] if k else [])
        stream.read(float(t_ns), FRAME, 60e6)
        recovered = max(recovered, stream.counters.recovered)
    assert stream.counters.concealed == 0
    assert recovered == 1


def test_a_delay_that_moves_is_followed_without_a_click_and_without_a_change_of_pitch() -> None:
    stream = VoiceStream()
    sound, delays = heard(stream, on_time(PACKETS), 280, lambda b: 100e6 if b < 60 else 180e6 if b < 160 else 110e6)
    assert delays[150] == pytest.approx(180e6, abs=1.5e6)
    assert delays[270] == pytest.approx(110e6, abs=1.5e6)
    assert stream.counters.splices >= 8
    assert stream.counters.jumps == 0
    calm, _ = heard(VoiceStream(), on_time(PACKETS), 280, lambda b: 100e6)
    steepest = np.abs(np.diff(calm[RATE // 2 : 5 * RATE])).max()
    assert np.abs(np.diff(sound[RATE // 2 : 5 * RATE])).max() < 1.1 * steepest
    spectrum = np.abs(np.fft.rfft(sound[RATE : RATE + 3 * RATE] * np.hanning(3 * RATE)))
    assert 120.0 < np.argmax(spectrum[: 3 * 200]) / 3 < 140.0


def test_the_delay_moves_by_no_more_than_a_seventh_of_the_time_that_passes() -> None:
    _, delays = heard(VoiceStream(), on_time(PACKETS), 200, lambda b: 100e6 if b < 60 else 180e6)
    moving = [d for d in delays[60:] if d is not None]
    steps = np.diff(moving)
    assert np.sum(steps[:30]) < 30 * FRAME_NS / 7.0 + 15e6


def test_in_silence_the_delay_jumps_at_once() -> None:
    pause = np.concatenate((VOWEL[:RATE], np.zeros(RATE, np.float32), VOWEL[: 2 * RATE]))
    stream = VoiceStream()
    _, delays = heard(stream, on_time(packets(pause)), 180, lambda b: 100e6 if b < 75 else 200e6)
    assert stream.counters.splices == 0
    assert all(d is None or d == pytest.approx(200e6, abs=1e6) for d in delays[80:])


@pytest.mark.parametrize("ppm", [-300.0, 80.0, 300.0])
def test_the_drift_of_a_senders_sound_card_is_taken_up_and_reported(ppm: float) -> None:
    sent = [(round(START_NS + (t_ns - START_NS) * (1.0 - 1e-6 * ppm)), packet) for t_ns, packet in packets(vowel(20.0))]
    stream = VoiceStream()
    _, delays = heard(stream, on_time(sent), 980, lambda b: 120e6)
    assert all(abs(d - 120e6) < 2e6 for d in delays[20:] if d is not None)
    assert stream.counters.splices == stream.counters.jumps == 0
    assert stream.drift_ppm == pytest.approx(ppm, rel=0.5)


def test_the_end_of_a_turn_is_silent_and_the_next_begins_on_time_even_an_hour_later() -> None:
    first, hour_ns = PACKETS[:50], 3_600_000_000_000
    over = (START_NS + 50 * FRAME_NS, b"")
    stream = VoiceStream()
    sound, delays = heard(stream, on_time([*first, over]), 100, lambda b: 100e6)
    assert delays[-1] is None
    assert np.all(sound[70 * FRAME :] == 0.0)
    for t_ns, packet in PACKETS[:50]:
        stream.push(t_ns + hour_ns, packet)
    later = [stream.read(START_NS + hour_ns + b * FRAME_NS, FRAME, 100e6) for b in range(20)]
    assert all(pcm is None for pcm in later[:4])
    assert all(pcm is not None for pcm in later[5:])
    assert stream.delay_ns == pytest.approx(100e6, abs=1e6)


def test_a_sender_whose_clock_went_back_is_heard_again() -> None:
    stream = VoiceStream()
    heard(stream, on_time(PACKETS), 100, lambda b: 100e6)
    back_ns = 60_000_000_000
    for t_ns, packet in PACKETS[:60]:
        stream.push(t_ns - back_ns, packet)
    again = [stream.read(START_NS - back_ns + b * FRAME_NS, FRAME, 100e6) for b in range(50)]
    assert sum(pcm is not None for pcm in again) > 40


def test_packets_that_are_none_are_counted_and_cost_only_themselves() -> None:
    sent = [(t_ns, b"\x9f\xff\x00 nonsense" if k % 10 == 3 else p) for k, (t_ns, p) in enumerate(PACKETS)]
    stream = VoiceStream()
    sound, _ = heard(stream, on_time(sent), 250, lambda b: 100e6)
    assert stream.counters.played > 200
    assert np.isfinite(sound).all()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(-5, 400), st.integers(-200, 700), st.sampled_from(range(0, 60))), max_size=60), st.data())
def test_any_order_of_any_packets_at_any_delay_gives_blocks_or_silence(
    arriving: list[tuple[int, int, int]], data: st.DataObject
) -> None:
    stream = VoiceStream()
    for at, stamp, which in arriving:
        stream.push(START_NS + stamp * 7_000_000, PACKETS[which][1] if which % 7 else b"")
        pcm = stream.read(START_NS + at * 11_000_000.0, FRAME, data.draw(st.floats(0.0, 5e8)))
        assert pcm is None or (pcm.shape == (FRAME,) and np.isfinite(pcm).all())
