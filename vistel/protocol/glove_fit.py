"""Calibrates a glove from four hand shapes held still: open, fist, spread, pinch.

Between a flat hand and a fist each flexion sensor is linear; between a flat and a spread hand each abduction sensor is, less
what bending alone does to it (seen in the fist, whose fingers lie side by side); the pinch turns the thumb's roll.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vistel.protocol.cyberglove import SENSORS, SENSORS_22
from vistel.protocol.glove_calibration import GloveCalibration, GloveCalibrationError, default_calibration

HANDS: tuple[tuple[str, str], ...] = (
    ("open", "Hold the hand flat, fingers together, thumb along the index finger."),
    ("fist", "Make a tight fist, thumb over the fingers."),
    ("spread", "Hold the hand flat and spread fingers and thumb as far as they go."),
    ("pinch", "Touch the tip of the thumb with the tip of the index finger, other fingers relaxed."),
)
"""Name and instruction of each hand shape, in this order."""
HOLD_S = 3.0

FIST_DEG = {"thumb_mpj": 45.0, "thumb_ij": 60.0} | {
    f"{finger}_{joint}": angle
    for finger in ("index", "middle", "ring", "pinky")
    for joint, angle in (("mpj", 80.0), ("pij", 100.0), ("dij", 65.0))
}
"""Flexions in a tight fist; in a flat hand they are 0."""
SPREAD_DEG = {"middle_index_abduction": 17.0, "ring_middle_abduction": 13.0, "pinky_ring_abduction": 17.0, "thumb_abduction": 50.0}
PINCH_ROLL_DEG = 55.0

_STILL_COUNTS = 4.0
_LEAST_COUNTS = {"flexion": 12.0, "abduction": 4.0}
_COUPLED = (
    ("middle_index_abduction", "index_mpj", "middle_mpj"),
    ("ring_middle_abduction", "middle_mpj", "ring_mpj"),
    ("pinky_ring_abduction", "ring_mpj", "pinky_mpj"),
)


@dataclass(frozen=True)
class Hold:
    """A hand held still. counts: medians of the samples `begin` to `end`, without `end`."""

    begin: int
    end: int
    counts: tuple[float, ...]


@dataclass(frozen=True)
class GloveFit:
    """A calibration. notes: one line for each sensor that keeps its default values, and why."""

    calibration: GloveCalibration
    notes: tuple[str, ...]


def find_holds(times_s: Sequence[float], samples: Sequence[Sequence[int]], still: float = _STILL_COUNTS) -> list[Hold]:
    """The hands held still for half of HOLD_S or longer, in order, each different from the one before.
    Raises GloveCalibrationError where they are fewer than HANDS."""
    spans: list[list[int]] = []
    begin = 0
    middle: tuple[float, ...] = ()
    for k, sample in enumerate(samples):
        if k == begin:
            middle = tuple(float(v) for v in sample)
        elif max(abs(v - m) for v, m in zip(sample, middle, strict=True)) > still:
            begin = k
            middle = tuple(float(v) for v in sample)
        if times_s[k] - times_s[begin] >= 0.5 * HOLD_S:
            if spans and spans[-1][0] == begin:
                spans[-1][1] = k
            else:
                spans.append([begin, k])
    found = [Hold(a, b + 1, _medians(samples[a : b + 1])) for a, b in spans]
    apart: list[Hold] = []
    for hold in found:
        if not apart or max(abs(a - b) for a, b in zip(hold.counts, apart[-1].counts, strict=True)) > 2.0 * still:
            apart.append(hold)
        else:
            apart[-1] = hold
    if len(apart) < len(HANDS):
        names = ", ".join(name for name, _ in HANDS)
        raise GloveCalibrationError(
            f"{len(apart)} hands held still were found, {len(HANDS)} are needed ({names}, each for {HOLD_S:.0f} s); record again"
        )
    return apart


def fit_among(holds: Sequence[Hold], base: GloveCalibration | None = None) -> tuple[GloveFit, Sequence[Hold]]:
    """The best fit of four hands that follow one another among `holds`, and these: a hand at rest may come before or after.

    Raises GloveCalibrationError where no four fit.
    """
    best: tuple[GloveFit, Sequence[Hold]] | None = None
    fault = GloveCalibrationError("expected four hands")
    for k in range(len(holds) - len(HANDS) + 1):
        four = holds[k : k + len(HANDS)]
        try:
            fit = fit_glove([hold.counts for hold in four], base)
        except GloveCalibrationError as e:
            fault = e
            continue
        if best is None or len(fit.notes) < len(best[0].notes):
            best = fit, four
    if best is None:
        raise fault
    return best


def fit_glove(hands: Sequence[Sequence[float]], base: GloveCalibration | None = None) -> GloveFit:
    """From the counts of the four hands, in the order of HANDS, of a glove with 18 or 22 sensors. Raises GloveCalibrationError."""
    names: tuple[str, ...] | None = SENSORS.get(len(hands[0]))
    every: tuple[str, ...] = SENSORS_22
    if len(hands) != len(HANDS) or names is None or any(len(h) != len(names) for h in hands):
        raise GloveCalibrationError("expected four hands of 18 or 22 sensors")
    table: list[dict[str, float]] = [dict(zip(names, h, strict=True)) for h in hands]
    opened, fist, spread, pinch = table
    base = base or default_calibration()
    offset: dict[str, float] = dict(zip(every, base.offset, strict=True))
    gain: dict[str, float] = dict(zip(every, base.gain, strict=True))
    flexed = [n for n in FIST_DEG if n in opened]
    risen = sum(fist[n] > opened[n] for n in flexed)
    if risen < len(flexed) / 2:
        raise GloveCalibrationError("the second hand is straighter than the first: open and fist were exchanged; begin again")
    notes: list[str] = []
    for n in flexed:
        moved = fist[n] - opened[n]
        if moved < _LEAST_COUNTS["flexion"]:
            notes.append(f"{n} rose by {moved:.0f} counts only from open to fist: kept as it was; close the fist fully")
            continue
        offset[n], gain[n] = opened[n], math.radians(FIST_DEG[n]) / moved
    if len(notes) > len(flexed) / 2:
        raise GloveCalibrationError("most sensors did not move between open and fist; is the glove plugged in and well on?")
    flexion = {n: gain[n] * (fist[n] - offset[n]) for n in flexed}
    coupling = [0.0, 0.0, 0.0]
    for n, angle in SPREAD_DEG.items():
        moved = spread[n] - opened[n]
        if abs(moved) < _LEAST_COUNTS["abduction"]:
            notes.append(f"{n} moved by {moved:.0f} counts only from open to spread: kept as it was; spread the fingers more")
            continue
        offset[n], gain[n] = opened[n], math.radians(angle) / moved
        for k, (sensor, a, b) in enumerate(_COUPLED):
            if n == sensor:
                seen = gain[n] * (fist[n] - offset[n])
                coupling[k] = min(0.9, max(-0.9, seen / (0.5 * (flexion[a] + flexion[b]))))
    turned = pinch["thumb_roll"] - opened["thumb_roll"]
    if abs(turned) < _LEAST_COUNTS["flexion"]:
        notes.append(f"thumb_roll moved by {turned:.0f} counts only from open to pinch: kept as it was")
    else:
        offset["thumb_roll"], gain["thumb_roll"] = opened["thumb_roll"], math.radians(PINCH_ROLL_DEG) / turned
    ratio = base.distal_ratio
    if "index_dij" not in opened:
        # Nothing measures the end joints: a fist's own proportion.
        ratio = FIST_DEG["index_dij"] / FIST_DEG["index_pij"]
    return GloveFit(
        GloveCalibration(
            tuple(offset[n] for n in every), tuple(gain[n] for n in every), ratio, (coupling[0], coupling[1], coupling[2])
        ),
        tuple(notes),
    )


def _medians(samples: Sequence[Sequence[int]]) -> tuple[float, ...]:
    return tuple(float(sorted(column)[len(column) // 2]) for column in zip(*samples, strict=True))
