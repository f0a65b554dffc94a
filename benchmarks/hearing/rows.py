"""Figures of the sets `tune` and `choose`, and what listening costs; `benchmarks.hearing.report` opens `report`."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import repeat

import numpy as np

from benchmarks.hearing import sets
from benchmarks.hearing.scoring import commands_heard, talk_believed
from benchmarks.progress import skipped
from benchmarks.row import Row, Target, at_least, at_most
from benchmarks.scores import wilson
from benchmarks.voices.speech_score import share_of_core
from scripts.speech_model.voices import RATE
from vistel.speech.engines.choice import Chosen
from vistel.speech.engines.sphinx import PACKAGE
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognisers import NAMES, RecogniserError, checked_grammar, recogniser
from vistel.speech.recognition import Recogniser

TARGETS: dict[Language, dict[str, Target]] = {
    "ja": {"clean": at_least(97), "20 dB": at_least(95), "10 dB": at_least(90), "reverberant": at_least(94)},
    "en": {"clean": at_least(97), "20 dB": at_least(95), "10 dB": at_least(85)},
}
PEERS: dict[Language, tuple[str, Chosen]] = {"en": (PACKAGE.replace("==", " "), Chosen("pocketsphinx"))}
"""What is scored beside the package's own recogniser, in turns with it."""
COUNT, TALK_MIN = 24, 5


def rows(language: Language) -> Iterator[Row]:
    """As they come; a set that cannot be spoken here is left out, and said."""
    grammar, _ = checked_grammar()
    try:
        hears = recogniser(language, grammar)
        name, chosen = PEERS.get(language, (None, None))
        peer = None if chosen is None else recogniser(language, grammar, chosen=chosen)
    except RecogniserError as e:
        skipped(f"speech, {NAMES[language]}", str(e))
        return
    for some in (sets.tune(), sets.choose()):
        if (why := sets.lacking(some, language)) is not None:
            skipped(f"speech, {NAMES[language]}, set {some.name}", why)
            continue
        for row in _set(hears, peer, some, grammar, language):
            yield row if peer is None else replace(row, peer=name)
    hiss = (1e-3 * np.random.default_rng(4).standard_normal(20 * RATE)).astype(np.float32)
    share, theirs = (None if each is None else 100.0 * share_of_core(each, hiss) for each in (hears, peer))
    case = f"{NAMES[language]}, listening to a quiet room"
    yield Row("speech", case, "processor time", "% of a core", share or 0.0, name, theirs, target=at_most(8))


def _set(hears: Recogniser, peer: Recogniser | None, some: sets.HearingSet, grammar: Grammar, language: Language) -> Iterator[Row]:
    """Peer values without the peer's name."""
    late: list[float] = []
    theirs_late: list[float] = []
    theirs = repeat(None) if peer is None else commands_heard(peer, some, grammar, language, COUNT)
    for heard, other in zip(commands_heard(hears, some, grammar, language, COUNT), theirs, strict=False):
        condition = f"{NAMES[language]}, set {some.name}, {heard.condition}, {heard.of} commands"
        for metric, hits, others, target in (
            ("understood", heard.right, other and other.right, TARGETS[language].get(heard.condition)),
            ("understood and believed", heard.accepted, other and other.accepted, None),
        ):
            case = f"{condition}, 95 % interval {_interval(hits, heard.of)}"
            case += "" if others is None else f", the peer's {_interval(others, heard.of)}"
            of_peer = None if others is None else 100.0 * others / heard.of
            yield Row("speech", case, metric, "%", 100.0 * hits / heard.of, peer_value=of_peer, target=target)
        late += heard.late_s
        theirs_late += other.late_s if other else []
    case = f"{NAMES[language]}, set {some.name}"
    if late:
        p95, of_peer = (float(np.percentile(each, 95)) if each else None for each in (late, theirs_late))
        yield Row("speech", case, "end of speech to result, p95", "s", p95 or 0.0, peer_value=of_peer, target=at_most(0.3))
    wrong, of_peer = (None if each is None else talk_believed(each, some, language, 60.0 * TALK_MIN) for each in (hears, peer))
    case += f", {TALK_MIN} minutes of other talk"
    yield Row("speech", case, "false accepts", "", wrong or 0, peer_value=of_peer, target=at_most(0))


def _interval(hits: int, of: int) -> str:
    low, high = wilson(hits, of)
    return f"{low:.1f} to {high:.1f} %"
