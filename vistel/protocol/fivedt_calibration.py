"""From a 5DT glove's counts to the angles of a hand, and back for a simulated glove.

A user shows two hands: *open*, flat with the fingers spread, and *fist*. Between them each sensor is taken as linear.
The 20 angles are those of `vistel.protocol.glove_calibration`. What the glove does not measure is estimated: end joints
follow middle joints; on a glove with five sensors, each of which bends with a finger's first two joints, these share
the bend in the proportion of their ranges.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vistel.protocol.fivedt import SLOTS, SLOTS_5
from vistel.protocol.glove_calibration import ANGLE_COUNT, GloveCalibrationError

_FINGERS = {"index": 4, "middle": 8, "ring": 12, "little": 16}
_NEAR = math.radians(85.0)
"""Bend of a finger's first joint in a fist [rad]."""
_FAR = math.radians(100.0)
"""Bend of a finger's middle joint in a fist [rad]."""
_THUMB_NEAR = math.radians(50.0)
"""Bend of the thumb's middle joint in a fist [rad]."""
_THUMB_FAR = math.radians(70.0)
"""Bend of the thumb's end joint in a fist [rad]."""
_THUMB_SPREAD = math.radians(45.0)
"""Angle between thumb and index finger in an open hand [rad]."""
_FINGER_SPREAD = math.radians(15.0)
"""Angle between two fingers in an open hand [rad]."""
_LEAST = 0.02
"""A sensor that moves less from open hand to fist, as a share of a typical hand's range, is not worn."""
_BEYOND = 0.15
"""A hand may open or close farther than when it was measured, by this share of the range."""


def _joints() -> dict[str, tuple[int, float]]:
    """For each flexion sensor: index of the angle it measures, and that angle in a fist [rad]; in an open hand it is 0."""
    table = {"thumb_near": (2, _THUMB_NEAR), "thumb_far": (3, _THUMB_FAR)}
    for finger, base in _FINGERS.items():
        table |= {f"{finger}_near": (base, _NEAR), f"{finger}_far": (base + 2, _FAR)}
    return table


_JOINTS = _joints()
_SPREADS = {
    "thumb_index": _THUMB_SPREAD,
    "index_middle": _FINGER_SPREAD,
    "middle_ring": _FINGER_SPREAD,
    "ring_little": _FINGER_SPREAD,
}
"""For each spread sensor: its angle in an open hand [rad]; in a fist it is 0."""


@dataclass(frozen=True)
class FiveDtCalibration:
    """open, fist: counts by sensor; distal_ratio: end flexion / middle flexion."""

    open: Mapping[str, float]
    fist: Mapping[str, float]
    distal_ratio: float = 2.0 / 3.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.distal_ratio):
            raise GloveCalibrationError("distal_ratio: expected a finite number")
        for name in SLOTS:
            a, b = self.open[name], self.fist[name]
            if not (math.isfinite(a) and math.isfinite(b)) or abs(a - b) < 1.0:
                raise GloveCalibrationError(f"{name}: expected open and fist to differ, got {a:g} and {b:g}")

    def angles(self, values: Sequence[int], sensors: int) -> list[float]:
        """(20,) radians from the 16 slots of a glove with 14 or 5 sensors, or from five values."""
        slots = dict(zip(SLOTS_5 if len(values) == 5 else SLOTS, values, strict=False))
        out = [0.0] * ANGLE_COUNT
        for name, (angle, at_fist) in _JOINTS.items():
            measured = name if sensors != 5 else name.replace("_far", "_near")
            out[angle] = self._closed(measured, slots[measured]) * at_fist
        for base in _FINGERS.values():
            out[base + 3] = self.distal_ratio * out[base + 2]
        if sensors != 5:
            spread = {name: (1.0 - self._closed(name, slots[name])) * most for name, most in _SPREADS.items()}
            out[1] = spread["thumb_index"]
            out[5] = spread["index_middle"]
            out[13] = -spread["middle_ring"]
            out[17] = out[13] - spread["ring_little"]
        return out

    def counts(self, angles: Sequence[float], sensors: int) -> list[float]:
        """The counts of a glove's 16 slots for 20 angles [rad], not rounded; 0 for slots without a sensor."""
        spread = {
            "thumb_index": angles[1],
            "index_middle": angles[5] - angles[9],
            "middle_ring": angles[9] - angles[13],
            "ring_little": angles[13] - angles[17],
        }
        closed = {name: angles[angle] / at_fist for name, (angle, at_fist) in _JOINTS.items()}
        if sensors == 5:
            for name in SLOTS_5:
                near, far = _JOINTS[name], _JOINTS[name.replace("_near", "_far")]
                closed[name] = (angles[near[0]] + angles[far[0]]) / (near[1] + far[1])
        closed |= {name: 1.0 - spread[name] / most for name, most in _SPREADS.items()}
        there = SLOTS_5 if sensors == 5 else SLOTS
        out = [self.open[n] + closed[n] * (self.fist[n] - self.open[n]) if n in there else 0.0 for n in SLOTS]
        return [*out, 0.0, 0.0]

    def _closed(self, name: str, count: float) -> float:
        """0 as in the open hand, 1 as in the fist."""
        s = (count - self.open[name]) / (self.fist[name] - self.open[name])
        return min(1.0 + _BEYOND, max(-_BEYOND, s))


