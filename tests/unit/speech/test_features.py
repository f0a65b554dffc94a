"""Features of a stream do not depend on how it is cut, and no input harms them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.speech.acoustic import Acoustic, packaged
from vistel.speech.features import BANDS, HOP, WINDOW, LogMel, Normaliser, Resampler, as_float


def sound(seed: int, seconds: float = 1.0, rate: int = 16000) -> np.ndarray:
    random = np.random.default_rng(seed)
    time = np.arange(int(rate * seconds)) / rate
    swell = np.sin(2 * np.pi * 3.0 * time) ** 2
    return (0.1 * swell * np.sin(2 * np.pi * 300.0 * time) + 0.002 * random.standard_normal(len(time))).astype(np.float32)


@settings(max_examples=8, deadline=None)
@given(st.lists(st.integers(0, 16000), max_size=8).map(sorted), st.integers(0, 99))
def test_a_stream_gives_the_same_in_pieces_as_at_once(cuts: list[int], seed: int) -> None:
    whole = sound(seed)
    start = np.full(BANDS, -8.0, np.float32)
    mel, normaliser, net = LogMel(), Normaliser(start), Acoustic(packaged("japanese"))
    pieces = [net.feed(normaliser.feed(mel.feed(each))) for each in np.split(whole, cuts)]
    at_once = Acoustic(packaged("japanese")).feed(Normaliser(start).feed(LogMel().feed(whole)))
    np.testing.assert_allclose(np.concatenate(pieces), at_once, rtol=2e-3, atol=2e-3)


def test_frames_come_every_ten_milliseconds_and_posteriors_are_probabilities() -> None:
    frames = LogMel().feed(sound(1))
    assert frames.shape == ((16000 - WINDOW) // HOP + 1, BANDS)
    scores = Acoustic(packaged("japanese")).feed_all(Normaliser(packaged("japanese").start_mean).feed(frames))
    assert scores.shape == (len(frames), packaged("japanese").states)
    np.testing.assert_allclose(np.exp(scores).sum(1), 1.0, rtol=1e-4)


def test_a_tone_stands_in_its_band_whatever_the_level_once_the_level_is_known() -> None:
    loud, soft = (Normaliser(np.full(BANDS, -8.0, np.float32)) for _ in range(2))
    voice = np.concatenate([sound(k) for k in range(12)])
    a = loud.feed(LogMel().feed(voice))
    b = soft.feed(LogMel().feed(voice * np.float32(0.3)))
    band = int(a.mean(0).argmax())
    assert LogMel().feed(voice)[-50:, band].max() - LogMel().feed(voice * np.float32(0.3))[-50:, band].max() > 2.3
    assert abs(a[-50:, band].max() - b[-50:, band].max()) < 0.5


def test_what_is_learnt_of_a_voice_stays_through_an_hour_of_silence() -> None:
    normaliser = Normaliser(np.full(BANDS, -8.0, np.float32))
    normaliser.feed(LogMel().feed(sound(3, 4.0)))
    before = normaliser.mean.copy()
    normaliser.feed(np.full((360_000, BANDS), np.log(1e-7), np.float32))
    np.testing.assert_allclose(normaliser.mean, before, atol=0.2)


@pytest.mark.parametrize("rate", [8000, 11025, 16000, 22050, 44100, 48000, 96000])
def test_every_rate_of_sound_cards_becomes_ours(rate: int) -> None:
    tone = np.sin(2 * np.pi * 1000.0 * np.arange(rate) / rate).astype(np.float32)
    resampler = Resampler(rate)
    ours = np.concatenate([resampler.feed(each) for each in np.array_split(tone, 31)])
    assert abs(len(ours) - 16000) <= 40
    spectrum = np.abs(np.fft.rfft(ours[:15900] * np.hanning(15900)))
    assert abs(np.argmax(spectrum) * 16000 / 15900 - 1000.0) < 2.0
    np.testing.assert_allclose(ours, Resampler(rate).feed(tone)[: len(ours)], atol=1e-5)


def test_a_rate_out_of_range_is_refused_and_named() -> None:
    with pytest.raises(ValueError, match="a sample rate of 4000 Hz; expected 8000 to 96000"):
        Resampler(4000)


def test_what_is_no_number_is_silence_and_what_is_too_loud_is_clipped() -> None:
    bad = np.array([np.nan, np.inf, -np.inf, 7.0, 0.25], np.float32)
    np.testing.assert_array_equal(as_float(bad), np.array([0.0, 1.0, -1.0, 1.0, 0.25], np.float32))
    assert as_float(np.array([-32768, 16384], np.int16)).tolist() == [-1.0, 0.5]
