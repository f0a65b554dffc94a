"""python -m vistel_sim.chaos --minutes 30 --seed 1: random faults under a conference of four sites, and whether it stood them."""

import argparse
import math
import os
from pathlib import Path

from vistel.wire import background, event_loop
from vistel_sim.chaos.report import examine
from vistel_sim.chaos.run import run, save


def main() -> int:
    """Returns the exit code: 0 where all held, 1 where something that must hold did not, 2 where the conference did not run."""
    parser = argparse.ArgumentParser(
        "python -m vistel_sim.chaos", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=30.0, help="of faults; some quiet before and after them comes on top")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quiet", type=float, default=20.0, help="seconds without faults before and after them")
    parser.add_argument("--no-faults", action="store_true", help="only see whether memory and open files stay as they are")
    parser.add_argument("--out", type=Path, default=Path("out/chaos"), help="folder for logs; a new one within it is used")
    args = parser.parse_args()
    if not 0.0 < args.minutes < math.inf or not 0.0 <= args.quiet < math.inf:
        parser.error("--minutes: expected a time above 0, --quiet: 0 s or more")
    folder = _free(args.out.resolve())
    print(f"logs in {folder}", flush=True)
    running = run(folder, args.seed, args.minutes * 60.0, args.quiet, faults=not args.no_faults)
    try:
        outcome = event_loop.run(background.as_service("chaos", running))
    except (ChildProcessError, TimeoutError) as e:
        print(f"NOT JUDGED: {e or 'the conference took too long to begin'}; logs in {folder}", flush=True)
        return 2
    save(outcome, folder / "outcome.json")
    found = examine(folder, outcome, faults=not args.no_faults, begun=lambda line: print(line, flush=True))
    for line in found.told:
        print(line)
    for invariant, lines in found.violations.items():
        print(f"{'VIOLATED' if lines else 'held    '}  {invariant}")
        for line in lines:
            print(f"          {line}")
    broken = sum(1 for lines in found.violations.values() if lines)
    print(
        f"FAILED: {broken} of {len(found.violations)} invariants violated"
        if broken
        else f"PASSED: all {len(found.violations)} held",
        flush=True,
    )
    return 1 if broken else 0


def _free(top: Path) -> Path:
    """A new folder in `top`."""
    number = 1
    while True:
        try:
            (made := top / str(number)).mkdir(parents=True)
            return made
        except FileExistsError:
            number += 1


if __name__ == "__main__":
    os._exit(main())  # the bus's threads wait in native code
