"""Opens the set `report`: python -m benchmarks.grasping.report FOLDER, FOLDER holding its recordings
(`benchmarks.grasping.sets` names them).

Each score is kept, with date and commit, in docs/grasp-scores.jsonl and in the table of docs/explanation/taking-hold.md. A commit
is scored once, and only without changes beside it.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

from benchmarks.grasping import peers, sets
from benchmarks.grasping.trials import Ran, play
from benchmarks.scores import Figure, Scores

SCORES = Scores("grasp-scores.jsonl", "explanation/taking-hold.md")


def scored(which: sets.GraspSet) -> Iterator[Figure]:
    """What is counted, how often it came out, of how many."""
    true, false = list(which.true_trials()), list(which.false_trials())
    yield from _figures("gloves", [play(t) for t in true], [play(t) for t in false])
    yield from _figures("webcam", [play(t) for t in which.webcam_trials()], [play(t) for t in which.webcam_false()])
    own = [t for t in true if t.things], [t for t in false if t.things]
    yield from _figures(f"gloves, {peers.NAME}", *([peers.play(t) for t in some] for some in own))


def _figures(case: str, true: list[Ran], false: list[Ran]) -> Iterator[Figure]:
    opened = [r for r in true if r.found and r.trial.opens is not None]
    yield f"{case}: found", sum(r.found for r in true), len(true)
    for kind in dict.fromkeys(r.trial.kind for r in true):
        yield f"{case}: found, {kind}", sum(r.found for r in true if r.trial.kind == kind), sum(r.trial.kind == kind for r in true)
    yield f"{case}: released", sum(r.released for r in opened), len(opened)
    yield f"{case}: false", sum(r.took is not None for r in false), len(false)


def main() -> int:
    """0: scored; 1: refused, with one line that says why."""
    folder = Path(sys.argv[1]) if len(sys.argv) == 2 else None
    if folder is None or not (folder / "buttons.lz").is_file():
        print("error: name the folder of the recordings, with buttons.lz in it", file=sys.stderr)
        return 1
    return SCORES.opened(lambda: scored(sets.report(folder)))


if __name__ == "__main__":
    raise SystemExit(main())
