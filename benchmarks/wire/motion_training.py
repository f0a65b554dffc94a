"""Learns the model of the motion codec: `python -m benchmarks.wire.motion_training OUT.json`.

In the order in which a frame is written: how much of a key frame's change goes on, which earlier number tells of a
number and by how much (least squares), how large what is left will be (gamma regression); then how often each symbol
comes. The model of a version that has been published is never made again.
"""

import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.wire.motion_streams import HALVES, seated, streams
from vistel.arrays import F64, I64
from vistel.wire.motion_codec.codec_kernels import AFTER_CHANGE, FULL, LOGS, MIDDLE
from vistel.wire.motion_codec.layout import GROUP_OF, GROUPS, NUMBERS, scale
from vistel.wire.motion_codec.model import Model, from_numbers

MODELS = 26
SYMBOLS = 2 * MIDDLE + 1
TOTAL = 1 << 15
LEAST = 0.25
"""Added to what is left, so that nothing left has a size too."""
SPACINGS = ((15, 2), (24, 2), (24, 3), (30, 8))
"""Frames from one full key frame to the next, and from one key frame to the next."""
FEATURES = {FULL: (0, 1, 2, 3, 5), 1: (0, 1, 2, 3, 5), AFTER_CHANGE: (0, 1, 2, 3, 4, 5)}


@dataclass(frozen=True)
class Frames:
    """Frames of one kind: values, those of their key frames and its change (n, NUMBERS); distance, span (n,)."""

    values: I64
    reference: I64
    change: I64
    distance: I64
    span: I64


def learn(recordings: Iterable[F64]) -> Model:
    """From streams (n, NUMBERS)."""
    steps = [np.rint(r / scale().step).astype(np.int64) for r in recordings]
    kinds = {k: _joined([_frames(q, full, key)[k] for q in steps for full, key in SPACINGS]) for k in FEATURES}
    logs = [round(16 * np.log2(1 + 2 * x)) for x in range(LOGS)]
    numbers = {
        "mean": np.rint(kinds[FULL].values.mean(0)).astype(int),
        "partner": np.full(NUMBERS, -1),
        "follow": np.zeros((3, NUMBERS), int),
        "go_on": _go_on(kinds[AFTER_CHANGE]),
        "bias": np.zeros((3, NUMBERS), int),
        "age": np.zeros((3, GROUPS, 32), int),
        "weights": np.zeros((3, 6, GROUPS), int),
        "logs": logs,
        "cumulative": np.zeros((MODELS, SYMBOLS + 1), int),
        "shifts": _shifts(),
    }
    model = from_numbers(numbers)
    _find_partners(model, kinds)
    for _ in range(2):
        for kind, frames in kinds.items():
            _fit_sizes(model, kind, frames)
    _count(model, kinds)
    return model


def _frames(q: I64, full: int, key: int) -> dict[int, Frames]:
    """A stream cut into kinds of frames, with a full key frame every `full` frames and a key frame every `key`."""
    rows: dict[int, list[tuple[int, int, int]]] = {k: [] for k in FEATURES}
    change, span, last = np.zeros_like(q), np.zeros(len(q), np.int64), 0
    for t in range(len(q)):
        if t % full == 0:
            rows[FULL].append((t, t, 0))
            last = t
            continue
        rows[AFTER_CHANGE if span[last] else 1].append((t, last, t - last))
        if t % full % key == 0:
            change[t], span[t] = q[t] - q[last], t - last
            last = t
    out: dict[int, Frames] = {}
    for kind, found in rows.items():
        at, ref, distance = np.array(found, np.int64).reshape(-1, 3).T
        out[kind] = Frames(q[at], q[ref], change[ref], distance, span[ref])
    return out


def _joined(frames: Sequence[Frames]) -> Frames:
    return Frames(*(np.concatenate([getattr(f, name) for f in frames]) for name in Frames.__dataclass_fields__))


