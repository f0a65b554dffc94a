"""Opens the set `report`: python -m benchmarks.hearing.report [JOBS], with the voices of HTS "Mei" in VISTEL_VOICES. JOBS: how
many processes share the work.

Each score is kept, with date and commit, in docs/speech-scores.jsonl and in the table of docs/explanation/speech.md. A commit is
scored once, and only without changes beside it.
"""

import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from itertools import product

from benchmarks.hearing import sets
from benchmarks.hearing.scoring import commands_heard, talk_believed
from benchmarks.scores import Figure, Scores
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognisers import NAMES, checked_grammar, recogniser
from vistel.speech.recognition import Recogniser

SCORES = Scores("speech-scores.jsonl", "explanation/speech.md")
COUNT = 24
"""Commands of each case."""
TALK_MIN = 3
"""Other talk [min]."""
LANGUAGES: tuple[Language, ...] = ("en", "ja")
TALK = "other talk"


def scored(jobs: int) -> Iterator[Figure]:
    """What is counted, how often it came out, of how many."""
    with ProcessPoolExecutor(jobs) as pool:
        for some in pool.map(_counted, *zip(*product(LANGUAGES, (*sets.CASES, TALK)), strict=True)):
            yield from some


@cache
def _ready(language: Language) -> tuple[Grammar, Recogniser]:
    grammar, _ = checked_grammar()
    return grammar, recogniser(language, grammar)


def _counted(language: Language, case: str) -> list[Figure]:
    grammar, hears = _ready(language)
    if case == TALK:
        wrong = talk_believed(hears, sets.report(), language, 60.0 * TALK_MIN)
        return [(f"{NAMES[language]}, {TALK}: minutes in which something is believed", min(wrong, TALK_MIN), TALK_MIN)]
    (heard,) = commands_heard(hears, sets.report(), grammar, language, COUNT, (case,))
    what = f"{NAMES[language]}, {case}: understood"
    return [(what, heard.right, heard.of), (f"{what} and believed", heard.accepted, heard.of)]


def main() -> int:
    """0: scored; 1: refused, with one line that says why."""
    jobs = int(sys.argv[1]) if len(sys.argv) == 2 and sys.argv[1].isdigit() else 1
    if (lacking := next((why for language in LANGUAGES if (why := sets.lacking(sets.report(), language))), None)) is not None:
        print(f"error: {lacking}", file=sys.stderr)
        return 1
    return SCORES.opened(lambda: scored(jobs))


if __name__ == "__main__":
    raise SystemExit(main())
