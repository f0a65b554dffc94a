"""Opens the set `report`: python -m benchmarks.grasping.report FOLDER, FOLDER holding its recordings
(`benchmarks.grasping.sets` names them).

Each score is kept, with date and commit, in docs/grasp-scores.jsonl and in the table of docs/explanation/taking-hold.md. A commit
is scored once, and only without changes beside it.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.grasping import peers, sets
from benchmarks.grasping.trials import Ran, play, wilson
from benchmarks.row import conditions

ROOT = Path(__file__).resolve().parents[2]
SCORES = ROOT / "docs" / "grasp-scores.jsonl"
PAGE = ROOT / "docs" / "explanation" / "taking-hold.md"
BEGIN, END = "<!-- scores -->", "<!-- /scores -->"


def scored(which: sets.GraspSet) -> Iterator[tuple[str, int, int]]:
    """What is counted, how often it came out, of how many."""
    true, false = list(which.true_trials()), list(which.false_trials())
    yield from _figures("gloves", [play(t) for t in true], [play(t) for t in false])
    yield from _figures("webcam", [play(t) for t in which.webcam_trials()], [play(t) for t in which.webcam_false()])
    own = [t for t in true if t.things], [t for t in false if t.things]
    yield from _figures(f"gloves, {peers.NAME}", *([peers.play(t) for t in some] for some in own))


def _figures(case: str, true: list[Ran], false: list[Ran]) -> Iterator[tuple[str, int, int]]:
    opened = [r for r in true if r.found and r.trial.opens is not None]
    yield f"{case}: found", sum(r.found for r in true), len(true)
    for kind in dict.fromkeys(r.trial.kind for r in true):
        yield f"{case}: found, {kind}", sum(r.found for r in true if r.trial.kind == kind), sum(r.trial.kind == kind for r in true)
    yield f"{case}: released", sum(r.released for r in opened), len(opened)
    yield f"{case}: false", sum(r.took is not None for r in false), len(false)


def kept() -> list[dict[str, Any]]:
    """Every score ever taken."""
    return [json.loads(row) for row in SCORES.read_text("utf-8").splitlines()] if SCORES.is_file() else []


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


def main() -> int:
    """0: scored; 1: refused, with one line that says why."""
    folder = Path(sys.argv[1]) if len(sys.argv) == 2 else None
    if folder is None or not (folder / "buttons.lz").is_file():
        print("error: name the folder of the recordings, with buttons.lz in it", file=sys.stderr)
        return 1
    now, scores = conditions(), kept()
    if (why := refusal(now.commit, scores)) is not None:
        print(f"error: {why}", file=sys.stderr)
        return 1
    score = {"date": now.date, "commit": now.commit, "figures": list(scored(sets.report(folder)))}
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