def _go_on(frames: Frames) -> I64:
    """What share of a key frame's change goes on, weighted so that quick movements do not drown the others."""
    reach = np.minimum(frames.distance, 2 * frames.span) / frames.span
    moved = np.clip(frames.change * reach[:, None], -60, 60)
    seen = np.clip(frames.values - frames.reference, -120, 120)
    weight = 1.0 / (4.0 + np.abs(moved))
    share = (weight * moved * seen).sum(0) / ((weight * moved * moved).sum(0) + 50.0)
    return np.clip(np.rint(256 * share), 0, 256).astype(np.int64)


def _find_partners(model: Model, kinds: dict[int, Frames]) -> None:
    surprise = []
    for kind in (1, AFTER_CHANGE):
        left = _run(model, kind, kinds[kind])[3]
        usual = np.maximum(4.0, 3.0 * np.median(np.abs(left), axis=1, keepdims=True) + 3.0)
        surprise.append(np.clip(left, -60, 60) / usual)
    table = np.concatenate(surprise)
    together, own = table.T @ table, (table**2).sum(0)
    for c in range(1, NUMBERS):
        told = together[c, :c] ** 2 / (own[:c] + 1e-3 * len(table)) / max(1e-9, own[c])
        best = int(np.argmax(told))
        if told[best] > 0.03:
            model.partner[c] = best
    for kind, frames in kinds.items():
        limit = 4000.0 if kind == FULL else 60.0
        left = np.clip(_run(model, kind, frames)[3], -limit, limit).astype(float)
        for c in np.flatnonzero(model.partner >= 0):
            p = left[:, model.partner[c]]
            weight = np.ones(len(p)) if kind == FULL else 1.0 / (3.0 + np.abs(left[:, c]) + np.abs(p))
            share = (weight * left[:, c] * p).sum() / ((weight * p * p).sum() + (1000.0 if kind == FULL else 20.0))
            model.follow[kind, c] = int(np.clip(np.rint(256 * share), -512, 512))


def _fit_sizes(model: Model, kind: int, frames: Frames) -> None:
    """Gamma regression with a logarithmic link of how much is left, group by group; by reweighted least squares."""
    left, features, _, _ = _run(model, kind, frames)
    use = list(FEATURES[kind])
    far = np.clip(frames.distance, 1, 32) - 1
    age = 16.0 * np.log2(1.0 + np.arange(32))
    for g in range(GROUPS):
        members = np.flatnonzero(g == GROUP_OF)
        rows, sizes = [], []
        for i, c in enumerate(members):
            own = np.zeros((len(left), len(members)))
            own[:, i] = 1.0
            rows.append(np.concatenate((features[:, c][:, use] / 16, age[far][:, None] / 16, own), axis=1))
            sizes.append(np.abs(left[:, c]) + LEAST)
        a, y = np.concatenate(rows), np.concatenate(sizes)
        solver = np.linalg.inv(a.T @ a + np.diag([40.0] * (len(use) + 1) + [13.0] * len(members)))
        found = solver @ (a.T @ np.log2(y))
        for _ in range(5):
            expected = 2.0 ** (a @ found)
            surprise = np.minimum(y / expected - 1.0, 6.0)
            found = solver @ (a.T @ (np.log2(expected) + surprise / np.log(2.0)))
        model.weights[kind, :, g] = 0
        model.weights[kind, use, g] = np.rint(64 * found[: len(use)])
        model.age[kind, g] = np.rint(64 * found[len(use)] * age) if kind != FULL else 0
        model.bias[kind, members] = np.rint(1024 * (found[len(use) + 1 :] - np.log2(LEAST)))


def _shifts() -> I64:
    return np.maximum(0, np.ceil(np.log2(_expected() / 5.0))).astype(np.int64)


def _expected() -> F64:
    """Middle of the sizes that each model of a number is for: half octaves above LEAST."""
    return LEAST * (2.0 ** (np.arange(MODELS) / 2 + 0.25) - 1.0)


