"""English commands: pocketsphinx over the room's grammar, scored on synthesised and on human speech."""

from __future__ import annotations

import random as stdrandom
from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmarks.row import Row, machine
from benchmarks.speech_score import false_accepts, score, share_of_core
from benchmarks.speech_sounds import Place
from vistel.speech.features import Resampler
from vistel.speech.grammar import Grammar, Said
from vistel.speech.heard import SAMPLE_RATE, Hypotheses
from vistel.speech.meaning import asked_for
from vistel.speech.recognisers import checked_grammar, recogniser
from vistel.speech.synthesis import synthesise, voices

F32 = NDArray[np.float32]

VOICES = ("rms", "slt", "awb", "kal16")
"""Of flite; the first three are of recorded people (CMU Arctic). None was used to fit confidence; beams and the noise filter
were chosen with some of their sentences in view."""
TARGETS = {"clean": 0.97, "20 dB": 0.95, "10 dB": 0.85}
BELIEVED = 0.5
COUNT, TALK_S = 40, 300.0
TALK = (
    "What time does the train leave tomorrow morning", "We should have lunch before the meeting starts",
    "Did anybody see the game last night", "My sister is coming to visit us next week", "The weather is really lovely today",
    "Could you send me that report by Friday", "I am not sure that is what they meant", "We had a good time at the beach",
    "Tell me when you are ready to go", "She said the results were better than expected",
    "There is a new restaurant around the corner", "I still have to buy some milk on the way home",
    "How many people are coming to the party", "He has been working on it for several months",
    "The price of oil went up again yesterday", "They moved to a bigger house last summer", "It rained so hard that we stayed in",
    "Our flight was delayed for almost three hours", "The doctor told him to get more rest",
    "Nobody knew what had happened to the keys", "The museum is closed on Mondays", "I would rather stay at home tonight",
    "They are building a new bridge over the river", "The students asked a lot of good questions",
)  # fmt: skip


@cache
def _spoken(text: str, voice: str) -> F32:
    pcm, rate = synthesise(text, voice)
    return Resampler(rate).feed(np.concatenate([pcm, np.zeros(64, np.float32)]))


def _end_s(sound: F32) -> float:
    frames = np.sqrt(np.add.reduceat(sound**2, np.arange(0, len(sound), 160)) / 160)
    return (int(np.flatnonzero(frames > 0.03 * frames.max())[-1]) + 1) * 0.01


def _commands(grammar: Grammar, count: int) -> Iterator[tuple[Said, F32]]:
    draw = stdrandom.Random(11)
    names = [v for v in VOICES if f"flite:{v}" in voices()]
    for k in range(count):
        said = grammar.pick("en", draw)
        yield said, _spoken(said.spoken, f"flite:{names[k % len(names)]}")


def _talk(seconds: float) -> F32:
    names = [v for v in VOICES if f"flite:{v}" in voices()]
    parts: list[F32] = []
    k = 0
    while sum(map(len, parts)) < seconds * SAMPLE_RATE:
        sound = _spoken(TALK[k % len(TALK)], f"flite:{names[(k + k // len(TALK)) % len(names)]}")
        parts += [sound * np.float32(0.05 / np.sqrt(np.mean(sound**2))), np.zeros(int(0.5 * SAMPLE_RATE), np.float32)]
        k += 1
    return np.concatenate(parts)


def rows(count: int = COUNT, talk_s: float = TALK_S) -> Iterator[Row]:
    """Figures as they come; none where flite or pocketsphinx is missing."""
    if "flite" not in voices():
        return
    grammar, _ = checked_grammar()
    hears = recogniser("en", grammar)
    spoken = list(_commands(grammar, count))
    late: list[float] = []
    for condition, target in TARGETS.items():
        place = Place(condition, [sound for _, sound in spoken])
        heard = [(place.heard(sound), 0.7 + _end_s(sound)) for _, sound in spoken]

        def understood(index: int, found: Hypotheses) -> bool:
            said = grammar.said(found[0].words, "en") if found[0].words else None
            return said is not None and asked_for(said.means) == asked_for(spoken[index][0].means)

        result = score(hears, heard, understood, BELIEVED)
        late += result.late_s[np.isfinite(result.late_s)].tolist()
        yield _row(f"English, {condition}", "commands right", "share", result.right, f">= {target}", result.right >= target)
        yield _row(f"English, {condition}", "right and accepted", "share", result.accepted, ">= 0.9", result.accepted >= 0.9)
    after_s = float(np.percentile(late, 95)) if late else float("nan")
    yield _row("English", "end of speech to command, p95", "s", after_s, "<= 0.3", after_s <= 0.3)
    talk = Place("clean", [sound for _, sound in spoken]).heard(_talk(talk_s))
    wrong = len(false_accepts(hears, talk, BELIEVED)) * 600.0 * SAMPLE_RATE / len(talk)
    yield _row("English, other talk", "false accepts in 10 minutes", "", wrong, "<= 1", wrong <= 1.0)
    hiss = (1e-3 * np.random.default_rng(4).standard_normal(20 * SAMPLE_RATE)).astype(np.float32)
    share = share_of_core(hears, hiss)
    yield _row("English, idle", "processor", "of a core", share, "<= 0.25", share <= 0.25)


def _row(case: str, metric: str, unit: str, value: float, target: str, met: bool) -> Row:
    return Row("speech", case, metric, unit, value, None, None, None, target, met, machine())
