"""Trains the net: cross entropy of states, Adam, one pass after the other over shuffled frames. NumPy, one thread."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scripts.speech_model.frames import Session
from vistel.arrays import F32
from vistel.speech.acoustic import AcousticModel
from vistel.speech.confidence import FEATURES
from vistel.speech.features import BANDS

OFFSETS = (-29, -24, -20, -16, -13, -11, *range(-9, 8))
"""Frames the net sees: what was before and how the room sounds is seen coarsely, what comes only for 70 ms."""
HIDDEN = (896, 640, 384)
_BATCH = 1024
_PACE = 1.5e-3
_MOST_PACE = 200
"""Steps until which the pace rises."""
_MEMORY, _MEMORY_OF_SQUARES = np.float32(0.1), np.float32(0.01)


class Frames:
    """All frames of all sessions in one array, quiet between them, so that no window crosses sessions.

    values: (rows, BANDS) not scaled; states: (rows,), -1 where nothing is to be learnt; known: rows where something is.
    """

    def __init__(self, sessions: Sequence[Session]) -> None:
        before, after = -OFFSETS[0], OFFSETS[-1]
        rows = sum(len(s.frames) + before + after for s in sessions)
        self.values = np.zeros((rows, BANDS), np.float32)
        self.states = np.full(rows, -1, np.int16)
        at = 0
        for each in sessions:
            at += before
            self.values[at : at + len(each.frames)] = each.frames
            self.states[at : at + len(each.frames)] = each.states
            at += len(each.frames) + after
        self.known = np.flatnonzero(self.states >= 0)


def fresh(
    random: np.random.Generator,
    frames: Frames,
    start_mean: F32,
    stay: F32,
    phones: tuple[str, ...],
    offsets: tuple[int, ...] = OFFSETS,
    hidden: tuple[int, ...] = HIDDEN,
) -> AcousticModel:
    """A net of random weights, with the spread and the priors of the frames."""
    spread = frames.values[frames.known].std(0)
    counts = np.bincount(frames.states[frames.known], minlength=len(stay)) + 1.0
    widths = [len(offsets) * BANDS, *hidden, len(stay)]
    weights = [(random.standard_normal((a, b)) * np.sqrt(2.0 / a)).astype(np.float32) for a, b in pairwise(widths)]
    weights[-1] *= np.float32(0.3)
    biases = tuple(np.zeros(b, np.float32) for b in widths[1:])
    prior = np.log(counts / counts.sum()).astype(np.float32)
    scale = (1.0 / spread).astype(np.float32)
    return AcousticModel(phones, offsets, start_mean, scale, tuple(weights), biases, prior, stay, np.zeros(FEATURES, np.float32))


def train(
    random: np.random.Generator,
    model: AcousticModel,
    rounds: Iterable[Frames],
    count: int,
    share: float,
    tell: Callable[[str], None],
) -> AcousticModel:
    """The model after `count` rounds, the steps getting smaller; `tell` hears how it goes.

    share: of the frames of each round that are learnt from: those beside them tell nearly the same.
    """
    parameters = [*(w.copy() for w in model.weights), *(b.copy() for b in model.biases)]
    first = [np.zeros_like(p) for p in parameters]
    second = [np.zeros_like(p) for p in parameters]
    step = 0
    began = time.monotonic()
    for number, frames in enumerate(rounds):
        values = frames.values * model.scale
        order = random.permutation(frames.known)[: int(share * len(frames.known))]
        steps = len(order) // _BATCH
        loss, right = 0.0, 0
        for k in range(steps):
            step += 1
            at = order[k * _BATCH : (k + 1) * _BATCH]
            x = model.windows(values, at).reshape(_BATCH, -1)
            gradient, cost, hits = _gradient(parameters, len(model.weights), x, frames.states[at])
            loss, right = loss + cost, right + hits
            done = (number + k / steps) / count
            pace = _PACE * (0.5 + 0.5 * np.cos(np.pi * done)) * min(1.0, step / _MOST_PACE)
            _adam(parameters, gradient, first, second, step, pace)
        seen, spent = steps * _BATCH, (time.monotonic() - began) / 60.0
        tell(f"round {number + 1} of {count}, {spent:.1f} min: loss {loss / seen:.4f}, {100.0 * right / seen:.1f} % right")
    layers = len(model.weights)
    return replace(model, weights=tuple(parameters[:layers]), biases=tuple(parameters[layers:]))


def _adam(parameters: list[F32], gradient: list[F32], first: list[F32], second: list[F32], step: int, pace: float) -> None:
    """Changes parameters and both means in place; `gradient` is used up."""
    usual = np.float32(pace * np.sqrt(1.0 - 0.99**step) / (1.0 - 0.9**step))
    for k, g in enumerate(gradient):
        first[k] += _MEMORY * (g - first[k])
        np.multiply(g, g, out=g)
        second[k] += _MEMORY_OF_SQUARES * (g - second[k])
        change = np.sqrt(second[k], out=g)
        change += np.float32(1e-8)
        np.divide(first[k], change, out=change)
        change *= usual
        parameters[k] -= change


def _gradient(parameters: list[F32], layers: int, x: F32, states: NDArray[np.int16]) -> tuple[list[F32], float, int]:
    """Of the mean cross entropy: gradients in the order of the parameters; its sum; how many frames are right."""
    weights, biases = parameters[:layers], parameters[layers:]
    inputs = [x]
    for weight, bias in zip(weights[:-1], biases[:-1], strict=True):
        y = inputs[-1] @ weight
        y += bias
        inputs.append(np.maximum(y, 0.0, out=y))
    y = inputs[-1] @ weights[-1] + biases[-1]
    y -= y.max(1, keepdims=True)
    np.exp(y, out=y)
    y /= y.sum(1, keepdims=True)
    rows = np.arange(len(y))
    cost = float(-np.log(y[rows, states] + 1e-12).sum())
    hits = int((y.argmax(1) == states).sum())
    y[rows, states] -= 1.0
    y /= len(y)
    of_weights: list[F32] = []
    of_biases: list[F32] = []
    for k in reversed(range(layers)):
        of_weights.append(inputs[k].T @ y)
        of_biases.append(y.sum(0))
        if k:
            y = y @ weights[k].T
            y *= inputs[k] > 0
    return of_weights[::-1] + of_biases[::-1], cost, hits