def _count(model: Model, kinds: dict[int, Frames]) -> None:
    """How often each symbol comes, on top of what a Laplace distribution would say."""
    symbols = np.arange(SYMBOLS) - MIDDLE
    counts = np.exp(-np.abs(symbols) * 2.0 ** model.shifts[:, None] / np.maximum(0.12, _expected())[:, None])
    counts *= 200.0 / counts.sum(1, keepdims=True)
    for kind, frames in kinds.items():
        left, _, about, _ = _run(model, kind, frames)
        chosen = np.clip(about >> 9, 0, MODELS - 1)
        seen = np.clip((left >> model.shifts[chosen]) + MIDDLE, 0, SYMBOLS - 1)
        np.add.at(counts, (chosen.ravel(), seen.ravel()), 1.0)
    for k, shift in enumerate(model.shifts):
        # Up and down are alike; where low bits are cut off, -1 mirrors 0.
        whole = counts[k] if shift == 0 else counts[k, :-1]
        whole[:] = (whole + whole[::-1]) / 2.0
    share = counts / counts.sum(1, keepdims=True)
    width = np.maximum(1, np.floor(share * (TOTAL - SYMBOLS))).astype(np.int64)
    width[:, MIDDLE] += TOTAL - width.sum(1)
    model.cumulative[:, 1:] = np.cumsum(width, axis=1)


def _log(x: I64, logs: I64) -> I64:
    x, more = x.copy(), np.zeros_like(x)
    while (large := x >= LOGS).any():
        x = np.where(large, x >> 1, x)
        more += 16 * large
    return logs[x] + more


def _scaled(a: I64, b: I64 | int, c: I64 | int) -> I64:
    return np.sign(a) * (np.abs(a) * b // c)


def _run(model: Model, kind: int, frames: Frames) -> tuple[I64, I64, I64, I64]:
    """What the kernels do, over all frames at once: what is left (n, NUMBERS), features (n, NUMBERS, 6), expected size,
    and what the partners do not know yet."""
    n = len(frames.values)
    low, high = scale()[1:]
    span, far = np.maximum(frames.span, 1), np.clip(frames.distance, 1, 32) - 1
    reach = np.minimum(frames.distance, 2 * span)
    features = np.zeros((n, NUMBERS, 6), np.int64)
    left, rest, about = (np.zeros((n, NUMBERS), np.int64) for _ in range(3))
    sizes = np.zeros((n, NUMBERS), np.int64)
    groups, everything = np.zeros((n, GROUPS), np.int64), np.zeros(n, np.int64)
    near = near_2 = np.zeros(n, np.int64)
    for c in range(NUMBERS):
        p, g, f = model.partner[c], GROUP_OF[c], features[:, c]
        expected = np.full(n, model.mean[c]) if kind == FULL else frames.reference[:, c]
        if kind == AFTER_CHANGE:
            expected = expected + _scaled(frames.change[:, c], model.go_on[c] * reach, 256 * span)
            f[:, 4] = _log(np.abs(_scaled(frames.change[:, c], reach, span)), model.logs)
        rest[:, c] = frames.values[:, c] - expected
        if p >= 0:
            share = int(model.follow[kind, c])
            expected = expected + int(np.sign(share)) * _scaled(rest[:, p], abs(share), 256)
            f[:, 5] = _log(sizes[:, p], model.logs)
        for row, seen in enumerate((near, near_2, groups[:, g] >> 4, everything >> 4)):
            f[:, row] = _log(seen, model.logs)
        about[:, c] = model.bias[kind, c] + model.age[kind, g][far] + f @ model.weights[kind, :, g]
        left[:, c] = frames.values[:, c] - np.clip(expected, low[c], high[c])
        sizes[:, c] = np.minimum(np.abs(left[:, c]), 4095)
        near, near_2 = sizes[:, c], near
        groups[:, g] += ((near << 6) - groups[:, g]) >> 1
        everything = everything + (((near << 6) - everything) >> 3)
    return left, features, about, rest


def main() -> None:
    """Learn from the second half of the recordings and from made-up people, and write the file named."""
    learnt = [stream for recorded in HALVES[1] for _, stream in streams(recorded)]
    learnt += [stream for seed in (11, 12) for _, stream in seated(seed, 20.0, "made up")]
    model = learn(learnt)
    numbers = {name: getattr(model, name).tolist() for name in Model._fields}
    rows = [f'"{name}": {json.dumps(value, separators=(",", ":"))}' for name, value in numbers.items()]
    Path(sys.argv[1]).write_text("{\n" + ",\n".join(rows) + "\n}\n", "ascii")


if __name__ == "__main__":
    main()
