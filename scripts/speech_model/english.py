"""What the English net is made from: two people of flite, two of SVOX Pico, and many variants and accents of espeak-ng.

None of the voices, and none of the sentences, of the sets `choose` and `report` (`benchmarks/hearing/sets.py`).
"""

import importlib.util
import random as stdrandom
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.hearing import sets
from scripts.speech_model.corpus import PACK, Corpus, seeded
from scripts.speech_model.texts import ENGLISH as WORDS
from scripts.speech_model.voices import Spoken, espeak, flite_timed, pico
from vistel.speech.engines.sphinx import PHONES, phrase_phones
from vistel.speech.grammar import Grammar
from vistel.speech.grammar_file import load_grammar

_PACKS = {"rms": 5, "kal16": 3, "pico_us": 4, "pico_gb": 4, "espeak": 8}
"""Packs of each voice."""
_TIMED = ("rms", "kal16")
_ACCENTS, _VARIANTS = WORDS["accents"].split(), WORDS["variants"].split()
"""Of espeak-ng, an accent as often as it is drawn; variants neither of the sets nor of what the confidence is fitted on."""
_WORDS = WORDS["words"].split()
FLITE_NAMES = {"ax": "AH", "pau": "pau", "ssil": "pau"}
_VOWELS = frozenset("AEIOU")


def texts(random: np.random.Generator, grammar: Grammar) -> Iterator[str]:
    """Endless: commands of the room and of people, everyday talk, and words in no order: every sound beside every other."""
    draw = stdrandom.Random(int(random.integers(2**32)))
    known, held = sets.tune(), held_out(grammar)
    while True:
        kind = random.random()
        if kind < 0.3:
            text = grammar.pick("en", draw).spoken
        elif kind < 0.45:
            text = known.sentences[random.integers(len(known.sentences))]
        elif kind < 0.65:
            text = known.talk["en"].sentence(random).lower()
        else:
            text = " ".join(_WORDS[k] for k in random.integers(len(_WORDS), size=random.integers(2, 7)))
        if text not in held:
            yield text


def held_out(grammar: Grammar) -> set[str]:
    """Commands of the other sets, written and drawn."""
    held: set[str] = set()
    for some in (sets.choose(), sets.report()):
        draw = stdrandom.Random(some.seed)
        held |= {*some.sentences, *(grammar.pick("en", draw).spoken for _ in range(_DRAWN))}
    return held


_DRAWN = 100
"""More than the sets draw."""


def reading(text: str) -> tuple[str, ...]:
    """Phones of a text by the dictionary."""
    words = [phrase_phones(word) for word in text.split()]
    phones: list[str] = []
    for word, ways, after in zip(text.split(), words, [*words[1:], []], strict=True):
        vowel = bool(after) and after[0][0][0] in _VOWELS
        phones += ("DH", "IY") if word == "the" and vowel else ways[0]
    return ("pau", *phones, "pau")


def say_pack(voice: str, number: int, seed: int, alike: Path) -> list[Spoken]:
    """A hundred sentences of one voice, each in another manner; in packs "espeak" each by somebody else."""
    random = seeded(seed, "en", voice, number)
    some = texts(random, load_grammar()[0])
    return [_say(voice, next(some), random) for _ in range(PACK)]


def _say(voice: str, text: str, random: np.random.Generator) -> Spoken:
    if voice in _TIMED:
        sound, ends = flite_timed(text, voice, float(random.uniform(0.8, 1.25)))
        phones = tuple(FLITE_NAMES.get(name, name.upper()) for name, _ in ends)
        return Spoken(sound, phones, np.array([end for _, end in ends]))
    if voice.startswith("pico"):
        language = f"en-{voice[-2:].upper()}"
        sound = pico(text, language, float(random.uniform(0.8, 1.3)), float(random.uniform(0.65, 1.3)))
    else:
        accent, variant = _ACCENTS[random.integers(len(_ACCENTS))], _VARIANTS[random.integers(len(_VARIANTS))]
        sound = espeak(text, f"{accent}+{variant}", int(random.integers(115, 200)), int(random.integers(20, 80)))
    return Spoken(sound, reading(text), None)


def _lacking() -> str | None:
    if (why := sets.lacking(sets.tune(), "en")) is not None:
        return why
    return None if importlib.util.find_spec("py_nanotts") else "SVOX Pico is not here; pip install py-nanotts==0.1.1"


def _prepare(alike: Path) -> None:
    """Nothing."""


_TURNS = sorted((k, voice) for voice, count in _PACKS.items() for k in range(count))
ENGLISH = Corpus(
    "english",
    _lacking,
    _prepare,
    tuple((voice, k) for k, voice in _TURNS),
    say_pack,
    tuple(f"{voice}.{k}" for voice in _TIMED for k in range(2)),
    tuple(voice for voice in _PACKS if voice not in _TIMED),
    10,
    0.6,
    phones=PHONES,
    throats=True,
)
