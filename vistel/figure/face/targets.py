"""The meaning of a file's morph targets for a face: their names as action units."""

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Target
from vistel.figure.face.rules import FaceRules, OneSided, builtin_rules
from vistel.geometry.smoothstep import smooth

FILE = Path(__file__).with_name("targets.toml")
_SIDE = re.compile(r"(?<![a-z])(left|right)(?![a-z])|(left|right)$|[ _.-](l|r)$", re.IGNORECASE)
_VRM = "vrm:"
SPLIT_M = 0.012
"""Half of the width over which a target of both sides is split into two [m, a standard head]."""


@dataclass(frozen=True)
class Meaning:
    """A unit's name and side: 1 left, -1 right, 0 both; rank: of two targets with the same meaning the lower one counts."""

    unit: str
    side: int
    rank: int = 0


def meant(names: Iterable[str]) -> dict[str, Meaning]:
    """The names of targets that mean a unit, with their meanings."""
    found = {name: _meaning(name) for name in names}
    return {name: m for name, m in found.items() if m is not None}


def shapes_of(unit: OneSided, targets: Sequence[Target]) -> tuple[list[Target], bool]:
    """The targets that give this unit at intensity 1, the best first; and whether they are of both sides though the unit is of
    one."""
    meanings = meant(t.name for t in targets)
    found = [(m.rank, abs(m.side - unit.side), t) for t in targets if (m := meanings.get(t.name)) and m.unit == unit.unit.name]
    own = [(rank, t) for rank, apart, t in found if apart == 0]
    both = [(rank, t) for rank, apart, t in found if apart == 1 and meanings[t.name].side == 0]
    if own and (not both or min(r for r, _ in own) <= min(r for r, _ in both)):
        return [min(own, key=lambda x: x[0])[1]], False
    if both:
        return [min(both, key=lambda x: x[0])[1]], True
    # Two targets for one unit, as in jaws that are rigged in two halves.
    halves = [t for _, _, t in found if unit.side == 0]
    return halves, False


def half(p: F64, middle: F64, scale: float, side: int) -> F64:
    """(N,) share of a shape of both sides that is of one."""
    return smooth(0.5 + 0.5 * side * (p[:, 0] - middle[0]) / (SPLIT_M * scale))


def _meaning(name: str) -> Meaning | None:
    table, vrm = _tables(builtin_rules())
    if name.startswith(_VRM):
        name, found = name.removeprefix(_VRM), vrm
    else:
        # Programs put the mesh's name before it: Face.mouthSmileLeft.
        name, found = re.split(r"[.:|](?=[A-Za-z]{2})", name)[-1], table
    whole = _plain(name)
    if whole in found:
        return found[whole]
    match = _SIDE.search(name)
    if match is None:
        return None
    side = 1 if next(g for g in match.groups() if g).lower().startswith("l") else -1
    base = found.get(_plain(name[: match.start()] + name[match.end() :]))
    return None if base is None else Meaning(base.unit, side, base.rank)


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


@cache
def _tables(rules: FaceRules) -> tuple[dict[str, Meaning], dict[str, Meaning]]:
    file = tomllib.loads(FILE.read_text("utf-8"))
    table = {_plain(name): Meaning(unit, 0) for name, unit in file["names"].items()}
    for u in rules.units:
        table[_plain(u.unit.name)] = Meaning(u.unit.name, 0)
        for channel, share in u.unit.arkit.items():
            if share >= 1.0:
                table[_plain(channel)] = Meaning(u.unit.name, 0)
    # A VRM's own expressions are its presets or, as faces from phones want them, ARKit's shapes.
    return table, table | {_plain(name): Meaning(unit, 0, 1) for name, unit in file["vrm"].items()}
