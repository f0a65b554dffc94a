"""Trains the net: cross entropy of states, Adam, one pass after the other over shuffled frames. NumPy, one thread."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scripts.speech_model.frames import Session
from vistel.speech.acoustic import FUTURE, PAST, STATES, Model
from vistel.speech.features import BANDS

F32 = NDArray[np.float32]
HIDDEN = (512, 384, 256)
_BATCH = 1024
RATE = 2.0e-3
_DROP = 0.05


class Frames:
    """All frames of all sessions in one array, quiet between them, so that no window crosses sessions."""

    def __init__(self, sessions: Sequence[Session]) -> None:
        rows = sum(len(s.frames) + PAST + FUTURE for s in sessions)
        self.values = np.zeros((rows, BANDS), np.float16)
        states = np.full(rows, -1, np.int16)
        at = 0
        for each in sessions:
            at += PAST
            self.values[at : at + len(each.frames)] = each.frames
            states[at : at + len(each.frames)] = each.states
            at += len(each.frames) + FUTURE
        self.known = np.flatnonzero(states >= 0)
        self.states = states

    def windows(self, at: NDArray[np.int64], scale: F32) -> F32:
        index = at[:, None] + np.arange(-PAST, FUTURE + 1)
        return (self.values[index].astype(np.float32) * scale).reshape(len(at), -1)


def fresh(random: np.random.Generator, frames: Frames, start_mean: F32, stay: F32) -> Model:
    """A net of random weights, with the spread and the priors of the frames."""
    spread = frames.values[frames.known].astype(np.float32).std(0)
    counts = np.bincount(frames.states[frames.known], minlength=STATES) + 1.0
    widths = [(PAST + 1 + FUTURE) * BANDS, *HIDDEN, STATES]
    weights = tuple(
        (random.standard_normal((a, b)) * np.sqrt(2.0 / a)).astype(np.float32) for a, b in pairwise(widths)
    )
    biases = tuple(np.zeros(b, np.float32) for b in widths[1:])
    prior = np.log(counts / counts.sum()).astype(np.float32)
    return Model(start_mean, (1.0 / spread).astype(np.float32), weights, biases, prior, stay, np.zeros(4, np.float32))


def train(
    random: np.random.Generator, model: Model, rounds: Iterable[Frames], count: int, tell: Callable[[str], None], rate: float = RATE
) -> Model:
    """The model after one pass over each of `count` rounds, the steps getting smaller; `tell` hears how it goes."""
    parameters = [*(w.copy() for w in model.weights), *(b.copy() for b in model.biases)]
    first = [np.zeros_like(p) for p in parameters]
    second = [np.zeros_like(p) for p in parameters]
    step = 0
    for number, frames in enumerate(rounds):
        order = random.permutation(frames.known)
        steps = len(order) // _BATCH
        loss, right, seen = 0.0, 0, 0
        for k in range(steps):
            step += 1
            at = order[k * _BATCH : (k + 1) * _BATCH]
            x = frames.windows(at, model.scale)
            gradient, cost, hits = _gradient(random, parameters, len(model.weights), x, frames.states[at])
            loss, right, seen = loss + cost, right + hits, seen + len(at)
            done = (number + k / steps) / count
            pace = rate * (0.5 + 0.5 * np.cos(np.pi * done)) * min(1.0, step / 200.0)
            _adam(parameters, gradient, first, second, step, pace)
            if k % 200 == 199 or k == steps - 1:
                tell(f"{100.0 * done:.1f} %: loss {loss / seen:.3f}, {100.0 * right / seen:.1f} % of frames right")
                loss, right, seen = 0.0, 0, 0
    layers = len(model.weights)
    return replace(model, weights=tuple(parameters[:layers]), biases=tuple(parameters[layers:]))


def _adam(parameters: list[F32], gradient: list[F32], first: list[F32], second: list[F32], step: int, pace: float) -> None:
    for k, g in enumerate(gradient):
        first[k] += np.float32(0.1) * (g - first[k])
        second[k] += np.float32(0.01) * (g * g - second[k])
        spread = np.sqrt(second[k] / np.float32(1 - 0.99**step)) + np.float32(1e-8)
        parameters[k] -= np.float32(pace / (1 - 0.9**step)) * first[k] / spread


def _gradient(
    random: np.random.Generator, parameters: list[F32], layers: int, x: F32, states: NDArray[np.int16]
) -> tuple[list[F32], float, int]:
    weights, biases = parameters[:layers], parameters[layers:]
    inputs = [x]
    for weight, bias in zip(weights[:-1], biases[:-1], strict=True):
        y = inputs[-1] @ weight
        y += bias
        np.maximum(y, 0.0, out=y)
        y *= (random.random(y.shape[1], np.float32) >= _DROP) / np.float32(1.0 - _DROP)
        inputs.append(y)
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
            y = (y @ weights[k].T) * (inputs[k] > 0)
            y /= np.float32(1.0 - _DROP)
    return of_weights[::-1] + of_biases[::-1], cost, hits
