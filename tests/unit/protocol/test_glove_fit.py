"""A glove's calibration from four hands held still: what was put in is found again, and bad hands are told."""

from __future__ import annotations

import math
import random
from pathlib import Path

import pytest

from vistel.figure.posture.hands import RELAXED
from vistel.protocol.cyberglove import SENSORS
from vistel.protocol.glove_calibration import (
    GloveCalibration,
    GloveCalibrationError,
    default_calibration,
    load_calibration,
    save_calibration,
)
from vistel.protocol.glove_fit import HANDS, HOLD_S, find_holds, fit_among, fit_glove
from vistel_sim.motion.calibration import hand_at

RATE_HZ = 60.0


def own(seed: int) -> GloveCalibration:
    """Somebody's hand in a glove: counts and coupling of their own."""
    rng = random.Random(seed)
    typical = default_calibration()
    return GloveCalibration(
        tuple(o + rng.uniform(-15, 15) for o in typical.offset),
        tuple(g * rng.uniform(0.85, 1.2) for g in typical.gain),
        2 / 3,
        (0.12, -0.08, 0.15),
    )


def counts(times: list[float], samples: list[list[int]]) -> list[tuple[float, ...]]:
    """Of the hands held still."""
    return [hold.counts for hold in find_holds(times, samples)]


def worn(calibration: GloveCalibration, sensors: int, seed: int = 0) -> tuple[list[float], list[list[int]]]:
    """What the glove sends while its user shows the four hands."""
    rng = random.Random(seed)
    times = [k / RATE_HZ for k in range(int(7.0 * len(HANDS) * RATE_HZ))]
    samples = [
        [min(255, max(1, round(c + rng.gauss(0.0, 0.4)))) for c in calibration.counts(hand_at(t).tolist(), sensors)] for t in times
    ]
    return times, samples


@pytest.mark.parametrize("sensors", [18, 22])
@pytest.mark.parametrize("seed", [1, 2])
def test_gains_offsets_and_coupling_are_found_again(seed: int, sensors: int) -> None:
    truth = own(seed)
    found = fit_glove(counts(*worn(truth, sensors)))
    assert found.notes == ()
    for t in (5.0, 12.0, 19.0, 26.0, 9.2):
        want = hand_at(t).tolist()
        got = found.calibration.angles(bytes(min(255, max(1, round(c))) for c in truth.counts(want, sensors)))
        measured = [i for i in range(20) if i not in (7, 11, 15, 19) or sensors == 22]
        assert max(abs(want[i] - got[i]) for i in measured) < math.radians(4.0)
    assert found.calibration.coupling == pytest.approx(truth.coupling, abs=0.03)


def test_end_joints_that_are_not_measured_follow_as_in_a_fist() -> None:
    found = fit_glove(counts(*worn(own(1), 18)))
    assert found.calibration.distal_ratio == pytest.approx(0.65)


def test_the_file_keeps_the_coupling(tmp_path: Path) -> None:
    found = fit_glove(counts(*worn(own(1), 22))).calibration
    save_calibration(found, tmp_path / "glove.json")
    again = load_calibration(tmp_path / "glove.json")
    assert again.coupling == pytest.approx(found.coupling) and again.gain == pytest.approx(found.gain)


def test_open_and_fist_exchanged_are_reported() -> None:
    hands = counts(*worn(own(1), 18))
    with pytest.raises(GloveCalibrationError, match="exchanged"):
        fit_glove([hands[1], hands[0], hands[2], hands[3]])


def test_a_hand_at_rest_before_or_after_is_no_matter() -> None:
    times, samples = worn(own(1), 18)
    rest = [[min(255, max(1, round(c))) for c in own(1).counts(RELAXED.tolist(), 18)]] * 180
    longer = [k / RATE_HZ for k in range(len(samples) + 360)]
    found, four = fit_among(find_holds(longer, [*rest, *samples, *rest]))
    assert found.notes == ()
    assert found.calibration.gain == pytest.approx(fit_glove(counts(times, samples)).calibration.gain)
    assert four[0].begin >= 180 and four[-1].end <= len(longer) - 180


def test_too_few_hands_are_reported() -> None:
    times, samples = worn(own(1), 18)
    half = int(7.0 * 2 * RATE_HZ)
    with pytest.raises(GloveCalibrationError, match="2 hands held still were found, 4 are needed"):
        find_holds(times[:half], samples[:half])


def test_a_sensor_that_does_not_move_keeps_a_typical_hands_values_and_is_named() -> None:
    times, samples = worn(own(1), 18)
    k = SENSORS[18].index("index_pij")
    found = fit_glove(counts(times, [[*s[:k], 50, *s[k + 1 :]] for s in samples]))
    assert len(found.notes) == 1 and found.notes[0].startswith("index_pij rose by 0 counts")
    assert HOLD_S > 0
    typical = default_calibration()
    assert found.calibration.gain[5] == typical.gain[5]


def test_a_glove_that_is_not_worn_is_reported() -> None:
    flat = [100.0] * 18
    with pytest.raises(GloveCalibrationError):
        fit_glove([flat, flat, flat, flat])
