"""Noises and rooms of the sets `choose` and `report`; those of `tune` are the trainer's own (`scripts.speech_model.rooms`).

Each set has recipes of its own, so that what a net learnt about one kind of noise does not pass for robustness.
"""

from collections.abc import Sequence

import numpy as np

from scripts.speech_model.rooms import coloured
from scripts.speech_model.voices import RATE
from vistel.arrays import F32, F64

_SOUND_M_S = 343.0
_IMAGES = 7
"""Reflections in each direction of each axis."""


def ventilator(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """Air, chopped by blades."""
    time = np.arange(count) / RATE
    blades = 1.0 + 0.6 * np.sin(2.0 * np.pi * (random.uniform(15.0, 60.0) * time + random.random()))
    return np.asarray(coloured(random, count, random.uniform(2.0, 5.0)) * blades, np.float32)


def typing(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """Keys: two clicks each, in bursts."""
    out = np.asarray(0.02 * coloured(random, count, 3.0))
    at = 0.0
    while at < count:
        for delay in (0.0, random.uniform(0.05, 0.09)):
            begin, size = int(at + delay * RATE), int(random.uniform(0.004, 0.015) * RATE)
            if begin + size < count:
                out[begin : begin + size] += random.uniform(0.3, 1.0) * random.standard_normal(size) * np.hanning(size)
        at += RATE * (random.uniform(0.08, 0.25) if random.random() < 0.9 else random.uniform(0.4, 1.5))
    return np.asarray(out, np.float32)


def two_talkers(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """Two people who talk at once, without end."""
    return _talkers(random, count, speech, 2)


def music(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """Struck chords that fade, and a bass."""
    out = np.zeros(count + 4 * RATE)
    for at in np.arange(0, count, int(random.uniform(0.25, 0.6) * RATE)).tolist():
        root = 110.0 * 2.0 ** (random.integers(0, 24) / 12.0)
        time = np.arange(int(random.uniform(0.4, 2.0) * RATE)) / RATE
        for step in (0, random.choice([3, 4]), 7, -12):
            for harmonic in range(1, 6):
                tone = np.sin(2.0 * np.pi * root * 2.0 ** (step / 12.0) * harmonic * time + random.uniform(0.0, 6.28))
                out[at : at + len(time)] += random.uniform(0.2, 1.0) / harmonic**1.5 * tone * np.exp(-3.0 * time / time[-1])
    return np.asarray(out[:count], np.float32)


def traffic(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """Cars that come and go on a wet road."""
    out = np.zeros(count)
    time = np.arange(count) / RATE
    for _ in range(2 + count // (3 * RATE)):
        middle, length = random.uniform(0.0, time[-1]), random.uniform(0.8, 2.5)
        swell = np.exp(-(((time - middle) / length) ** 2))
        out += random.uniform(0.4, 1.0) * swell * coloured(random, count, random.uniform(1.5, 5.5))
    return np.asarray(out + 0.1 * coloured(random, count, 4.0), np.float32)


def crowd(random: np.random.Generator, count: int, speech: Sequence[F32]) -> F32:
    """Six people who talk at once."""
    return _talkers(random, count, speech, 6)


def _talkers(random: np.random.Generator, count: int, speech: Sequence[F32], people: int) -> F32:
    out = np.zeros(count, np.float32)
    for _ in range(people):
        at = -int(random.uniform(0.0, 2.0) * RATE)
        while at < count:
            voice = speech[random.integers(len(speech))]
            first, last = max(at, 0), min(at + len(voice), count)
            if last > first:
                out[first:last] += voice[first - at : last - at] / (voice.std() + 1e-6)
            at += len(voice)
    return out


def shoebox(random: np.random.Generator, least_m: F64, most_m: F64) -> F32:
    """Impulse response of a room with plain walls, by its image sources (Allen and Berkley 1979); the direct sound comes first.

    least_m, most_m: (3,) between these its sides are drawn. Walls absorb 15 to 45 % of the energy; speaker and microphone are
    anywhere, 0.3 m or more from the walls and 0.5 m or more from each other.
    """
    sides = random.uniform(least_m, most_m)
    bounce = np.sqrt(1.0 - random.uniform(0.15, 0.45))
    while True:
        mouth, ear = random.uniform(0.3, sides - 0.3), random.uniform(0.3, sides - 0.3)
        if np.linalg.norm(mouth - ear) >= 0.5:
            break
    number = np.arange(-_IMAGES, _IMAGES + 1)
    places, hits = [], []
    for axis in range(3):
        places.append(np.concatenate([2 * number * sides[axis] + mouth[axis], 2 * number * sides[axis] - mouth[axis]]) - ear[axis])
        hits.append(np.concatenate([2 * np.abs(number), np.abs(number) + np.abs(number - 1)]))
    far = np.sqrt(sum(p**2 for p in np.meshgrid(*places, indexing="ij", sparse=True)))
    gain = bounce ** sum(np.meshgrid(*hits, indexing="ij", sparse=True)) / far
    late = np.rint((far - far.min()) / _SOUND_M_S * RATE).astype(int)
    response = np.bincount(late.ravel(), gain.ravel())[: int(0.6 * RATE)]
    return np.asarray(response / np.sqrt((response**2).sum()), np.float32)
