"""What enrolment gives a voice that is far from all that was trained on."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.hearing.sets import english, speech_end
from benchmarks.progress import skipped
from benchmarks.row import Row
from benchmarks.voices.speech_score import CommandScore, score
from benchmarks.voices.speech_sounds import NoisyRoom, SpokenCommand, commands, held_out
from scripts.speech_model.voices import Manner, missing, resampled
from vistel.speech.acoustic import packaged
from vistel.speech.enrolment import Voice, adapt, save
from vistel.speech.grammar import Grammar, Language
from vistel.speech.hybrid import ACCEPT
from vistel.speech.recognisers import NAMES, checked_grammar, recogniser, text_phones
from vistel.speech.recognition import Hypotheses, Recogniser
from vistel.speech.synthesis import voices

JAPANESE: Language = "ja"
ENGLISH: Language = "en"
_ENGLISH_VOICE = "flite awb"
"""Nothing is trained with it."""
COUNT, ENROLMENT_S = 50, 150.0
_FAR_STEP = 1.25
"""A throat a fifth shorter than that of the voice, with which nothing is trained: a child, far from all others."""


def rows() -> Iterator[Row]:
    grammar, _ = checked_grammar()
    lacking: dict[Language, str | None] = {JAPANESE: _no_japanese(), ENGLISH: _no_english()}
    for language, lacks in lacking.items():
        if lacks:
            skipped(f"speech, enrolment of a voice in {NAMES[language]}", lacks)
        else:
            yield from _enrolled(grammar, language)


def _no_japanese() -> str | None:
    """Why nobody speaks it here; None: somebody does."""
    return missing() or (None if held_out() else "none of the held-out voices (mei) is here; pip install pyopenjtalk-plus")


def _no_english() -> str | None:
    return None if "flite:awb" in voices() else "flite is not installed"


def _enrolled(grammar: Grammar, language: Language) -> Iterator[Row]:
    """A voice far from all others, before and after it read sentences of its own."""
    read, commands = (_spoken(grammar, language, count, seed) for count, seed in ((int(ENROLMENT_S / 2.5), 21), (COUNT, 22)))
    room = NoisyRoom("20 dB", [each.sound for each in read])
    model = packaged(NAMES[language].lower())
    learnt = adapt(model, [(room.heard(each.sound, 0.3, 0.3), text_phones(language, each.sentence.spoken)) for each in read])
    case = f"{NAMES[language]}, {COUNT} commands, a voice far from the training, 20 dB"
    with TemporaryDirectory() as folder:
        voice = Path(folder) / "voice.npz"
        save(Voice(language, learnt), voice)
        for what, file in (("before enrolment", None), (f"after {ENROLMENT_S:.0f} s of it", voice)):
            found = _scored(grammar, recogniser(language, grammar, file), commands, NoisyRoom("20 dB", [c.sound for c in commands]))
            yield Row("speech", f"{case}, {what}", "understood", "%", 100.0 * found.right)


def _spoken(grammar: Grammar, language: Language, count: int, seed: int) -> list[SpokenCommand]:
    if language == JAPANESE:
        far = Manner(rate=1.0 / _FAR_STEP, semitones=1.0)
        return [_shorter(each) for each in commands(grammar, count, held_out()[:1], seed=seed, manner=far)]
    draw, manner = Random(seed), np.random.default_rng(seed)
    drawn = [grammar.pick(language, draw) for _ in range(count)]
    sounds = [english(each.spoken, _ENGLISH_VOICE, manner) for each in drawn]
    return [_shorter(SpokenCommand(each, _ENGLISH_VOICE, x, speech_end(x))) for each, x in zip(drawn, sounds, strict=True)]


def _scored(grammar: Grammar, hears: Recogniser, commands: list[SpokenCommand], place: NoisyRoom) -> CommandScore:
    def understood(index: int, heard: Hypotheses) -> bool:
        wanted = commands[index].sentence
        sentence = grammar.sentence(heard[0].words, wanted.language)
        return sentence is not None and sentence.means == wanted.means

    heard = ((place.heard(each.sound, 0.7), 0.7 + each.end_s) for each in commands)
    return score(hears, heard, understood, ACCEPT)


def _shorter(command: SpokenCommand) -> SpokenCommand:
    return replace(command, sound=resampled(command.sound, _FAR_STEP), end_s=command.end_s / _FAR_STEP)
