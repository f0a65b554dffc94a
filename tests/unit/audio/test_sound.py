"""Codec, levels, resampling, stretching, directions, mixing, wanted delays."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest
from voice_sounds import vowel

from vistel.audio.delay_policy import DelayUnitShare, Policy, TargetDelay, read_policy
from vistel.audio.levels import SILENT_DB, Meter, is_clipped
from vistel.audio.mixer import Limiter, PanningMixer
from vistel.audio.opus import FRAME, RATE, Decoder, Encoder, OpusError
from vistel.audio.resample import reach, sinc_resample
from vistel.audio.spatial import Head, InterauralCues, interaural_cues, source_direction
from vistel.audio.stretch import OVERLAP, best_shift
from vistel.audio.transit import TransitEstimate

SECOND_NS = 1_000_000_000


def test_a_voice_comes_through_the_codec_in_about_sixty_bytes_a_frame() -> None:
    said = vowel(2.0)
    encoder, decoder = Encoder(), Decoder()
    sent = [encoder.encode(said[k * FRAME : (k + 1) * FRAME]) for k in range(100)]
    heard = np.concatenate([decoder.decode(p) for p in sent])
    assert 20 < np.mean([len(p) for p in sent]) < 80
    late = round(encoder.lookahead_ns * RATE / SECOND_NS)
    lag = int(np.argmax(np.correlate(heard[RATE - 96 : RATE + 9600 + 1000], said[RATE : RATE + 9600], "valid"))) - 96
    assert lag == pytest.approx(late, abs=48)


def test_silence_needs_no_packets() -> None:
    encoder = Encoder()
    sizes = [len(encoder.encode(np.zeros(FRAME, np.float32))) for _ in range(100)]
    assert sum(size > 2 for size in sizes[50:]) <= 5


def test_a_lost_frame_comes_back_from_its_successor() -> None:
    said = vowel(1.0)
    encoder, decoder = Encoder(), Decoder()
    sent = [encoder.encode(said[k * FRAME : (k + 1) * FRAME]) for k in range(50)]
    for packet in sent[:30]:
        decoder.decode(packet)
    recovered = decoder.recover(sent[31])
    assert np.sqrt(np.mean(recovered**2)) > 0.3 * np.sqrt(np.mean(said[30 * FRAME : 31 * FRAME] ** 2))


def test_bytes_that_are_no_packet_and_frames_of_another_length_are_refused_in_words() -> None:
    with pytest.raises(OpusError, match="no frame of 20 ms"):
        Decoder().decode(b"\xff\xff\xff\xff")
    with pytest.raises(ValueError, match="960 samples"):
        Encoder().encode(np.zeros(480, np.float32))


def test_levels_tell_speech_from_the_noise_of_a_room_and_clipping_from_loudness() -> None:
    rng, meter = np.random.default_rng(0), Meter()
    noise = [meter.measure(np.asarray(0.002 * rng.standard_normal(FRAME), np.float32)) for _ in range(200)]
    assert not any(level.talking for level in noise[50:])
    loud = meter.measure(vowel(0.02))
    assert loud.talking
    assert loud.rms_db == pytest.approx(20 * math.log10(np.sqrt(np.mean(vowel(0.02) ** 2))), abs=0.1)
    assert not loud.clipped
    assert is_clipped(np.clip(5.0 * vowel(0.02), -1.0, 1.0))
    assert not is_clipped(np.eye(1, FRAME, dtype=np.float32)[0])
    assert Meter().measure(np.zeros(FRAME, np.float32)).rms_db == SILENT_DB


@pytest.mark.parametrize("rate", [8_000, 11_025, 16_000, 22_050, 44_100, 96_000])
def test_any_rate_becomes_forty_eight_kilohertz_with_its_tones_and_without_others(rate: int) -> None:
    step, tone = rate / RATE, 1000.0
    t = np.arange(rate) / rate
    source = np.sin(2 * np.pi * tone * t).astype(np.float32)
    if rate > RATE:
        source += np.sin(2 * np.pi * 40_000.0 * t).astype(np.float32)
    out = sinc_resample(source, float(reach(step)), step, 24_000)
    wanted = np.sin(2 * np.pi * tone * (reach(step) + step * np.arange(24_000)) / rate)
    assert np.sqrt(np.mean((out - wanted) ** 2)) < 0.01


def test_positions_without_neighbours_are_refused() -> None:
    with pytest.raises(ValueError, match="more samples"):
        sinc_resample(np.zeros(100, np.float32), 0.0, 1.0, 50)


def test_a_period_is_found_where_a_vowel_resembles_itself() -> None:
    held = np.asarray(sum(np.sin(2 * np.pi * 125.0 * k * np.arange(4000) / RATE) / k for k in range(1, 8)), np.float32)
    shift, alike = best_shift(held[:OVERLAP], held[200 : 200 + 400 + OVERLAP])
    assert 200 + shift == pytest.approx(RATE / 125.0, abs=2)
    assert alike > 0.99


def facing(x: float, z: float, towards: float = 0.0) -> Head:
    c, s = math.cos(towards), math.sin(towards)
    return Head(np.array([x, 0.0, z]), np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]))


def cues(listener: Head, talker: Head) -> InterauralCues:
    return interaural_cues(source_direction(listener, talker))


def test_a_voice_from_the_left_is_louder_and_earlier_in_the_left_ear() -> None:
    left = cues(facing(0, 0), facing(1.2, 0.0, -math.pi / 2))
    assert left.gain[0] > 1.5 * left.gain[1]
    assert left.delay_s[0] == 0.0
    assert left.delay_s[1] == pytest.approx(0.00066, abs=0.00003)
    right = cues(facing(0, 0), facing(-1.2, 0.0, math.pi / 2))
    assert right.gain == left.gain[::-1]


def test_a_voice_is_quieter_from_afar_and_duller_from_behind_its_head() -> None:
    near, far = (cues(facing(0, 0), facing(0.0, d, math.pi)) for d in (1.0, 4.0))
    assert near.gain[0] == pytest.approx(4.0 * far.gain[0], rel=0.01)
    away = cues(facing(0, 0), facing(0.0, 1.0, 0.0))
    assert away.gain[0] < near.gain[0]
    assert away.shadow[0] > near.shadow[0]


def test_a_moving_talker_does_not_click() -> None:
    mixer, said = PanningMixer(), vowel(1.0)
    blocks = []
    for k in range(40):
        side = 1.0 if k % 10 < 5 else -1.0
        direction = source_direction(facing(0, 0), facing(side, 0.8, math.pi))
        blocks.append(mixer.mix({"ann": said[k * FRAME : (k + 1) * FRAME]}, {"ann": direction}))
    out = np.concatenate([b for b in blocks if b is not None])
    assert out.shape == (40 * FRAME, 2)
    assert np.abs(np.diff(out, axis=0)).max() < 1.6 * np.abs(np.diff(said)).max()


def test_twenty_loud_voices_do_not_clip_and_one_passes_unchanged() -> None:
    mixer, said = PanningMixer(), vowel(0.4)
    alone = mixer.mix({"ann": said[:FRAME]}, {"ann": None})
    assert alone is not None
    assert np.allclose(alone[:, 0], said[:FRAME], atol=1e-6)
    crowd = {f"p{i}": 2.0 * said[FRAME : 2 * FRAME] for i in range(20)}
    loud = mixer.mix(crowd, {})
    assert loud is not None
    assert np.abs(loud).max() <= 1.0
    assert PanningMixer().mix({}, {}) is None
    assert np.array_equal(Limiter().apply(np.full((4, 2), 0.5, np.float32)), np.full((4, 2), 0.5, np.float32))


def observed(estimate: TransitEstimate, transits_ms: Iterable[float], begin_ms: float = 0.0) -> float:
    """Frames captured every 20 ms that took so long; when the last one was."""
    at_ms = begin_ms
    for transit_ms in transits_ms:
        at_ms += 20.0
        estimate.observe(round(transit_ms * 1e6), round((at_ms + transit_ms) * 1e6))
    return at_ms


def test_an_estimated_transit_is_what_nearly_all_frames_keep_to_and_has_a_margin_at_first() -> None:
    estimate = TransitEstimate()
    assert not estimate.known
    at_ms = observed(estimate, [40.0])
    assert estimate.transit_ns == 70_000_000
    at_ms = observed(estimate, (40.0 + k % 10 for k in range(300)), at_ms)
    assert estimate.transit_ns == 49_000_000
    observed(estimate, [30.0] * 500, at_ms)
    assert estimate.transit_ns == 30_000_000


def test_a_network_that_has_become_slower_is_followed_within_a_second() -> None:
    estimate = TransitEstimate()
    at_ms = observed(estimate, [40.0] * 500)
    observed(estimate, [120.0] * 75, at_ms)
    assert estimate.transit_ns == 120_000_000


@pytest.mark.parametrize("frames", [100, 500])
def test_what_stood_still_once_is_not_waited_for_ever_after(frames: int) -> None:
    estimate = TransitEstimate()
    at_ms = observed(estimate, [40.0] * frames)
    stood_ms = 700.0
    for k in range(35):  # all that was captured while it stood comes at once
        estimate.observe(round((stood_ms - 20.0 * k) * 1e6), round((at_ms + stood_ms) * 1e6))
    assert estimate.transit_ns == 40_000_000
    observed(estimate, [40.0] * 100, at_ms + stood_ms)
    assert estimate.transit_ns == 40_000_000


def test_what_stands_still_again_and_again_is_waited_for() -> None:
    estimate, at_ms = TransitEstimate(), 0.0
    for _ in range(6):
        at_ms = observed(estimate, [40.0] * 60, at_ms)
        estimate.observe(200_000_000, round((at_ms + 200.0) * 1e6))
    assert estimate.transit_ns == 200_000_000


def test_a_delay_unit_takes_over_what_was_to_spare_for_a_while_and_gives_way_at_once() -> None:
    share = DelayUnitShare()
    wanted = [share.wanted_s(k * SECOND_NS // 4, 0.25 + 0.01 * (k % 3)) for k in range(24)]
    assert wanted[:16] == [None] * 16
    assert wanted[20] == pytest.approx(0.23)
    assert share.wanted_s(7 * SECOND_NS, 0.1) == pytest.approx(0.08)
    assert share.wanted_s(8 * SECOND_NS, 0.25) == pytest.approx(0.08)
    assert share.wanted_s(12 * SECOND_NS, 0.25) == pytest.approx(0.23)
    assert share.wanted_s(13 * SECOND_NS, 0.0) == 0.0


def test_a_target_follows_the_picture_smoothly_and_waits_for_the_network() -> None:
    target = TargetDelay(Policy())
    assert target.wanted_s(0, 0.07, speaking=False) == 0.07
    for k in range(10):
        target.receive_image_delay(k * SECOND_NS // 2, 0.150)
    assert target.wanted_s(5 * SECOND_NS, 0.07, speaking=False) == 0.150
    for k in range(10, 20):
        target.receive_image_delay(k * SECOND_NS // 2, 0.250)
    assert target.wanted_s(11 * SECOND_NS // 2, 0.07, speaking=True) == pytest.approx(0.190)
    assert target.wanted_s(10 * SECOND_NS, 0.07, speaking=True) == 0.250
    assert target.wanted_s(10 * SECOND_NS, 0.3, speaking=False) == 0.3
    assert target.image_s(60 * SECOND_NS) is None


def test_a_fixed_delay_is_the_same_for_all() -> None:
    policy = read_policy("fixed 0.2")
    target = TargetDelay(policy)
    target.receive_image_delay(0, 0.11)
    assert target.wanted_s(0, 0.07, speaking=False) == 0.2
    assert str(policy) == "fixed 0.2"
    assert str(read_policy("match")) == "match"


@pytest.mark.parametrize("text", ["", "fixed", "fixed -1", "fixed 9", "0.2", "fixed 0.2 s"])
def test_a_policy_that_is_none_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ValueError, match=r"fixed 0\.2"):
        read_policy(text)
