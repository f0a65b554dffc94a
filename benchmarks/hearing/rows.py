"""Figures of the sets `tune` and `choose`, and what listening costs; `benchmarks.hearing.report` opens `report`."""

from collections.abc import Iterator

import numpy as np

from benchmarks.hearing import sets
from benchmarks.hearing.scoring import commands_heard, talk_believed
from benchmarks.progress import skipped
from benchmarks.row import Row, Target, at_least, at_most
from benchmarks.scores import wilson
from benchmarks.voices.speech_score import share_of_core
from scripts.speech_model.voices import RATE
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognisers import NAMES, RecogniserError, checked_grammar, recogniser
from vistel.speech.recognition import Recogniser

TARGETS: dict[Language, dict[str, Target]] = {
    "ja": {"clean": at_least(97), "20 dB": at_least(95), "10 dB": at_least(90), "reverberant": at_least(94)},
    "en": {"clean": at_least(97), "20 dB": at_least(95), "10 dB": at_least(85)},
}
COUNT, TALK_MIN = 24, 5


def rows(language: Language) -> Iterator[Row]:
    """As they come; a set that cannot be spoken here is left out, and said."""
    grammar, _ = checked_grammar()
    try:
        hears = recogniser(language, grammar)
    except RecogniserError as e:
        skipped(f"speech, {NAMES[language]}", str(e))
        return
    for some in (sets.tune(), sets.choose()):
        if (why := sets.lacking(some, language)) is not None:
            skipped(f"speech, {NAMES[language]}, set {some.name}", why)
            continue
        yield from _set(hears, some, grammar, language)
    hiss = (1e-3 * np.random.default_rng(4).standard_normal(20 * RATE)).astype(np.float32)
    share = 100.0 * share_of_core(hears, hiss)
    yield Row("speech", f"{NAMES[language]}, listening to a quiet room", "processor time", "% of a core", share, target=at_most(8))


def _set(hears: Recogniser, some: sets.HearingSet, grammar: Grammar, language: Language) -> Iterator[Row]:
    late: list[float] = []
    for heard in commands_heard(hears, some, grammar, language, COUNT):
        for metric, hits, target in (
            ("understood", heard.right, TARGETS[language].get(heard.condition)),
            ("understood and believed", heard.accepted, None),
        ):
            low, high = wilson(hits, heard.of)
            case = f"{NAMES[language]}, set {some.name}, {heard.condition}, {heard.of} commands, "
            case += f"95 % interval {low:.1f} to {high:.1f} %"
            yield Row("speech", case, metric, "%", 100.0 * hits / heard.of, target=target)
        late += heard.late_s
    case = f"{NAMES[language]}, set {some.name}"
    if late:
        p95 = float(np.percentile(late, 95))
        yield Row("speech", case, "end of speech to result, p95", "s", p95, target=at_most(0.3))
    wrong = talk_believed(hears, some, language, 60.0 * TALK_MIN)
    yield Row("speech", f"{case}, {TALK_MIN} minutes of other talk", "false accepts", "", wrong, target=at_most(0))
