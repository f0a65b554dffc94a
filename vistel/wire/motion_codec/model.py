"""The model that predicts the numbers of a Motion, learnt from recordings; one file per version.

`benchmarks/wire/motion_training.py` makes the file. A published version never changes: logs and other sites have streams
of it.
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

    mean: (n,) prediction in a full frame [steps]. partner: (n,) an earlier number that helps to predict this one, or -1;
    follow: (3, n) share of the partner's deviation that is added [256ths]. go_on: (n,) share of a key frame's change that
    continues [256ths]. bias: (3, n), age: (3, g, 32), weights: (3, 6, g), logs: (64,): expected size of a residual, see
    `codec_kernels`. cumulative: (m, 42), shifts: (m,): static models of a residual, by its expected size.
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
    """The model of a version in VERSIONS at an index of `GRAINS_TENTHS`, as `packed`."""
    model = from_numbers(json.loads((files("vistel.wire.motion_codec") / f"model_v{version}.json").read_text("ascii")))
    return packed(at_grain(model, grain), scale(grain))


def packed(model: Model, ends: Scale) -> I32:
    """One array, so that a kernel has few arguments and reads little memory: four sizes (numbers, groups, models, ends of
    symbols), then part, group, low, high, mean, partner and go_on of each number; by kind follow, bias, age and
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
    """The model from the lists of its file."""
    return Model(*(np.array(numbers[name], np.int64) for name in Model._fields))


def at_grain(model: Model, grain: int) -> Model:
    """The same for other steps: coarser steps leave smaller residuals."""
    tenths = GRAINS_TENTHS[grain]
    sign, size = np.sign(model.mean), np.abs(model.mean)
    # Residuals shrink by half an octave a grain; the share expected from earlier residuals shrinks with them.
    own = 1024 - np.minimum(1024, 16 * model.weights.sum(1))[:, GROUP_OF]
    return model._replace(mean=sign * (size * 10 // tenths), bias=model.bias - (grain - USUAL_GRAIN) * (own // 2))
