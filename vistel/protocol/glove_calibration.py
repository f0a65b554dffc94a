"""From a CyberGlove's counts to the angles of a hand, and back for a simulated glove.

A sensor is linear: angle = gain * (raw - offset). The glove measures how far neighbouring fingers are spread; a hand
has an abduction per finger. The middle finger is the reference: its abduction is taken as zero.

The 20 angles are those of one row of `vistel.figure.posture.posture.Posture.hands`: thumb roll, abduction, flexion 1 and 2;
then base flexion, abduction, middle flexion, end flexion of index, middle, ring and little finger. They are
anatomical (flexion to the palm, abduction to the thumb), so left and right gloves share all signs.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from vistel.protocol.cyberglove import SENSORS, SENSORS_22

ANGLE_COUNT = 20
"""Angles of a hand: four of the thumb, then four of each finger."""
_INDEX = {name: i for i, name in enumerate(SENSORS_22)}
_ROWS = {count: tuple(_INDEX[name] for name in names) for count, names in SENSORS.items()}
# Angles that one sensor measures directly: index of the angle, sensor.
_DIRECT = (
    (0, "thumb_roll"), (1, "thumb_abduction"), (2, "thumb_mpj"), (3, "thumb_ij"),
    (4, "index_mpj"), (6, "index_pij"), (7, "index_dij"),
    (8, "middle_mpj"), (10, "middle_pij"), (11, "middle_dij"),
    (12, "ring_mpj"), (14, "ring_pij"), (15, "ring_dij"),
    (16, "pinky_mpj"), (18, "pinky_pij"), (19, "pinky_dij"),
)  # fmt: skip
_DISTAL = ((7, 6), (11, 10), (15, 14), (19, 18))
_ABDUCTIONS = (("middle_index_abduction", 4, 8), ("ring_middle_abduction", 8, 12), ("pinky_ring_abduction", 12, 16))
"""Sensors between fingers, and indices of the base flexions of the two fingers, which also move the sensor."""
_INDEX_ABDUCTION = 5
"""Index of the index finger's abduction among the angles."""
_MIDDLE_ABDUCTION = 9
"""Index of the middle finger's abduction among the angles."""
_RING_ABDUCTION = 13
"""Index of the ring finger's abduction among the angles."""
_LITTLE_ABDUCTION = 17
"""Index of the little finger's abduction among the angles."""


class GloveCalibrationError(ValueError):
    """A calibration file that cannot be used; one line: file, sensor, what was expected."""


@dataclass(frozen=True)
class GloveCalibration:
    """offset: (22,) counts; gain: (22,) radians per count, in the order of `SENSORS_22`.

    distal_ratio: end flexion / middle flexion, for gloves that do not measure the end joints. coupling: apparent
    abduction of the three sensors between fingers per radian of their fingers' mean base flexion.
    """

    offset: tuple[float, ...]
    gain: tuple[float, ...]
    distal_ratio: float = 2.0 / 3.0
    coupling: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(self.offset) != len(SENSORS_22) or len(self.gain) != len(SENSORS_22):
            raise GloveCalibrationError(f"expected {len(SENSORS_22)} offsets and gains")
        if not all(map(math.isfinite, self.offset)) or not all(math.isfinite(g) and g for g in self.gain):
            raise GloveCalibrationError("expected finite offsets and finite gains other than zero")
        if len(self.coupling) != len(_ABDUCTIONS) or not all(abs(c) < 1.0 for c in self.coupling):
            raise GloveCalibrationError(f"coupling: expected {len(_ABDUCTIONS)} numbers between -1 and 1")

    def angles(self, raw: bytes) -> list[float]:
        """(20,) radians from 18 or 22 counts. Raises GloveCalibrationError for another number of counts."""
        if len(raw) not in SENSORS:
            raise GloveCalibrationError(f"expected 18 or 22 sensor values, got {len(raw)}")
        sensors = zip(SENSORS[len(raw)], _ROWS[len(raw)], raw, strict=True)
        measured = {name: self.gain[row] * (count - self.offset[row]) for name, row, count in sensors}
        out = [0.0] * ANGLE_COUNT
        for angle, sensor in _DIRECT:
            out[angle] = measured.get(sensor, 0.0)
        if len(raw) == 18:
            for end, middle in _DISTAL:
                out[end] = self.distal_ratio * out[middle]
        for (sensor, a, b), c in zip(_ABDUCTIONS, self.coupling, strict=True):
            measured[sensor] -= c * 0.5 * (out[a] + out[b])
        out[_INDEX_ABDUCTION] = measured["middle_index_abduction"]
        out[_RING_ABDUCTION] = -measured["ring_middle_abduction"]
        out[_LITTLE_ABDUCTION] = out[_RING_ABDUCTION] - measured["pinky_ring_abduction"]
        return out

    def counts(self, angles: list[float], sensors: int) -> list[float]:
        """The counts of a glove with 18 or 22 sensors for 20 angles [rad], not rounded; palm and wrist at rest."""
        measured = {sensor: angles[angle] for angle, sensor in _DIRECT}
        measured["middle_index_abduction"] = angles[_INDEX_ABDUCTION] - angles[_MIDDLE_ABDUCTION]
        measured["ring_middle_abduction"] = angles[_MIDDLE_ABDUCTION] - angles[_RING_ABDUCTION]
        measured["pinky_ring_abduction"] = angles[_RING_ABDUCTION] - angles[_LITTLE_ABDUCTION]
        for (sensor, a, b), c in zip(_ABDUCTIONS, self.coupling, strict=True):
            measured[sensor] += c * 0.5 * (angles[a] + angles[b])
        return [self.offset[_INDEX[name]] + measured.get(name, 0.0) / self.gain[_INDEX[name]] for name in SENSORS[sensors]]


