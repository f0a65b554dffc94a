"""Scores of sets that are opened once for a commit: each is kept, with date and commit, and stands in a table of the docs."""

import json
import math
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.row import conditions

_DOCS = Path(__file__).resolve().parents[1] / "docs"
_BEGIN, _END = "<!-- scores -->", "<!-- /scores -->"

Figure = tuple[str, int, int]
"""What is counted, how often it came out, of how many."""


class Scores(NamedTuple):
    """Of one task. kept: their file in docs/; page: the page there with their table."""

    kept: str
    page: str

    def opened(self, score: Callable[[], Iterable[Figure]]) -> int:
        """Score the commit that is here. The exit code: 0, or 1 where it is refused, with one line that says why."""
        file, page, now = _DOCS / self.kept, _DOCS / self.page, conditions()
        scores = [json.loads(row) for row in file.read_text("utf-8").splitlines()] if file.is_file() else []
        if (why := refusal(now.commit, scores)) is not None:
            print(f"error: {why}", file=sys.stderr)
            return 1
        scores.append({"date": now.date, "commit": now.commit, "figures": list(score())})
        with file.open("a", encoding="utf-8") as out:
            out.write(json.dumps(scores[-1]) + "\n")
        text = page.read_text("utf-8")
        before, after = text.split(_BEGIN)[0], text.split(_END)[1]
        page.write_text(f"{before}{_BEGIN}\n\n{table(scores)}\n\n{_END}{after}", "utf-8")
        for what, hits, of in scores[-1]["figures"]:
            print(f"{what}: {hits} of {of}")
        return 0


def refusal(commit: str, scores: list[dict[str, Any]]) -> str | None:
    """Why a commit cannot be scored; None: it can."""
    if commit.endswith("+"):
        return "files differ from the commit; commit first"
    if any(s["commit"] == commit for s in scores):
        return f"{commit} was scored already; every commit is scored once"
    return None


def table(scores: list[dict[str, Any]]) -> str:
    """The scores for people, the newest first."""
    rows = ["| date | commit | what | share | 95 % interval | of |", "|---|---|---|--:|---|--:|"]
    for s in reversed(scores):
        for what, hits, of in s["figures"]:
            low, high = wilson(hits, of)
            rows.append(
                f"| {s['date']} | {s['commit']} | {what} | {100 * hits / max(1, of):.1f} % | {low:.1f} to {high:.1f} % | {of} |"
            )
    return "\n".join(rows)


def wilson(hits: int, of: int) -> tuple[float, float]:
    """The 95 % interval of a share, per cent (Wilson 1927)."""
    if of == 0:
        return 0.0, 100.0
    z, p = 1.96, hits / of
    middle = (p + z * z / (2 * of)) / (1 + z * z / of)
    half = z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return 100.0 * max(0.0, middle - half), 100.0 * min(1.0, middle + half)
