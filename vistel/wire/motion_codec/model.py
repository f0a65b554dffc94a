"""How the numbers of a Motion are foreseen, learnt from recordings once and fixed for good; one file per version.

`benchmarks/wire/motion_training.py` makes the file. A version that has been published never changes: logs and other sites
hold streams of it.
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from vistel.arrays import I32, I64
from vistel.wire.motion_codec.layout import GRAINS_TENTHS, GROUP_OF, PART_OF, USUAL_GRAIN, Scale, scale

NEWEST = 1
"""The version that is sent."""
VERSIONS = frozenset({1})


class Model(NamedTuple):
    """Integers only; n numbers, g groups. Rows of 3: kinds of frames (full, referring to a full key frame, to another).

    mean: (n,) what a full frame expects [steps]. partner: (n,) an earlier number that tells of this one, or -1; follow:
    (3, n) by how much of the partner's surprise [256ths]. go_on: (n,) share of a key frame's change that goes on
    [256ths]. bias: (3, n), age: (3, g, 32), weights: (3, 6, g): expected size of what is left, see `kernels`. logs: (64,).
    cumulative: (m, 42), shifts: (m,): models of a signed number, by its expected size.
    """

    mean: I64
    partner: I64
    follow: I64
    go_on: I64
    bias: I64
    age: I64
    weights: I64
    logs: I64
    cumulative: I64
    shifts: I64


@cache
def table(version: int, grain: int) -> I32:
    """What the kernels take for one version in VERSIONS at one grain of `GRAINS_TENTHS`: `packed`."""
    model = from_numbers(json.loads((files("vistel.wire.motion_codec") / f"model_v{version}.json").read_text("ascii")))
    return packed(at_grain(model, grain), scale(grain))


def packed(model: Model, ends: Scale) -> I32:
    """All in one array, so that a kernel is called with few and reads little memory: four sizes (numbers, groups, models,
    ends of symbols), then part, group, low, high, mean, partner and go_on of each number; by kind follow, bias, age and
    weights; logs, shifts, cumulative."""
    sizes = np.array((len(model.mean), model.age.shape[1], *model.cumulative.shape))
    return np.concatenate(
        [
            np.ravel(part)
            for part in (
                sizes,
                PART_OF,
                GROUP_OF,
                ends.low,
                ends.high,
                model.mean,
                model.partner,
                model.go_on,
                model.follow,
                model.bias,
                model.age,
                model.weights.transpose(0, 2, 1),
                model.logs,
                model.shifts,
                model.cumulative,
            )
        ]
    ).astype(np.int32)


def from_numbers(numbers: dict[str, Any]) -> Model:
    """From the lists of a model's file."""
    return Model(*(np.array(numbers[name], np.int64) for name in Model._fields))


def at_grain(model: Model, grain: int) -> Model:
    """The same at other steps: coarser steps leave smaller numbers."""
    tenths = GRAINS_TENTHS[grain]
    sign, size = np.sign(model.mean), np.abs(model.mean)
    # What is left shrinks by half an octave a grain; what is expected from the numbers before shrinks with them.
    own = 1024 - np.minimum(1024, 16 * model.weights.sum(1))[:, GROUP_OF]
    return model._replace(mean=sign * (size * 10 // tenths), bias=model.bias - (grain - USUAL_GRAIN) * (own // 2))