def default_calibration() -> GloveCalibration:
    """A typical hand in a typical glove; every joint's range fits the counts 1..255.

    The maker's default is offset 50 and 0.4 degrees per count for all; joints that bend beyond 80 degrees would
    leave the range, spreading would use a tenth of it.
    """
    kinds = {
        "mpj": (40.0, 0.5),
        "pij": (30.0, 0.55),
        "dij": (30.0, 0.5),
        "ij": (40.0, 0.5),
        "abduction": (100.0, 0.3),
        "roll": (100.0, 0.6),
        "arch": (50.0, 0.4),
        "pitch": (128.0, 0.6),
        "yaw": (128.0, 0.6),
    }
    table = [kinds[name.rsplit("_", 1)[-1]] for name in SENSORS_22]
    return GloveCalibration(tuple(o for o, _ in table), tuple(math.radians(g) for _, g in table))


def open_calibration(path: Path | None) -> GloveCalibration:
    """The calibration in a file, or the default. Raises GloveCalibrationError."""
    return default_calibration() if path is None else load_calibration(path)


def load_calibration(path: Path) -> GloveCalibration:
    """Read {"sensors": {"thumb_roll": {"offset": counts, "gain_deg": degrees per count}, ...}, "distal_ratio": r,
    "coupling": [a, b, c]}.

    Sensors left out keep the default. Raises GloveCalibrationError.
    """
    try:
        table = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as e:
        raise GloveCalibrationError(f"{path}: cannot be read as JSON: {e}") from e
    base = default_calibration()
    offset, gain = list(base.offset), list(base.gain)
    try:
        for name, entry in table.get("sensors", {}).items():
            if name not in _INDEX:
                raise GloveCalibrationError(f"{name}: no such sensor; expected one of {', '.join(SENSORS_22)}")
            offset[_INDEX[name]] = float(entry["offset"])
            gain[_INDEX[name]] = math.radians(float(entry["gain_deg"]))
        a, b, c = (float(v) for v in table.get("coupling", base.coupling))
        return GloveCalibration(tuple(offset), tuple(gain), float(table.get("distal_ratio", base.distal_ratio)), (a, b, c))
    except GloveCalibrationError as e:
        raise GloveCalibrationError(f"{path}: {e}") from e
    except (AttributeError, KeyError, TypeError, ValueError) as e:
        raise GloveCalibrationError(f"{path}: expected numbers 'offset' and 'gain_deg' for each sensor: {e!r}") from e


def save_calibration(calibration: GloveCalibration, path: Path) -> None:
    """Write what `load_calibration` reads."""
    sensors = {
        name: {"offset": o, "gain_deg": math.degrees(g)}
        for name, o, g in zip(SENSORS_22, calibration.offset, calibration.gain, strict=True)
    }
    table = {"sensors": sensors, "distal_ratio": calibration.distal_ratio, "coupling": list(calibration.coupling)}
    path.write_text(json.dumps(table, indent=2) + "\n", "utf-8")
