"""English commands: pocketsphinx over the room's grammar, scored on synthesised speech."""

import random as stdrandom
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.progress import skipped
from benchmarks.row import Row, Target, at_least, at_most
from benchmarks.voices.speech_score import false_accepts, score, share_of_core
from benchmarks.voices.speech_sounds import NoisyRoom
from vistel.arrays import F32
from vistel.speech.features import Resampler
from vistel.speech.grammar import Grammar, Said
from vistel.speech.meaning import asked_for
from vistel.speech.recognisers import RecogniserError, checked_grammar, recogniser
from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Recogniser
from vistel.speech.synthesis import synthesise, voices

_SENTENCES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
TEST: list[str] = _SENTENCES["test"]
VOICES = ("rms", "slt", "awb", "kal16")
"""Of flite; the first three are of recorded people (CMU Arctic). Settings and confidence were chosen with others: festival's ked,
espeak-ng."""
TARGETS = {"clean": at_least(0.97), "20 dB": at_least(0.95), "10 dB": at_least(0.85)}
BELIEVED = 0.5
COUNT, TALK_S = len(TEST), 600.0
_SEED = 29
TALK: list[str] = _SENTENCES["talk"]


@cache
def _spoken(text: str, voice: str) -> F32:
    pcm, rate = synthesise(text, voice)
    return Resampler(rate).feed(np.concatenate([pcm, np.zeros(64, np.float32)]))


def _end_s(sound: F32) -> float:
    frames = np.sqrt(np.add.reduceat(sound**2, np.arange(0, len(sound), 160)) / 160)
    return (int(np.flatnonzero(frames > 0.03 * frames.max())[-1]) + 1) * 0.01


def _commands(grammar: Grammar, count: int, *, usual: bool) -> Iterator[tuple[Said, F32]]:
    """usual: what a person would say, instead of what the grammar allows at random."""
    draw = stdrandom.Random(_SEED)
    names = [v for v in VOICES if f"flite:{v}" in voices()]
    for k in range(count):
        said = grammar.read(TEST[k]) if usual else grammar.pick("en", draw)
        if said is not None:
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
    if not any(v.startswith("flite:") for v in voices()):
        skipped("speech, English", "flite is not installed (apt-get install flite)")
        return
    grammar, _ = checked_grammar()
    try:
        hears = recogniser("en", grammar)
    except RecogniserError as e:
        skipped("speech, English", str(e))
        return
    late: list[float] = []
    for condition in TARGETS:
        for usual in (True, False):
            yield from accuracy(grammar, hears, condition, count, late, usual=usual)
    after_s = float(np.percentile(late, 95)) if late else float("nan")
    yield _row("English", "end of speech to command, p95", "s", after_s, at_most(0.3))
    yield from listening(hears, talk_s)


def accuracy(grammar: Grammar, hears: Recogniser, condition: str, count: int, late: list[float], *, usual: bool) -> Iterator[Row]:
    """Of one set of sentences in one condition; late: gets how late each result was [s]."""
    spoken = list(_commands(grammar, count, usual=usual))
    place = NoisyRoom(condition, [sound for _, sound in spoken])
    heard = [(place.heard(sound), 0.7 + _end_s(sound)) for _, sound in spoken]

    def understood(index: int, found: Hypotheses) -> bool:
        said = grammar.said(found[0].words, "en") if found[0].words else None
        return said is not None and asked_for(said.means) == asked_for(spoken[index][0].means)

    result = score(hears, heard, understood, BELIEVED)
    late += result.late_s[np.isfinite(result.late_s)].tolist()
    case = f"English, {condition}, {len(spoken)} {'sentences people say' if usual else 'drawn from the grammar'}"
    yield _row(case, "commands right", "share", result.right, TARGETS[condition])
    yield _row(case, "right and accepted", "share", result.accepted, at_least(0.9))


def listening(hears: Recogniser, talk_s: float) -> Iterator[Row]:
    """What is believed of other talk, and what listening to a quiet room costs."""
    talk = _talk(talk_s)
    heard = NoisyRoom("clean", [talk[: 10 * SAMPLE_RATE]]).heard(talk)
    wrong = len(false_accepts(hears, heard, BELIEVED)) * 600.0 * SAMPLE_RATE / len(talk)
    case = f"English, {talk_s / 60.0:.0f} minutes of other talk"
    yield _row(case, "false accepts in 10 minutes", "", wrong, at_most(1))
    hiss = (1e-3 * np.random.default_rng(4).standard_normal(20 * SAMPLE_RATE)).astype(np.float32)
    share = share_of_core(hears, hiss)
    yield _row("English, idle", "processor", "of a core", share, at_most(0.25))


def _row(case: str, metric: str, unit: str, value: float, target: Target) -> Row:
    return Row("speech", case, metric, unit, value, target=target)