def default_calibration(highest: int = 4095) -> FiveDtCalibration:
    """A typical hand: a third of the range is used. `highest`: 255 for a Data Glove 5."""
    low, high = 0.35 * highest, 0.68 * highest
    return FiveDtCalibration(dict.fromkeys(SLOTS, low), dict.fromkeys(SLOTS, high))


def calibrate(opened: Sequence[float], fist: Sequence[float], base: FiveDtCalibration) -> tuple[FiveDtCalibration, tuple[str, ...]]:
    """From the counts of an open hand (flat, fingers spread) and of a fist; a note for each sensor that hardly moved and
    keeps `base`. Values as in a sample: 16 slots or five; a slot without a sensor is 0 in both and is left out."""
    names = SLOTS_5 if len(opened) == 5 else SLOTS
    opens, fists = dict(base.open), dict(base.fist)
    notes: list[str] = []
    for name, a, b in zip(names, opened, fist, strict=False):
        if abs(a - b) >= _LEAST * abs(base.fist[name] - base.open[name]):
            opens[name], fists[name] = a, b
        elif a or b:
            notes.append(f"{name} hardly moved from the spread hand to the fist: kept as it was; close the fist fully")
    return FiveDtCalibration(opens, fists, base.distal_ratio), tuple(notes)


def load_calibration(path: Path | None, highest: int = 4095) -> FiveDtCalibration:
    """Read {"open": {"thumb_near": counts, ...}, "fist": {...}, "distal_ratio": r}; None: a typical hand's.

    Sensors left out keep the default. Raises GloveCalibrationError.
    """
    base = default_calibration(highest)
    if path is None:
        return base
    try:
        table = json.loads(path.read_text("utf-8"))
        hands = [{str(n): float(v) for n, v in table.get(hand, {}).items()} for hand in ("open", "fist")]
        unknown = sorted((hands[0].keys() | hands[1].keys()) - set(SLOTS))
        if unknown:
            raise GloveCalibrationError(f"{unknown[0]}: no such sensor; expected one of {', '.join(SLOTS)}")
        ratio = float(table.get("distal_ratio", base.distal_ratio))
        return FiveDtCalibration({**base.open, **hands[0]}, {**base.fist, **hands[1]}, ratio)
    except GloveCalibrationError as e:
        raise GloveCalibrationError(f"{path}: {e}") from e
    except (OSError, ValueError, TypeError, AttributeError) as e:
        raise GloveCalibrationError(f"{path}: expected JSON with counts of each sensor under 'open' and 'fist': {e}") from e


def save_calibration(calibration: FiveDtCalibration, path: Path) -> None:
    """Write what `load_calibration` reads."""
    table = {"open": dict(calibration.open), "fist": dict(calibration.fist), "distal_ratio": calibration.distal_ratio}
    path.write_text(json.dumps(table, indent=2) + "\n", "utf-8")
