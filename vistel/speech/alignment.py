"""The time of each phone in speech whose phones are known (forced alignment)."""

from collections.abc import Sequence

import numpy as np

from vistel.arrays import F32, I32
from vistel.speech.acoustic import state_of


def chain_of(phones: Sequence[str], known: Sequence[str]) -> tuple[I32, I32]:
    """(state, phone) of every step through the phones, one after the other; known: all phones of the model, the pause first."""
    states: list[int] = []
    owner: list[int] = []
    for i, phone in enumerate(phones):
        number = known.index(phone)
        for part in (0.0,) if number == 0 else (0.0, 0.5):
            states.append(state_of(number, part))
            owner.append(i)
    return np.array(states, np.int32), np.array(owner, np.int32)


def align(scores: F32, states: I32) -> tuple[I32, float]:
    """The step of the chain `states` at each frame of `scores` (frames, STATES), by the best path through all of them;
    and the mean score of a frame along it, minus infinity where there are fewer frames than steps."""
    count = len(states)
    best = np.full(count, -np.inf, np.float32)
    if len(scores) < count:
        return np.zeros(0, np.int32), -np.inf
    best[0] = scores[0, states[0]]
    moved = np.zeros((len(scores), count), bool)
    for t in range(1, len(scores)):
        before = np.concatenate([[np.float32(-np.inf)], best[:-1]])
        moved[t] = before > best
        best = np.maximum(best, before) + scores[t, states]
    path = np.zeros(len(scores), np.int32)
    step = count - 1
    for t in range(len(scores) - 1, -1, -1):
        path[t] = step
        step -= int(moved[t, step])
    return path, float(best[-1]) / len(scores)
