"""Three sets of speech, disjoint by voice, sentence, room and noise: models and settings are made on `tune`, chosen by `choose`,
reported on `report`.

`tune` and `choose` may be looked at as often as one likes; `report` is scored by `benchmarks.hearing.report`, once for a commit,
and every score is kept. Noise and rooms of `tune` are drawn by the trainer's own recipes, those of the others by `places`.
"""

import random as stdrandom
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.hearing import places
from benchmarks.voices.speech_sounds import CONDITIONS, SpokenCommand, commands
from scripts.speech_model import rooms, texts, voices
from scripts.speech_model.corpus import seeded
from scripts.speech_model.japanese import ESPEAK_TEST, reading_of
from scripts.speech_model.texts import Talk
from scripts.speech_model.voices import RATE
from vistel.arrays import F32
from vistel.speech.grammar import Grammar, Language
from vistel.speech.synthesis import voices as installed

_SENTENCES = tomllib.loads(Path(__file__).with_name("sentences.toml").read_text("utf-8"))


def _talk(name: str) -> Talk:
    return Talk(_SENTENCES["talk"][name], " ")


Noise = Callable[[np.random.Generator, int, Sequence[F32]], F32]
Room = Callable[[np.random.Generator], F32]
CASES = CONDITIONS


@dataclass(frozen=True)
class HearingSet:
    """name, seed; voices and talk by language ("flite slt", "espeak en-us+m8"; of Japanese, as `scripts.speech_model.voices` names
    them); sentences: what English people say; noises, room: where."""

    name: str
    seed: int
    voices: dict[Language, tuple[str, ...]]
    sentences: tuple[str, ...]
    talk: dict[Language, Talk]
    noises: tuple[Noise, ...]
    room: Room

    def commands(self, grammar: Grammar, language: Language, count: int) -> list[SpokenCommand]:
        """So many, by all voices in turn; half of the English are sentences that people say, the others drawn from the grammar."""
        if language == "ja":
            return list(commands(grammar, count, self.voices["ja"], self.seed))
        draw = stdrandom.Random(self.seed)
        drawn = [grammar.pick("en", draw) for _ in range(count)]
        usual = [grammar.read(text) for text in self.sentences]
        made: list[SpokenCommand] = []
        for k in range(count):
            said = (usual[k // 2 % len(usual)] if k % 2 else None) or drawn[k]
            # One that people say and one that was drawn by each voice in turn.
            voice = self.voices["en"][k // 2 % len(self.voices["en"])]
            sound = english(said.spoken, voice, seeded(self.seed, "manner", k))
            made.append(SpokenCommand(said, voice, sound, speech_end(sound)))
        return made

    def other_talk(self, language: Language, seconds: float) -> F32:
        """Everyday sentences one after the other with short rests."""
        random = seeded(self.seed, "talk")
        parts: list[F32] = []
        while sum(map(len, parts)) < seconds * RATE:
            text, voice = self.talk[language].sentence(random), self.voices[language][len(parts) % len(self.voices[language])]
            sound = english(text, voice, random) if language == "en" else _japanese(text, voice, random)
            rest = np.zeros(int(random.uniform(0.1, 0.9) * RATE), np.float32)
            parts.append(np.concatenate([sound * np.float32(0.05 / rooms.level(sound)), rest]))
        return np.concatenate(parts)

    def place(self, condition: str, speech: Sequence[F32]) -> "Place":
        return Place(self, condition, speech)


class Place:
    """Puts speech into a condition of CASES, at a usual level, with quiet before and after."""

    def __init__(self, some: HearingSet, condition: str, speech: Sequence[F32]) -> None:
        self._set, self._condition, self._speech = some, condition, speech
        self._random = seeded(some.seed, condition)
        self._turn = 0

    def heard(self, sound: F32, before_s: float = 0.7, after_s: float = 0.9) -> F32:
        """(n,) -> (m,) 16 kHz; each call draws another noise or room."""
        gain = np.float32(0.05 / rooms.level(sound))
        quiet = np.zeros(int(before_s * RATE), np.float32), np.zeros(int(after_s * RATE), np.float32)
        whole = np.concatenate([quiet[0], sound * gain, quiet[1]])
        self._turn += 1
        if self._condition.endswith("dB"):
            noise = self._set.noises[self._turn % len(self._set.noises)]
            other = noise(self._random, len(whole), self._speech)
            whole = rooms.with_noise(whole, other, float(self._condition.split()[0]))
        elif self._condition == "reverberant":
            response = self._set.room(self._random)
            size = 1 << (len(whole) + len(response)).bit_length()
            whole = np.fft.irfft(np.fft.rfft(whole, size) * np.fft.rfft(response, size), size)[: len(whole)].astype(np.float32)
        hiss = rooms.coloured(self._random, len(whole), 2.0)
        return np.clip(rooms.with_noise(whole, hiss, 45.0), -1.0, 1.0).astype(np.float32)


@cache
def tune() -> HearingSet:
    """The voices, noises and rooms that nets are trained with."""
    return HearingSet(
        "tune",
        11,
        {"en": ("flite rms", "espeak en-us+m3", "flite kal16", "espeak en-gb+f2"), "ja": ("m3", "f4", "Mario", "Andy")},
        tuple(_SENTENCES["commands"]["tune"]),
        {"en": _talk("tune"), "ja": texts.TRAIN},
        (rooms.noise,),
        lambda random: rooms.impulse_response(random, random.uniform(0.3, 0.6), random.uniform(-2.0, 6.0)),
    )


@cache
def choose() -> HearingSet:
    """Voices that nothing is trained with; offices."""
    return HearingSet(
        "choose",
        22,
        {"en": ("flite awb", "espeak en-us+linda", "flite awb", "espeak en-gb+m7"), "ja": ESPEAK_TEST},
        tuple(_SENTENCES["commands"]["choose"]),
        {"en": _talk("choose"), "ja": texts.TRAIN},
        (places.ventilator, places.typing, places.two_talkers),
        lambda random: places.shoebox(random, np.array([2.5, 2.5, 2.2]), np.array([4.0, 5.0, 2.8])),
    )


@cache
def report() -> HearingSet:
    """Voices, sentences, noises and larger rooms that nothing was chosen by."""
    moods = tuple(f"mei_{mood}" for mood in ("normal", "happy", "angry", "sad", "bashful"))
    return HearingSet(
        "report",
        33,
        {"en": ("flite slt", "espeak en-us+shelby", "flite slt", "espeak en-gb+m8"), "ja": moods},
        tuple(_SENTENCES["commands"]["report"]),
        {"en": _talk("report"), "ja": texts.TEST},
        (places.music, places.traffic, places.crowd),
        lambda random: places.shoebox(random, np.array([4.0, 4.5, 2.5]), np.array([8.0, 9.0, 3.5])),
    )


def english(text: str, voice: str, random: np.random.Generator) -> F32:
    """English speech, a little faster or slower, higher or lower, from sentence to sentence."""
    program, _, name = voice.partition(" ")
    if program == "flite":
        return voices.flite(text, name, float(random.uniform(0.85, 1.15)))
    return voices.espeak(text, name, int(random.integers(130, 180)), int(random.integers(35, 65)))


def _japanese(text: str, voice: str, random: np.random.Generator) -> F32:
    if voice in voices.hts_voices():
        manner = voices.Manner(float(random.uniform(0.85, 1.2)), float(random.uniform(-2, 2)))
        return voices.open_jtalk(text, voices.hts_voices()[voice], manner).sound
    _, kana = reading_of(text)
    return voices.espeak(kana, f"ja+{voice}", int(random.integers(120, 175)), int(random.integers(30, 70)))


def speech_end(sound: F32) -> float:
    """When the last sound ends [s]."""
    frames = np.sqrt(np.add.reduceat(sound**2, np.arange(0, len(sound), 160)) / 160)
    return (int(np.flatnonzero(frames > 0.03 * frames.max())[-1]) + 1) * 0.01


def lacking(some: HearingSet, language: Language) -> str | None:
    """Why a set cannot be spoken here, in one line; None where it can."""
    if language == "en":
        absent = [name for name in ("flite", "espeak-ng") if name not in installed()]
        return f"{absent[0]} is not installed (apt-get install {absent[0]})" if absent else None
    if (reason := voices.missing()) is not None:
        return reason
    absent = [name for name in some.voices["ja"] if name.startswith("mei") and name not in voices.hts_voices()]
    return f"voices not found: {', '.join(absent)}; name their folder in VISTEL_VOICES" if absent else None
