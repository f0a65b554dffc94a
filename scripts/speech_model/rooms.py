"""What happens to speech between mouth and recogniser: room, other sounds, microphone. Everything drawn from a generator."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scripts.speech_model.voices import RATE
from vistel.arrays import F32


def impulse_response(random: np.random.Generator, t60_s: float, direct_db: float) -> F32:
    """A room: the direct sound, a few early reflections and a tail that falls by 60 dB in `t60_s`.

    direct_db: energy of the direct sound over that of all the rest.
    """
    size = int(RATE * min(t60_s, 0.9))
    time = np.arange(size) / RATE
    start = int(RATE * random.uniform(0.002, 0.012))
    tail = random.standard_normal(size) * 10.0 ** (-3.0 * time / t60_s)
    tail[:start] = 0.0
    for _ in range(random.integers(3, 9)):
        at = start + int(random.exponential(0.012) * RATE)
        if at < size:
            tail[at] += random.normal() * 6.0 * 10.0 ** (-3.0 * at / RATE / t60_s)
    dull = np.exp(-np.arange(24) / random.uniform(0.5, 3.0))
    tail = np.convolve(tail, dull / dull.sum())[:size]
    tail *= 10.0 ** (-direct_db / 20.0) / np.sqrt((tail**2).sum())
    tail[0] = 1.0
    return (tail / np.sqrt((tail**2).sum())).astype(np.float32)


def coloured(random: np.random.Generator, count: int, slope_db: float) -> F32:
    """Noise whose spectrum falls by `slope_db` an octave: 0 white, 3 pink."""
    size = 1 << (count - 1).bit_length()
    spectrum = np.fft.rfft(random.standard_normal(size, np.float32))
    octaves = np.log2(np.maximum(np.arange(len(spectrum)) * RATE / size, 40.0) / 40.0)
    fall = (10.0 ** (-slope_db * octaves / 20.0)).astype(np.float32)
    return np.fft.irfft(spectrum * fall, size)[:count].astype(np.float32)


def hum(random: np.random.Generator, count: int) -> F32:
    """Mains and a fan: harmonics over dark noise."""
    base = random.choice([50.0, 60.0, 120.0, float(random.uniform(70, 400))])
    time = np.arange(count) / RATE
    tone = np.zeros(count)
    for k in range(1, random.integers(3, 9)):
        tone += random.uniform(0.1, 1.0) / k * np.sin(2 * np.pi * (k * base * time + random.random()))
    rest = coloured(random, count, 5.0)
    return np.asarray(tone + rest / rest.std() * random.uniform(0.3, 1.5), np.float32)


def knocks(random: np.random.Generator, count: int) -> F32:
    """Keys, cups, footsteps: short bursts that ring."""
    out = np.zeros(count + RATE, np.float32)
    for at in np.cumsum(random.exponential(random.uniform(0.1, 0.6), 2 + count * 10 // RATE) * RATE).astype(int):
        if at >= count:
            break
        size = int(random.uniform(0.005, 0.12) * RATE)
        time = np.arange(size) / RATE
        ring = np.sin(2 * np.pi * random.uniform(150, 4500) * time) + random.standard_normal(size)
        out[at : at + size] += random.uniform(0.2, 1.0) * ring * np.exp(-5.0 * np.arange(size) / size)
    return out[:count] + 0.01 * coloured(random, count, 3.0)


def babble(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """Several people talking at once."""
    out = np.zeros(count, np.float32)
    for _ in range(random.integers(3, 9)):
        at = -int(random.uniform(0, 2) * RATE)
        gain = random.uniform(0.4, 1.0)
        while at < count:
            voice = speech[random.integers(len(speech))]
            voice = voice / (voice.std() + 1e-6)
            a, b = max(at, 0), min(at + len(voice), count)
            if b > a:
                out[a:b] += gain * voice[a - at : b - at]
            at += len(voice)
    return out


def noise(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """One of the kinds above, at a level of its own."""
    kind = random.random()
    if kind < 0.45:
        return coloured(random, count, float(random.uniform(0.0, 6.0)))
    if kind < 0.6:
        return hum(random, count)
    if kind < 0.72:
        return knocks(random, count)
    return babble(random, count, speech)


def level(sound: F32) -> float:
    """Root mean square where something is said: over frames within 25 dB of the loudest twentieth."""
    frames = np.sqrt(np.add.reduceat(sound**2, np.arange(0, len(sound), 320)) / 320.0)
    loud = frames[frames > np.quantile(frames, 0.95) * 0.056]
    return float(np.sqrt((loud**2).mean())) if len(loud) else 1e-9


def with_noise(sound: F32, other: F32, snr_db: float) -> F32:
    """`other` is brought `snr_db` under the level of what is said."""
    return sound + other * np.float32(level(sound) * 10.0 ** (-snr_db / 20.0) / (np.sqrt(float((other**2).mean())) + 1e-12))


def tilt(random: np.random.Generator, hz: NDArray[np.float64], strength_db: float) -> NDArray[np.float64]:
    """Another microphone and another throat: gains that change smoothly with frequency."""
    knots = np.linspace(np.log2(60.0), 13.0, 8)
    gains = random.normal(0.0, strength_db, 8) + random.normal(0.0, strength_db / 2.0) * np.linspace(-1, 1, 8)
    return 10.0 ** (np.interp(np.log2(np.maximum(hz, 60.0)), knots, gains) / 20.0)


class Noises:
    """Stretches of other sounds, made once and cut from at random. speech: what the babble is made of."""

    _LENGTH, _COUNT = 30 * RATE, 60

    def __init__(self, random: np.random.Generator, speech: Sequence[F32]) -> None:
        self._quiet = [coloured(random, self._LENGTH, 2.0) for _ in range(4)]
        self._loud = [noise(random, self._LENGTH, speech) for _ in range(self._COUNT)]

    def loud(self, random: np.random.Generator, count: int) -> F32:
        return self._cut(random, self._loud, count)

    def quiet(self, random: np.random.Generator, count: int) -> F32:
        return self._cut(random, self._quiet, count)

    @staticmethod
    def _cut(random: np.random.Generator, some: list[F32], count: int) -> F32:
        whole = some[random.integers(len(some))]
        start = random.integers(len(whole))
        return np.resize(np.roll(whole, -start), count)


def heard_at(random: np.random.Generator, sound: F32, noises: Noises) -> F32:
    """The sound as some microphone in some room takes it up; what is said stays at its time."""
    size = 1 << (len(sound) + RATE - 1).bit_length()
    hz = np.fft.rfftfreq(size, 1.0 / RATE)
    spectrum = np.fft.rfft(sound, size)
    if random.random() < 0.8:
        spectrum *= tilt(random, hz, 4.0).astype(np.float32)
    if random.random() < 0.5:
        spectrum *= np.fft.rfft(impulse_response(random, random.uniform(0.12, 0.7), random.uniform(-4.0, 12.0)), size)
    sound = np.fft.irfft(spectrum, size)[: len(sound)].astype(np.float32)
    if random.random() < 0.85:
        sound = with_noise(sound, noises.loud(random, len(sound)), 1.0 + 32.0 * random.random() ** 1.6)
    sound = with_noise(sound, noises.quiet(random, len(sound)), random.uniform(35.0, 60.0))
    if random.random() < 0.1:
        fall = (1.0 / (1.0 + (hz / random.uniform(3400.0, 7000.0)) ** 16)).astype(np.float32)
        sound = np.fft.irfft(np.fft.rfft(sound, size) * fall, size)[: len(sound)].astype(np.float32)
    gain = 10.0 ** (random.uniform(-40.0, -14.0) / 20.0) / level(sound)
    if random.random() < 0.06:
        gain *= random.uniform(3.0, 12.0)
    return (np.rint(np.clip(sound * gain, -1.0, 1.0) * 32767.0) / 32768.0).astype(np.float32)
