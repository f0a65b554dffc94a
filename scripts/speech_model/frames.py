"""From clean speech to what the net is trained on: normalised frames and the state each belongs to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scripts.speech_model.rooms import Noises, heard_at
from scripts.speech_model.voices import RATE, Spoken, resampled
from vistel.speech.acoustic import state_of
from vistel.speech.features import HOP, WINDOW, LogMel, Normaliser
from vistel.speech.phones import PHONES

F32 = NDArray[np.float32]
I16 = NDArray[np.int16]


@dataclass(frozen=True)
class Session:
    """One voice in one place: frames (n, BANDS) normalised as at run time; states (n,), -1 where unknown."""

    frames: NDArray[np.float16]
    states: I16


def states_of(spoken: Spoken, start: int, count: int) -> I16:
    """States of the frames whose middle lies in the utterance that begins at sample `start`; pause elsewhere."""
    assert spoken.ends_s is not None
    middles = (np.arange(count) * HOP + WINDOW / 2 - start) / RATE
    index = np.searchsorted(spoken.ends_s, middles, side="right")
    inside = (middles >= 0) & (index < len(spoken.phones))
    index = np.minimum(index, len(spoken.phones) - 1)
    begins = np.concatenate([[0.0], spoken.ends_s[:-1]])
    late = middles >= 0.5 * (begins + spoken.ends_s)[index]
    halves = np.array([[state_of(PHONES.index(phone), part) for part in (0.0, 0.5)] for phone in spoken.phones])
    return np.where(inside, halves[index, late.astype(int)], 0).astype(np.int16)


def stretched(spoken: Spoken, step: float) -> Spoken:
    """A shorter throat that also speaks faster and higher, where step is above 1."""
    ends = None if spoken.ends_s is None else spoken.ends_s / step
    return replace(spoken, sound=resampled(spoken.sound, step), ends_s=ends)


def session(random: np.random.Generator, said: list[Spoken], noises: Noises, start_mean: F32) -> Session:
    """Some utterances of one voice one after the other, in a place drawn at random."""
    step = float(random.uniform(0.87, 1.15))
    said = [stretched(each, step) for each in said]
    gaps = [int(random.uniform(0.1, 0.9) * RATE) for _ in range(len(said) + 1)]
    starts: list[int] = []
    at = gaps[0]
    for each, gap in zip(said, gaps[1:], strict=True):
        starts.append(at)
        at += len(each.sound) + gap
    sound = np.zeros(at, np.float32)
    for each, start in zip(said, starts, strict=True):
        sound[start : start + len(each.sound)] += each.sound * np.float32(10.0 ** (random.uniform(-4, 4) / 20.0))
    raw = LogMel().feed(heard_at(random, sound, noises))
    states = np.zeros(len(raw), np.int16)
    for each, start in zip(said, starts, strict=True):
        states = np.maximum(states, states_of(each, start, len(raw)))
    return Session(Normaliser(start_mean).feed(raw).astype(np.float16), states)
