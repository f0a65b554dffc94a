"""One person's face from picture to picture: marks where they are seen, visemes or loudness where only the voice is known, else
rest."""

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.audio.heard_voices import Speech
from vistel.figure.face.intensities import MarkReader, by_loudness, by_visemes
from vistel.figure.face.marks import MARK_COUNT, MARK_INDEX
from vistel.figure.face.rules import FaceRules, builtin_rules
from vistel.figure.face.shape import Expression
from vistel.figure.posture.posture import Posture

SOON_S = 0.02
"""Time constant with which a face follows marks that are seen [s]."""
SPEAKS_S = 0.01
"""Time constant with which a mouth follows visemes [s]."""
EASE_S = 0.35
"""Time constant with which it goes back to rest when they are lost, and comes from there when they are found again [s]."""
PARTED_M = 0.006
"""Between the lips: fully parted."""


@dataclass(frozen=True)
class FaceState:
    """expression: for `FaceShape`; actions: intensities by name, of both sides the larger one under the bare name: for wrinkles."""

    expression: Expression
    actions: dict[str, float]


class Countenance:
    """Keeps the last state of a face. Time is an argument."""

    def __init__(self, rules: FaceRules | None = None) -> None:
        self.rules = builtin_rules() if rules is None else rules
        self._reader = MarkReader(self.rules)
        self._patterns = np.array([u.pattern for u in self.rules.units])
        self._kept = np.zeros(len(self.rules.units))
        self._marks = np.zeros((MARK_COUNT, 2))
        self._lids = np.ones(2)
        self._trust = 0.0
        self._at_ns: int | None = None

    def step(self, posture: Posture, at_ns: int | None = None, speech: Speech | None = None) -> FaceState:
        """The face at `at_ns` (None: at once as it should be). speech: the voice that belongs to it; None: it is silent."""
        seconds = math.inf if at_ns is None else 0.0 if self._at_ns is None else max(0.0, (at_ns - self._at_ns) * 1e-9)
        if self._at_ns is None:
            seconds = math.inf
        self._at_ns = at_ns
        seen = posture.face is not None and bool(np.isfinite(posture.face).any())
        if seen and posture.face is not None:
            target, moved = self._reader.read(posture.face)
            # The place of a mark that is not seen follows from the others.
            marks = np.where(np.isfinite(moved), moved, np.tensordot(target, self._patterns, 1))
        else:
            target = np.zeros(len(self._kept))
            if speech is not None and speech.visemes is not None:
                target = by_visemes(self.rules, speech)
            elif speech is not None and at_ns is not None:
                target = by_loudness(self.rules, speech.level_db, (at_ns % 3_600_000_000_000) * 1e-9)
            marks = np.tensordot(target, self._patterns, 1)
        # A face that is found again is eased in, then followed without delay.
        self._trust += ((1.0 if seen else 0.0) - self._trust) * _share(seconds, EASE_S)
        spoken = speech is not None and speech.visemes is not None
        if spoken and not seen:
            after = SPEAKS_S
        else:
            after = SOON_S if seen and self._trust > 0.9 else 0.12 if seen or speech is not None else EASE_S
        share = _share(seconds, after)
        self._kept = self._kept + share * (target - self._kept)
        self._marks = self._marks + share * (marks - self._marks)
        lids = np.ones(2) if posture.lids is None else np.clip(np.nan_to_num(posture.lids, nan=1.0), 0.0, 2.0)
        self._lids = self._lids + _share(seconds, SOON_S if posture.lids is not None else EASE_S) * (lids - self._lids)
        kept = np.where(self._kept > 2e-3, self._kept, 0.0)
        expression = Expression(
            kept, self._marks if np.abs(self._marks).max() > 2e-4 else None, _opening(self._lids), float(posture.gaze[1])
        )
        return FaceState(expression, self._actions(kept))

    def _actions(self, kept: F64) -> dict[str, float]:
        out: dict[str, float] = {}
        for u, value in zip(self.rules.units, kept.tolist(), strict=True):
            if value > 0.0:
                out[u.name] = value
                out[u.unit.name] = max(out.get(u.unit.name, 0.0), value)
        for side, lid in zip(("left", "right"), self._lids.tolist(), strict=True):
            if lid < 0.98:
                out[f"{side}_AU45"] = 1.0 - lid
        parted = self._marks[MARK_INDEX["upper_lip"], 1] - self._marks[MARK_INDEX["lower_lip"], 1]
        if parted > 5e-4:
            out["AU25"] = min(1.0, float(parted) / PARTED_M)
        return out


def _share(seconds: float, after: float) -> float:
    return 1.0 - math.exp(-seconds / after) if math.isfinite(seconds) else 1.0


def _opening(lids: F64) -> tuple[float, float]:
    # What is within noise of open is open: nothing needs to move.
    left, right = (1.0 if abs(x - 1.0) < 0.02 else float(x) for x in lids)
    return left, right
