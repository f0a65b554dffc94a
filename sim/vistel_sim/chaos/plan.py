"""Random faults: which, when, where and how long, the same for the same seed."""

import random
from collections.abc import Sequence
from dataclasses import dataclass

from vistel_sim.chaos.kinds import KINDS, Target

MOVE = "move"
"""No fault: the room is moved to another of its worlds."""
APART_S = (4.0, 14.0)
"""From the beginning of one fault to that of the next, which may overlap it [s]."""
LASTING_S = (1.0, 12.0)
"""How long faults last that last [s]."""
KBIT_PER_S = (48.0, 512.0)
"""Of links that become thin."""
STEP_S = (0.2, 2.0)
"""By how much the clock is set, either way [s]."""
WEIGHTS = {"kill": 3, "world-failure": 2, MOVE: 2}
"""How often, against 1 for the others."""


@dataclass(frozen=True)
class Planned:
    """One fault, `at_s` after the beginning. seconds and amount: None where the fault has none."""

    at_s: float
    name: str
    target: str = ""
    seconds: float | None = None
    amount: float | None = None


def planned(seed: int, lasting_s: float, sites: Sequence[str], processes: Sequence[str], worlds: Sequence[str]) -> list[Planned]:
    """Faults one after the other, and some at once, whose effects are over after `lasting_s`. processes: those that may be struck;
    worlds: places to which the room may be moved."""
    rng = random.Random(seed)
    names = [*KINDS, *([MOVE] if len(worlds) > 1 else [])]
    plan: list[Planned] = []
    at_s = 0.0
    while at_s + LASTING_S[1] <= lasting_s:
        name = rng.choices(names, [WEIGHTS.get(n, 1) for n in names])[0]
        plan.append(_one(rng, at_s, name, sites, processes, worlds))
        at_s += rng.uniform(*APART_S)
    return plan


def _one(
    rng: random.Random, at_s: float, name: str, sites: Sequence[str], processes: Sequence[str], worlds: Sequence[str]
) -> Planned:
    if name == MOVE:
        return Planned(at_s, MOVE, rng.choice(worlds))
    kind = KINDS[name]
    among = {Target.SITE: sites, Target.PROCESS: processes, Target.CONFERENCE: [""]}[kind.target]
    seconds = round(rng.uniform(*LASTING_S), 1) if kind.seconds else None
    amount = None
    if name == "bandwidth":
        amount = round(rng.uniform(*KBIT_PER_S))
    elif name == "clock-step":
        amount = round(rng.uniform(*STEP_S) * rng.choice((-1, 1)), 2)
    return Planned(at_s, name, rng.choice(among), seconds, amount)
