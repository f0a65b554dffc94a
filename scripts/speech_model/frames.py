"""From clean speech to what the net is trained on: normalised frames and the state each belongs to."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scripts.speech_model.rooms import Noises, heard_at, level
from scripts.speech_model.voices import RATE, Spoken, resampled
from vistel.arrays import F32, I16
from vistel.speech.acoustic import state_of
from vistel.speech.features import HOP, WINDOW, LogMel, Normaliser


@dataclass(frozen=True)
class Session:
    """One voice in one place: frames (n, BANDS) normalised as at run time; states (n,), -1 where unknown."""

    frames: NDArray[np.float16]
    states: I16


def states_of(spoken: Spoken, start: int, count: int, phones: Sequence[str]) -> I16:
    """States of the frames whose middle lies in the utterance that begins at sample `start`; pause elsewhere."""
    assert spoken.ends_s is not None
    middles = (np.arange(count) * HOP + WINDOW / 2 - start) / RATE
    index = np.searchsorted(spoken.ends_s, middles, side="right")
    inside = (middles >= 0) & (index < len(spoken.phones))
    index = np.minimum(index, len(spoken.phones) - 1)
    begins = np.concatenate([[0.0], spoken.ends_s[:-1]])
    late = middles >= 0.5 * (begins + spoken.ends_s)[index]
    halves = np.array([[state_of(phones.index(phone), part) for part in (0.0, 0.5)] for phone in spoken.phones])
    return np.where(inside, halves[index, late.astype(int)], 0).astype(np.int16)


def stretched(spoken: Spoken, step: float) -> Spoken:
    """A shorter throat that also speaks faster and higher, where step is above 1."""
    ends = None if spoken.ends_s is None else spoken.ends_s / step
    return replace(spoken, sound=resampled(spoken.sound, step), ends_s=ends)


def session(
    random: np.random.Generator,
    said: list[Spoken],
    noises: Noises,
    start_mean: F32,
    phones: Sequence[str],
    *,
    throats: bool = False,
) -> Session:
    """Some utterances one after the other, in a place drawn at random, sometimes with a sudden sound between them.

    phones: all of the language; throats: whether the mel bands are warped too, for a throat whose pitch and speed are another's.
    """
    step = float(random.uniform(0.85, 1.18))
    said = [stretched(each, step) for each in said]
    gaps = [int(random.uniform(0.1, 0.9) * RATE) for _ in range(len(said) + 1)]
    burst = random.integers(len(gaps)) if random.random() < _SUDDEN else -1
    if burst >= 0:
        gaps[burst] += int(random.uniform(0.4, 2.0) * RATE)
    starts: list[int] = []
    at = gaps[0]
    for each, gap in zip(said, gaps[1:], strict=True):
        starts.append(at)
        at += len(each.sound) + gap
    sound = np.zeros(at, np.float32)
    for each, start in zip(said, starts, strict=True):
        sound[start : start + len(each.sound)] += each.sound * np.float32(10.0 ** (random.uniform(-4, 4) / 20.0))
    if burst >= 0:
        begin = 0 if burst == 0 else starts[burst - 1] + len(said[burst - 1].sound)
        _sudden(random, sound[begin : begin + gaps[burst]], noises, level(sound))
    raw = LogMel().feed(heard_at(random, sound, noises))
    if throats:
        raw = warped(raw, float(random.uniform(0.9, 1.1)))
    states = np.zeros(len(raw), np.int16)
    for each, start in zip(said, starts, strict=True):
        states = np.maximum(states, states_of(each, start, len(raw), phones))
    return Session(_normaliser(random, start_mean).feed(raw).astype(np.float16), states)


def warped(frames: F32, factor: float) -> F32:
    """(n, BANDS) with what was in band b * factor in band b: above 1 a longer throat."""
    at = np.clip(np.arange(frames.shape[1]) * factor, 0, frames.shape[1] - 1)
    low = np.minimum(at.astype(int), frames.shape[1] - 2)
    part = (at - low).astype(np.float32)
    return frames[:, low] * (1.0 - part) + frames[:, low + 1] * part


_SUDDEN = 0.3
"""Share of the sessions in which something begins to sound out of the quiet."""


def _sudden(random: np.random.Generator, gap: F32, noises: Noises, usual: float) -> None:
    """Adds to the gap, in place, a sound that begins and ends at once and is as loud as speech."""
    size = int(random.uniform(0.3, 1.0) * len(gap))
    begin = random.integers(len(gap) - size + 1)
    sound = noises.loud(random, size)
    gain = usual * 10.0 ** (random.uniform(-12.0, 6.0) / 20.0) / (float(sound.std()) + 1e-9)
    edge = max(1, min(size // 4, int(random.uniform(0.001, 0.05) * RATE)))
    shape = np.minimum(1.0, np.minimum(np.arange(size), np.arange(size)[::-1]) / edge)
    gap[begin : begin + size] += (sound * gain * shape).astype(np.float32)


def _normaliser(random: np.random.Generator, start_mean: F32) -> Normaliser:
    """As it is at some time in a conference: what was heard before was often another voice in the same place, or nothing."""
    if random.random() < 0.4:
        return Normaliser(start_mean)
    knots = np.linspace(0, len(start_mean) - 1, 6)
    other = np.interp(np.arange(len(start_mean)), knots, random.normal(0.0, 0.6, 6)) + random.normal(0.0, 0.8)
    return Normaliser(start_mean + other.astype(np.float32), float(random.uniform(0.0, 600.0)))
