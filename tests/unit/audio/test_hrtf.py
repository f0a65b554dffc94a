"""Transfer functions of the model head against the literature, and voices mixed through them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from voice_sounds import vowel

from vistel.audio import hrtf
from vistel.audio.binaural import BinauralMixer
from vistel.audio.opus import FRAME, RATE
from vistel.audio.spatial import HEAD_RADIUS, SOUND_SPEED, SourceDirection
from vistel.audio.sphere import at_surface

FREQUENCY = np.fft.rfftfreq(512, 1.0 / RATE)
RADIUS_S = HEAD_RADIUS / SOUND_SPEED


def interaural(azimuth_deg: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How much later [s] and quieter [dB] the right ear hears, at FREQUENCY[1:] below 16 kHz."""
    left, right = hrtf.response(math.radians(azimuth_deg), 0.0, pinna=False)[:, 1:170]
    ratio = left / right
    return np.unwrap(np.angle(ratio)) / (2.0 * np.pi * FREQUENCY[1:170]), 20.0 * np.log10(np.abs(ratio))


def at(hz: float) -> int:
    return int(np.argmin(np.abs(FREQUENCY[1:] - hz)))


@pytest.mark.parametrize("azimuth", [10.0, 30.0, 60.0, 90.0, 135.0])
def test_the_delay_between_the_ears_is_kuhns_for_low_and_woodworths_for_high_frequencies(azimuth: float) -> None:
    late, _ = interaural(azimuth)
    angle = math.radians(min(azimuth, 180.0 - azimuth))
    assert late[at(300.0)] == pytest.approx(3.0 * RADIUS_S * math.sin(angle), abs=20e-6)
    assert late[at(10_000.0)] == pytest.approx(RADIUS_S * (angle + math.sin(angle)), abs=50e-6)


def test_the_far_ear_hears_less_the_higher_the_pitch_and_nothing_is_louder_straight_ahead() -> None:
    _, level = interaural(60.0)
    assert level[at(250.0)] < 2.5
    assert 2.0 < level[at(500.0)] < 5.0
    assert 5.0 < level[at(2000.0)] < 13.0
    assert level[at(6000.0)] > 12.0
    _, ahead = interaural(0.0)
    assert np.abs(ahead).max() < 1e-9


def test_a_sphere_doubles_pressure_where_a_high_tone_strikes_it_and_leaves_low_ones_alone() -> None:
    """Duda and Martens 1998, figures 2 and 3."""
    angles = np.radians([0.0, 90.0, 155.0, 180.0])
    h = np.abs(at_surface(np.array([20.0, 12_000.0]), angles, HEAD_RADIUS, 100.0 * HEAD_RADIUS, SOUND_SPEED))
    assert h[:, 0] == pytest.approx(1.0, abs=0.02)
    assert h[0, 1] == pytest.approx(2.0, rel=0.05)
    assert h[2, 1] < 0.3, "the shadow is deepest beside the back"
    assert h[3, 1] > 2.5 * h[2, 1], "straight behind, the ways round all sides meet"


def test_mirrored_directions_are_mirrored_ears_and_up_is_not_down() -> None:
    assert np.allclose(hrtf.impulse(10, 4), hrtf.impulse(-10, 4)[::-1], atol=1e-6)
    assert not np.allclose(hrtf.impulse(10, 8), hrtf.impulse(10, -8), atol=0.05)
    assert not np.allclose(hrtf.impulse(10, 0), hrtf.impulse(50, 0), atol=0.05), "before and behind sound the same"


def test_filters_are_over_before_they_are_cut_off_and_begin_after_their_first_sample() -> None:
    for azimuth in range(-60, 61, 10):
        h = hrtf.impulse(azimuth, 0)
        assert np.abs(h[:, -40:]).max() < 0.01 * np.abs(h).max()
        assert np.abs(h[:, :3]).max() < 0.02 * np.abs(h).max()


def test_blocks_filtered_one_by_one_are_what_convolution_of_the_whole_gives() -> None:
    said, direction = vowel(0.4), SourceDirection(math.radians(60.0), 0.0)
    mixer = BinauralMixer()
    blocks = [mixer.mix({"ann": said[k : k + FRAME]}, {"ann": direction}) for k in range(0, len(said), FRAME)]
    out = np.concatenate([b for b in blocks if b is not None])
    h = hrtf.impulse(20, 0)
    whole = np.stack([np.convolve(said, h[ear])[: len(said)] for ear in (0, 1)], 1)
    assert np.allclose(out, whole, atol=1e-4)


def test_somebody_far_who_turns_away_is_quieter_and_duller_and_unknown_places_are_plain() -> None:
    near, away = hrtf.filters(SourceDirection(0.5, 0.0)), hrtf.filters(SourceDirection(0.5, 0.0, 0.5, 1.0))
    low, high = round(300.0 * hrtf.SIZE / RATE), round(9000.0 * hrtf.SIZE / RATE)
    assert np.abs(away[0, low] / near[0, low]) == pytest.approx(0.5, abs=0.01)
    assert np.abs(away[0, high] / near[0, high]) < 0.36
    assert np.abs(hrtf.filters(None)) == pytest.approx(1.0, abs=1e-5)


def test_a_talker_who_moves_does_not_click_and_silence_is_silence() -> None:
    said = vowel(1.0)

    def steepest(side: Callable[[int], float]) -> float:
        mixer, blocks = BinauralMixer(), []
        for k in range(40):
            blocks.append(mixer.mix({"ann": said[k * FRAME : (k + 1) * FRAME]}, {"ann": SourceDirection(side(k), 0.0)}))
        return float(np.abs(np.diff(np.concatenate([b for b in blocks if b is not None]), axis=0)).max())

    assert steepest(lambda k: 1.2 if k % 10 < 5 else -1.2) < 1.1 * steepest(lambda k: 1.2)
    mixer = BinauralMixer()
    assert mixer.mix({}, {}) is None
    crowd = {f"p{i}": 2.0 * said[:FRAME] for i in range(20)}
    loud = mixer.mix(crowd, {name: SourceDirection(0.1 * i, 0.0) for i, name in enumerate(crowd)})
    assert loud is not None
    assert np.abs(loud).max() <= 1.0
