"""What a person is like, as the body model's own numbers; and how its macro targets combine (MakeHuman's rule: each target's share
is the product of the shares of what its name is made of)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64, I32

ORIGINS = ("african", "asian", "caucasian")
"""MakeHuman's words for origins."""
AGES = {"baby": 1.0, "child": 10.0, "young": 25.0, "old": 90.0}
"""Ages that were modelled, by the names of their targets [years]; between them shapes are mixed."""
_GRADES = {  # what the targets are called at 0, 1/2 and 1; without one at 1/2 the base is meant
    "muscle": ("minmuscle", "averagemuscle", "maxmuscle"),
    "weight": ("minweight", "averageweight", "maxweight"),
    "height": ("minheight", "", "maxheight"),
    "proportions": ("uncommonproportions", "", "idealproportions"),
}
_PARTS = ("male", "female", *ORIGINS, *AGES, *(name for grade in _GRADES.values() for name in grade if name))
_ONE = len(_PARTS)


@dataclass(frozen=True)
class Look:
    """male: 0 a woman .. 1 a man. age [years], 1 to 90. muscle, weight, height, proportions: 0 the least .. 1 the most that was
    modelled, 1/2 the average of that sex and age. origin: shares of ORIGINS, of any sum. details: by the names of
    `BodyModel.details`, -1 .. 1."""

    male: float = 0.5
    age: float = 25.0
    muscle: float = 0.5
    weight: float = 0.5
    height: float = 0.5
    proportions: float = 0.5
    origin: tuple[float, float, float] = (1.0, 1.0, 1.0)
    details: Mapping[str, float] = field(default_factory=dict[str, float])


def rule(names: Sequence[str]) -> I32:
    """(K, 6) which shares are multiplied for each macro target, of such names as male-young-averagemuscle-minweight-maxheight."""
    out = np.full((len(names), 6), _ONE, np.int32)
    for row, name in zip(out, names, strict=True):
        parts = [part for part in name.split("-") if part != "universal"]
        row[: len(parts)] = [_PARTS.index(part) for part in parts]
    return out


def shares(look: Look, of: I32) -> F64:
    """(K,) share of each macro target in a person; of: what `rule` gave."""
    value = dict.fromkeys(_PARTS, 0.0) | {"male": look.male, "female": 1.0 - look.male}
    total = max(sum(look.origin), 1e-9)
    value |= {name: share / total for name, share in zip(ORIGINS, look.origin, strict=True)}
    value |= _between(look.age, list(AGES), list(AGES.values()))
    for grade, names in _GRADES.items():
        value |= _between(getattr(look, grade), names, (0.0, 0.5, 1.0))
    return np.array([*(value[part] for part in _PARTS), 1.0])[of].prod(axis=1)


def _between(at: float, names: Sequence[str], anchors: Sequence[float]) -> dict[str, float]:
    """Shares of the two anchors beside a value."""
    k = int(np.clip(np.searchsorted(anchors, at) - 1, 0, len(anchors) - 2))
    share = float(np.clip((at - anchors[k]) / (anchors[k + 1] - anchors[k]), 0.0, 1.0))
    return {name: s for name, s in ((names[k], 1.0 - share), (names[k + 1], share)) if name}
