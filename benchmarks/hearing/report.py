"""Opens the set `report`: python -m benchmarks.hearing.report [JOBS], with the voices of HTS "Mei" in VISTEL_VOICES. JOBS: how
many processes share the work.

Each score is kept, with date and commit, in docs/speech-scores.jsonl and in the table of docs/explanation/speech.md. A commit is
scored once, and only without changes beside it.
"""

import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from itertools import product
from typing import Any

from benchmarks.grasping.report import BEGIN, END, ROOT, refusal, table
from benchmarks.hearing import sets
from benchmarks.hearing.scoring import commands_heard, talk_believed
from benchmarks.row import conditions
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognisers import NAMES, checked_grammar, recogniser
from vistel.speech.recognition import Recogniser

SCORES = ROOT / "docs" / "speech-scores.jsonl"
PAGE = ROOT / "docs" / "explanation" / "speech.md"
COUNT, TALK_MIN = 24, 3
LANGUAGES: tuple[Language, ...] = ("en", "ja")
TALK = "other talk"


def scored(jobs: int) -> Iterator[tuple[str, int, int]]:
    """What is counted, how often it came out, of how many."""
    with ProcessPoolExecutor(jobs) as pool:
        for some in pool.map(_counted, *zip(*product(LANGUAGES, (*sets.CASES, TALK)), strict=True)):
            yield from some


@cache
def _ready(language: Language) -> tuple[Grammar, Recogniser]:
    grammar, _ = checked_grammar()
    return grammar, recogniser(language, grammar)


def _counted(language: Language, case: str) -> list[tuple[str, int, int]]:
    grammar, hears = _ready(language)
    if case == TALK:
        wrong = talk_believed(hears, sets.report(), language, 60.0 * TALK_MIN)
        return [(f"{NAMES[language]}, {TALK}: minutes in which something is believed", min(wrong, TALK_MIN), TALK_MIN)]
    (heard,) = commands_heard(hears, sets.report(), grammar, language, COUNT, (case,))
    what = f"{NAMES[language]}, {case}: understood"
    return [(what, heard.right, heard.of), (f"{what} and believed", heard.accepted, heard.of)]


def kept() -> list[dict[str, Any]]:
    """Every score ever taken."""
    return [json.loads(row) for row in SCORES.read_text("utf-8").splitlines()] if SCORES.is_file() else []


def main() -> int:
    """0: scored; 1: refused, with one line that says why."""
    jobs = int(sys.argv[1]) if len(sys.argv) == 2 and sys.argv[1].isdigit() else 1
    now, scores = conditions(), kept()
    lacking = next((why for language in LANGUAGES if (why := sets.lacking(sets.report(), language))), None)
    if (why := lacking or refusal(now.commit, scores)) is not None:
        print(f"error: {why}", file=sys.stderr)
        return 1
    score = {"date": now.date, "commit": now.commit, "figures": list(scored(jobs))}
    with SCORES.open("a", encoding="utf-8") as out:
        out.write(json.dumps(score) + "\n")
    text = PAGE.read_text("utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}\n\n{table([*scores, score])}\n\n{END}{after}", "utf-8")
    for what, hits, of in score["figures"]:
        print(f"{what}: {hits} of {of}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
