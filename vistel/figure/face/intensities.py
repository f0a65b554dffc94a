"""Intensities of action units: from the 13 marks, or from a voice: its visemes, or its loudness alone."""

import math

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.audio.heard_voices import Speech
from vistel.audio.visemes import VISEMES
from vistel.figure.face.marks import MARK_COUNT, MARK_INDEX, REST
from vistel.figure.face.rules import FaceRules
from vistel.jit.kernel_jit import compiled

WORTH_M = 0.0016
"""A unit, or a unit with its twin on the other side, must explain more than this of the marks' motion to be there."""
MOST_ROUNDS = 7
"""Rounds in which a unit enters, at most."""
SWEEPS = 40
"""Sweeps of coordinate descent in each round."""
FAR_M = 0.06
"""A mark farther than this from its rest is ignored."""


class MarkReader:
    """From marks to units: bounded least squares over few of them. In each round the unit that explains most of the remaining
    motion is added, alone or with its twin, because faces are mostly symmetric; then all added units are fitted anew."""

    def __init__(self, rules: FaceRules) -> None:
        self.rules = rules
        self._patterns = np.array([u.pattern.ravel() for u in rules.units]).T
        self._most = np.array([u.unit.most if u.unit.marks else 0.0 for u in rules.units])
        self._size = np.linalg.norm(self._patterns, axis=0)
        place = {u.name: k for k, u in enumerate(rules.units)}
        self._twin = np.array([place[f"right_{u.unit.name}"] if u.side > 0 else -1 for u in rules.units])

    def strongest(self, intensity: F64) -> int | None:
        """The unit that moves the marks most; None where none does."""
        moves = intensity * self._size
        return int(np.argmax(moves)) if moves.any() else None

    def read(self, marks: F64, seen: NDArray[np.bool_] | None = None) -> tuple[F64, F64]:
        """(K,) intensities, and (13, 2) how far the marks are from their rest [m], NaN where that is not known. marks: (13, 2)
        [m], laid over the standard face as a calibration does; those that are not finite, far off or not `seen` count for
        nothing."""
        moved = np.asarray(marks, np.float64).reshape(MARK_COUNT, 2) - REST
        good = np.isfinite(moved).all(axis=1) & (np.abs(np.nan_to_num(moved)).max(axis=1) < FAR_M)
        if seen is not None:
            good &= seen
        weight = np.repeat(good.astype(np.float64), 2)
        d = np.where(weight > 0.0, np.nan_to_num(moved).ravel(), 0.0)
        p = self._patterns * weight[:, None]
        gram, drive = p.T @ p, p.T @ d
        out = np.zeros(len(self._most))
        _explain(gram, drive, self._most, self._twin, WORTH_M * WORTH_M, out)
        moved[~good] = np.nan
        return out, moved


@compiled
def _explain(gram: F64, drive: F64, most: F64, twin: NDArray[np.int64], worth: float, out: F64) -> None:
    """Bounded least squares, in which a unit, or it and its `twin` (-1: it has none), enters only if it takes `worth` off the sum
    of squares."""
    count = len(out)
    active = np.zeros(count, np.bool_)
    slope = drive.copy()
    for _ in range(MOST_ROUNDS):
        best, other, gain = -1, -1, worth
        for k in range(count):
            if most[k] <= 0.0 or gram[k, k] <= 1e-12:
                continue
            if not active[k]:
                by = min(most[k], max(0.0, slope[k] / gram[k, k]))
                less = by * (2.0 * slope[k] - by * gram[k, k])
                if less > gain:
                    best, other, gain = k, -1, less
            j = twin[k]
            if j >= 0 and gram[j, j] > 1e-12 and not (active[k] and active[j]):
                steep, square = slope[k] + slope[j], gram[k, k] + 2.0 * gram[k, j] + gram[j, j]
                by = min(most[k], max(0.0, steep / square))
                less = by * (2.0 * steep - by * square)
                if less > gain:
                    best, other, gain = k, j, less
        if best < 0:
            break
        active[best] = True
        if other >= 0:
            active[other] = True
        for _ in range(SWEEPS):
            for k in range(count):
                if active[k]:
                    new = min(most[k], max(0.0, out[k] + slope[k] / gram[k, k]))
                    by = new - out[k]
                    if by != 0.0:
                        out[k] = new
                        for j in range(count):
                            slope[j] -= by * gram[k, j]


QUIET_DB = -48.0
"""Level of a voice up to which the mouth stays closed [dBFS]."""
LOUD_DB = -20.0
"""Level from which it opens as far as speech opens it [dBFS]."""
SYLLABLES_HZ = 4.3
_SHUTS = "AU8"
"""Lifts the lower lip to the upper one, from where the others leave it."""
SOFTLY = 0.6
"""How far a mouth opens that speaks as softly as can be, of one that speaks loudly."""


def by_visemes(rules: FaceRules, speech: Speech) -> F64:
    """(K,) intensities of a mouth in the shapes that a voice was heard to make, wider the louder it is."""
    weights = np.zeros(len(VISEMES)) if speech.visemes is None else speech.visemes
    out = (SOFTLY + (1.0 - SOFTLY) * _loud(speech.level_db)) * (weights @ rules.visemes)
    if _SHUTS in rules.names:
        shuts, lips = rules.names.index(_SHUTS), np.array([u.pattern[MARK_INDEX["lower_lip"], 1] for u in rules.units])
        opened = out[shuts] * lips[shuts] - out @ lips
        out[shuts] = min(out[shuts], max(0.0, opened) / lips[shuts])
    return out


def _loud(level_db: float) -> float:
    return min(1.0, max(0.0, (level_db - QUIET_DB) / (LOUD_DB - QUIET_DB)))


def by_loudness(rules: FaceRules, level_db: float, t_s: float) -> F64:
    """(K,) intensities of a mouth that speaks at this loudness: the jaw opens and closes at the rate of syllables, the lips round
    now and then. t_s: time, so that the same log gives the same picture."""
    out = np.zeros(len(rules.units))
    if not math.isfinite(level_db) or level_db <= QUIET_DB:
        return out
    loud = _loud(level_db)
    beat = 0.5 - 0.5 * math.cos(2.0 * math.pi * SYLLABLES_HZ * t_s + 1.3 * math.sin(2.0 * math.pi * 0.9 * t_s))
    slow = 0.5 + 0.5 * math.sin(2.0 * math.pi * 0.63 * t_s)
    names = rules.names
    moves = {"AU26": 0.34 * loud * beat, "AU18": 0.3 * loud * slow * (1.0 - beat), "AU22": 0.2 * loud * slow * beat}
    for name, value in moves.items():
        if name in names:
            out[names.index(name)] = value
    return out
