"""Counts of a glove to the angles of a hand."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.protocol.cyberglove import SENSORS_22
from vistel.protocol.glove_calibration import (
    GloveCalibration,
    GloveCalibrationError,
    default_calibration,
    load_calibration,
    save_calibration,
)

RANGES = {"flexion": (-0.2, 1.5), "abduction": (-0.25, 0.25)}
ABDUCTIONS = (5, 9, 13, 17)


def hands() -> st.SearchStrategy[list[float]]:
    """Hands whose end joints follow the middle joints and whose middle finger points straight."""

    def build(values: list[float]) -> list[float]:
        out = list(values)
        for end, middle in ((7, 6), (11, 10), (15, 14), (19, 18)):
            out[end] = out[middle] * 2.0 / 3.0
        spread = sorted((out[5], out[13], out[17]), reverse=True)
        out[5], out[9], out[13], out[17] = abs(spread[0]), 0.0, -abs(spread[1]), -abs(spread[1]) - abs(spread[2])
        return out

    kinds = [RANGES["abduction" if i in (*ABDUCTIONS, 0, 1) else "flexion"] for i in range(20)]
    return st.tuples(*(st.floats(*k) for k in kinds)).map(list).map(build)


@given(hands(), st.sampled_from([18, 22]))
def test_truth_comes_back_within_quantisation(angles: list[float], sensors: int) -> None:
    calibration = default_calibration()
    counts = [round(c) for c in calibration.counts(angles, sensors)]
    assert all(1 <= c <= 255 for c in counts)
    back = calibration.angles(bytes(counts))
    assert max(abs(a - b) for a, b in zip(angles, back, strict=True)) <= math.radians(0.6) / 2 + 1e-9


def test_an_18_sensor_glove_estimates_its_end_joints() -> None:
    calibration = default_calibration()
    angles = [0.0] * 20
    angles[6] = 0.9
    raw = bytes(round(c) for c in calibration.counts(angles, 18))
    assert calibration.angles(raw)[7] == pytest.approx(0.6, abs=0.01)


def test_spreading_the_fingers_moves_each_away_from_the_middle_one() -> None:
    calibration = default_calibration()
    raw = bytearray(round(o) for o in calibration.offset)
    for name in ("middle_index_abduction", "ring_middle_abduction", "pinky_ring_abduction"):
        raw[SENSORS_22.index(name)] += 20
    angles = calibration.angles(bytes(raw))
    assert angles[5] > 0.0 and angles[9] == 0.0 and angles[17] < angles[13] < 0.0


def test_a_glove_with_another_number_of_sensors_is_refused() -> None:
    with pytest.raises(GloveCalibrationError, match="18 or 22"):
        default_calibration().angles(bytes(20))


def test_a_calibration_survives_its_file(tmp_path: Path) -> None:
    original = GloveCalibration(tuple(40.0 + i for i in range(22)), tuple(0.005 + 1e-4 * i for i in range(22)), 0.7)
    save_calibration(original, tmp_path / "c.json")
    back = load_calibration(tmp_path / "c.json")
    assert back.gain == pytest.approx(original.gain) and back.offset == original.offset and back.distal_ratio == 0.7


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{", "cannot be read as JSON"),
        (json.dumps({"sensors": {"nose": {"offset": 1, "gain_deg": 1}}}), "no such sensor"),
        (json.dumps({"sensors": {"thumb_roll": {"offset": 1}}}), "gain_deg"),
        (json.dumps({"sensors": {"thumb_roll": {"offset": 1, "gain_deg": 0}}}), "other than zero"),
        (json.dumps([1]), "expected numbers"),
    ],
)
def test_a_bad_file_is_reported_in_one_line(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(GloveCalibrationError, match=expected) as e:
        load_calibration(path)
    assert "\n" not in str(e.value)
