"""What a recogniser makes of a set: commands in four conditions, other talk, delay, processor time."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from benchmarks.hearing.sets import CASES, HearingSet
from benchmarks.voices.speech_score import false_accepts, score
from scripts.speech_model.voices import RATE
from vistel.speech.grammar import Grammar, Language
from vistel.speech.meaning import asked_for
from vistel.speech.recognition import Hypotheses, Recogniser

BELIEVED = 0.5


@dataclass
class Heard:
    """Of one condition. right: understood as meant; accepted: and believed; of: commands; late_s: from the end of speech to the
    result, of those that were right."""

    condition: str
    right: int
    accepted: int
    of: int
    late_s: list[float] = field(default_factory=list[float])


def commands_heard(
    recogniser: Recogniser, some: HearingSet, grammar: Grammar, language: Language, count: int, cases: tuple[str, ...] = CASES
) -> Iterator[Heard]:
    """The set's commands in each condition."""
    commands = some.commands(grammar, language, count)

    def understood(index: int, heard: Hypotheses) -> bool:
        sentence = grammar.sentence(heard[0].words, language) if heard[0].words else None
        return sentence is not None and asked_for(sentence.means) == asked_for(commands[index].sentence.means)

    for condition in cases:
        place = some.place(condition, [each.sound for each in commands])
        heard = [(place.heard(each.sound), 0.7 + each.end_s) for each in commands]
        found = score(recogniser, heard, understood, BELIEVED)
        late = found.late_s[np.isfinite(found.late_s)].tolist()
        yield Heard(condition, round(found.right * count), round(found.accepted * count), count, late)


def talk_believed(recogniser: Recogniser, some: HearingSet, language: Language, seconds: float) -> int:
    """How many commands were believed in other talk, half of it when it is quiet, half in noise of 20 dB."""
    talk = some.other_talk(language, seconds)
    voices = [talk[: 10 * RATE]]
    halves = zip(("clean", "20 dB"), np.array_split(talk, 2), strict=True)
    sound = np.concatenate([some.place(condition, voices).heard(part) for condition, part in halves])
    return len(false_accepts(recogniser, sound, BELIEVED))
