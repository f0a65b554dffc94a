"""Japanese commands by voices the model was not trained on, other talk, how soon, what listening costs, what enrolment gives."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.progress import skipped
from benchmarks.row import Row, Target, at_least, at_most
from benchmarks.voices.speech_score import CommandScore, false_accepts, score, share_of_core
from benchmarks.voices.speech_sounds import CONDITIONS, HTS_TEST, NoisyRoom, SpokenCommand, commands, held_out, other_talk
from scripts.speech_model import rooms
from scripts.speech_model.corpus import ESPEAK_TEST, seeded
from scripts.speech_model.voices import RATE, Manner, missing, resampled
from vistel.arrays import F32
from vistel.speech.acoustic import Adaptation, japanese
from vistel.speech.automaton import compile_automaton
from vistel.speech.enrolment import adapt
from vistel.speech.grammar import Grammar
from vistel.speech.grammar_file import load_grammar
from vistel.speech.japanese import ACCEPT, JapaneseRecogniser
from vistel.speech.phones import PHONES, kana_phones
from vistel.speech.recognition import Hypotheses

COUNT, TALK_S, ENROLMENT_S = 100, 600.0, 150.0
TARGETS = {"clean": at_least(95), "20 dB": at_least(94), "10 dB": at_least(88), "reverberant": at_least(92)}
_FAR_STEP = 1.25
"""A throat a fifth shorter than the held-out voice's: a child, far from all that was trained on."""


def rows() -> Iterator[Row]:
    reason = missing() or (None if held_out() else "none of the held-out voices (mei) is here; pip install pyopenjtalk-plus")
    if reason:
        skipped("speech, Japanese", reason)
        return
    grammar, _ = load_grammar()
    voices = held_out()
    judged = set(voices) == set(HTS_TEST)  # one mood alone is easier than the five that the targets are of
    who = f"{COUNT} commands, held-out voices {', '.join(voices)}"
    said = list(commands(grammar, COUNT, voices))
    sounds = [each.sound for each in said[:30]]
    late: list[NDArray[np.float64]] = []
    accepted: list[float] = []
    for condition in CONDITIONS:
        found = _scored(grammar, said, NoisyRoom(condition, sounds))
        yield _row(f"{who}, {condition}", "understood", found.right, TARGETS[condition], judged)
        late.append(found.late_s)
        accepted.append(found.accepted)
        yield _row(f"{who}, {condition}", "right and accepted", found.accepted, None)
    yield _row("over all four conditions", "right and accepted", float(np.mean(accepted)), at_least(90), judged)
    p95 = 1000.0 * float(np.nanquantile(np.concatenate(late), 0.95))
    case = "Japanese, end of utterance to result, p95"
    yield Row("speech", case, "latency", "ms", p95, target=at_most(300))
    yield _false(grammar, sounds)
    yield from _listening(grammar)
    other = list(commands(grammar, COUNT // 2, ESPEAK_TEST, seed=5))
    found = _scored(grammar, other, NoisyRoom("clean", sounds))
    yield _row(f"{COUNT // 2} commands, held-out espeak-ng voices, clean", "understood", found.right, None)
    yield from _enrolled(grammar)


def _row(case: str, metric: str, value: float, target: Target | None, judged: bool = True) -> Row:
    return Row("speech", f"Japanese, {case}", metric, "%", 100.0 * value, target=target, judged=judged)


def _recogniser(grammar: Grammar, adaptation: Adaptation | None = None) -> JapaneseRecogniser:
    return JapaneseRecogniser(compile_automaton(grammar.patterns("ja", kana_phones), PHONES), adaptation=adaptation)


def _scored(grammar: Grammar, said: list[SpokenCommand], place: NoisyRoom, adaptation: Adaptation | None = None) -> CommandScore:
    def understood(index: int, heard: Hypotheses) -> bool:
        sentence = grammar.said(heard[0].words, "ja")
        return sentence is not None and sentence.means == said[index].said.means

    heard = ((place.heard(each.sound, 0.7), 0.7 + each.end_s) for each in said)
    return score(_recogniser(grammar, adaptation), heard, understood, ACCEPT)


def _false(grammar: Grammar, sounds: list[F32]) -> Row:
    talk = other_talk(TALK_S, held_out())
    half = len(talk) // 2
    heard = np.concatenate([NoisyRoom("clean", sounds).heard(talk[:half]), NoisyRoom("20 dB", sounds).heard(talk[half:])])
    found = len(false_accepts(_recogniser(grammar), heard, ACCEPT))
    rate = found / (len(heard) / RATE / 600.0)
    case = f"Japanese, {len(heard) / RATE / 60.0:.0f} minutes of other talk, held-out voice and texts, half of it at 20 dB"
    return Row("speech", case, "false accepts", "in 10 minutes", rate, target=at_most(1))


def _listening(grammar: Grammar) -> Iterator[Row]:
    random = seeded(6, "idle")
    quiet = 0.003 * rooms.coloured(random, 20 * RATE, 3.0)
    share = 100.0 * share_of_core(_recogniser(grammar), quiet)
    case = "Japanese, listening to a quiet room"
    yield Row("speech", case, "processor time", "% of a core", share, target=at_most(25))


def _enrolled(grammar: Grammar) -> Iterator[Row]:
    """A voice far from all others, before and after it read sentences of its own."""
    far = Manner(rate=1.0 / _FAR_STEP, semitones=1.0)
    voice = held_out()[:1]
    read = [_shorter(each) for each in commands(grammar, int(ENROLMENT_S / 2.5), voice, seed=21, manner=far)]
    said = [_shorter(each) for each in commands(grammar, COUNT // 2, voice, seed=22, manner=far)]
    room = NoisyRoom("20 dB", [each.sound for each in read])
    learnt = adapt(japanese(), [(room.heard(each.sound, 0.3, 0.3), each.said.spoken) for each in read])
    case = f"{COUNT // 2} commands, a voice far from the training, 20 dB"
    for what, adaptation in (("before enrolment", None), (f"after {ENROLMENT_S:.0f} s of it", learnt)):
        found = _scored(grammar, said, NoisyRoom("20 dB", [each.sound for each in said]), adaptation)
        yield _row(f"{case}, {what}", "understood", found.right, None)


def _shorter(command: SpokenCommand) -> SpokenCommand:
    return replace(command, sound=resampled(command.sound, _FAR_STEP), end_s=command.end_s / _FAR_STEP)
