"""What enrolment gives a Japanese voice that is far from all that was trained on."""

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.progress import skipped
from benchmarks.row import Row
from benchmarks.voices.speech_score import CommandScore, score
from benchmarks.voices.speech_sounds import NoisyRoom, SpokenCommand, commands, held_out
from scripts.speech_model.voices import Manner, missing, resampled
from vistel.speech.acoustic import Adaptation, packaged
from vistel.speech.automaton import compile_automaton
from vistel.speech.enrolment import adapt
from vistel.speech.grammar import Grammar
from vistel.speech.grammar_file import load_grammar
from vistel.speech.hybrid import ACCEPT, HybridRecogniser
from vistel.speech.phones import PHONES, kana_ways
from vistel.speech.recognition import Hypotheses

COUNT, ENROLMENT_S = 50, 150.0
_FAR_STEP = 1.25
"""A throat a fifth shorter than the held-out voice's: a child, far from all that was trained on."""


def rows() -> Iterator[Row]:
    reason = missing() or (None if held_out() else "none of the held-out voices (mei) is here; pip install pyopenjtalk-plus")
    if reason:
        skipped("speech, enrolment of a Japanese voice", reason)
        return
    grammar, _ = load_grammar()
    yield from _enrolled(grammar)


def _recogniser(grammar: Grammar, adaptation: Adaptation | None = None) -> HybridRecogniser:
    return HybridRecogniser(compile_automaton(grammar.patterns("ja", kana_ways), PHONES), packaged("japanese"), adaptation)


def _scored(grammar: Grammar, said: list[SpokenCommand], place: NoisyRoom, adaptation: Adaptation | None = None) -> CommandScore:
    def understood(index: int, heard: Hypotheses) -> bool:
        sentence = grammar.said(heard[0].words, "ja")
        return sentence is not None and sentence.means == said[index].said.means

    heard = ((place.heard(each.sound, 0.7), 0.7 + each.end_s) for each in said)
    return score(_recogniser(grammar, adaptation), heard, understood, ACCEPT)


def _enrolled(grammar: Grammar) -> Iterator[Row]:
    """A voice far from all others, before and after it read sentences of its own."""
    far = Manner(rate=1.0 / _FAR_STEP, semitones=1.0)
    voice = held_out()[:1]
    read = [_shorter(each) for each in commands(grammar, int(ENROLMENT_S / 2.5), voice, seed=21, manner=far)]
    said = [_shorter(each) for each in commands(grammar, COUNT, voice, seed=22, manner=far)]
    room = NoisyRoom("20 dB", [each.sound for each in read])
    learnt = adapt(packaged("japanese"), [(room.heard(each.sound, 0.3, 0.3), each.said.spoken) for each in read])
    case = f"{COUNT} commands, a voice far from the training, 20 dB"
    for what, adaptation in (("before enrolment", None), (f"after {ENROLMENT_S:.0f} s of it", learnt)):
        found = _scored(grammar, said, NoisyRoom("20 dB", [each.sound for each in said]), adaptation)
        yield Row("speech", f"Japanese, {case}, {what}", "understood", "%", 100.0 * found.right)


def _shorter(command: SpokenCommand) -> SpokenCommand:
    return replace(command, sound=resampled(command.sound, _FAR_STEP), end_s=command.end_s / _FAR_STEP)
