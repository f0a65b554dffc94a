"""Speech to score a recogniser with: commands and other talk by voices the model was not trained on, in rooms and noise.

Spoken on this machine, where there is a synthesiser.
"""

import random as stdrandom
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from scripts.speech_model import rooms, voices
from scripts.speech_model.corpus import seeded
from scripts.speech_model.texts import TEST, Talk
from scripts.speech_model.voices import RATE, Manner, Spoken
from vistel.arrays import F32
from vistel.speech.grammar import Grammar, Sentence
from vistel.speech.phones import kana_phones

HTS_TEST = ("mei_normal", "mei_happy", "mei_angry", "mei_sad", "mei_bashful")
CONDITIONS = ("clean", "20 dB", "10 dB", "reverberant")


@dataclass(frozen=True)
class SpokenCommand:
    """said: what; sound: at 16 kHz; end_s: where its speech ends [s]."""

    sentence: Sentence
    voice: str
    sound: F32
    end_s: float


def held_out() -> tuple[str, ...]:
    """Held-out voices that are here."""
    return tuple(name for name in HTS_TEST if name in voices.hts_voices())


def commands(
    grammar: Grammar, count: int, names: Sequence[str], seed: int = 1, manner: Manner | None = None
) -> Iterator[SpokenCommand]:
    """Sentences drawn from the grammar, the voices taken in turn; a name that is no Open JTalk voice is espeak-ng's."""
    draw = stdrandom.Random(seed)
    for k in range(count):
        sentence = grammar.pick("ja", draw)
        voice = names[k % len(names)]
        random = seeded(seed, "manner", k)
        spoken = _spoken(sentence.text, sentence.spoken, voice, manner or _usual(random), random)
        yield SpokenCommand(sentence, voice, spoken.sound, _speech_end(spoken))


def _usual(random: np.random.Generator) -> Manner:
    return Manner(float(random.uniform(0.85, 1.2)), float(random.uniform(-2, 2)), float(random.uniform(-0.02, 0.02)), 1.0)


def _spoken(written: str, kana: str, voice: str, manner: Manner, random: np.random.Generator) -> Spoken:
    if voice not in voices.hts_voices():
        sound = voices.espeak(kana, f"ja+{voice}", int(random.integers(120, 175)), int(random.integers(30, 70)))
        return Spoken(sound, (), None)
    path = voices.hts_voices()[voice]
    spoken = voices.open_jtalk(written, path, manner)
    if tuple(p for p in spoken.phones if p != "pau") != kana_phones(kana):
        spoken = voices.open_jtalk(kana, path, manner)
    return spoken


def _speech_end(spoken: Spoken) -> float:
    if spoken.ends_s is not None and len(spoken.ends_s) > 1:
        return float(spoken.ends_s[-2])
    frames = np.sqrt(np.add.reduceat(spoken.sound**2, np.arange(0, len(spoken.sound), 160)) / 160)
    return (int(np.flatnonzero(frames > 0.03 * frames.max())[-1]) + 1) * 0.01


def other_talk(seconds: float, names: Sequence[str], seed: int = 2, talk: Talk = TEST) -> F32:
    """So many seconds of everyday sentences one after the other with short rests, the voices taken in turn."""
    random = seeded(seed, "talk")
    parts: list[F32] = []
    length = 0.0
    while length < seconds:
        text = talk.sentence(random)
        spoken = voices.open_jtalk(text, voices.hts_voices()[names[len(parts) % len(names)]], _usual(random))
        rest = np.zeros(int(random.uniform(0.1, 0.9) * RATE), np.float32)
        parts.append(np.concatenate([spoken.sound * np.float32(0.05 / rooms.level(spoken.sound)), rest]))
        length += len(parts[-1]) / RATE
    return np.concatenate(parts)


class NoisyRoom:
    """Puts speech into a condition of CONDITIONS, at a usual level, with quiet before and after."""

    def __init__(self, condition: str, speech: Sequence[F32], seed: int = 3) -> None:
        self._condition = condition
        self._random = seeded(seed, condition)
        self._noises = rooms.Noises(self._random, speech) if condition.endswith("dB") else None

    def heard(self, sound: F32, before_s: float = 0.7, after_s: float = 0.9) -> F32:
        gain = np.float32(0.05 / rooms.level(sound))
        before, after = np.zeros(int(before_s * RATE), np.float32), np.zeros(int(after_s * RATE), np.float32)
        whole = np.concatenate([before, sound * gain, after])
        if self._noises is not None:
            whole = rooms.with_noise(whole, self._noises.loud(self._random, len(whole)), float(self._condition.split()[0]))
        if self._condition == "reverberant":
            response = rooms.impulse_response(self._random, self._random.uniform(0.3, 0.6), self._random.uniform(-2.0, 6.0))
            size = 1 << (len(whole) + len(response)).bit_length()
            whole = np.fft.irfft(np.fft.rfft(whole, size) * np.fft.rfft(response, size), size)[: len(whole)].astype(np.float32)
        hiss = rooms.coloured(self._random, len(whole), 2.0)
        return np.clip(rooms.with_noise(whole, hiss, 45.0), -1.0, 1.0).astype(np.float32)
