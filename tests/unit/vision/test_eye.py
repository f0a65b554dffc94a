"""Pupils, gaze and lids of drawn eyes, and pupils in real infrared pictures."""

from __future__ import annotations

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.vision.eye_reader import EyeReader
from vistel.vision.face_calibration import FaceCalibrationError
from vistel.vision.gaze_calibration import GAZE_TARGETS, calibrate_gaze, read_gaze, write_gaze
from vistel.vision.pupil import LEAST_CONFIDENCE, find_pupil
from vistel_sim.pictures.eye import EyePicture

AHEAD = np.zeros(2)


def learnt(eye: EyePicture):
    return calibrate_gaze([np.tile(eye.pupil(t)[0], (4, 1)) for t in GAZE_TARGETS], GAZE_TARGETS, (320, 240), 79.0)


@pytest.mark.parametrize("right", [False, True])
def test_gaze_of_either_eye_is_left_positive_and_up_positive(right: bool) -> None:
    eye = EyePicture(4, right=right)
    reader = EyeReader(learnt(eye))
    for gaze in np.radians([[0, 0], [14, 0], [-14, 0], [0, 9], [6, -7]]):
        reading = reader.read(eye.draw(gaze, 1.0, 1))
        assert reading.gaze is not None
        assert np.degrees(np.abs(reading.gaze - gaze)).max() < 1.0


def test_a_blink_closes_and_opens_the_lids_and_says_no_gaze() -> None:
    eye = EyePicture(4)
    reader = EyeReader(learnt(eye))
    openings = [1.0] * 5 + [0.7, 0.4, 0.1, 0.0, 0.0, 0.2, 0.6] + [1.0] * 5
    readings = [reader.read(eye.draw(AHEAD, o, k)) for k, o in enumerate(openings)]
    assert [r.opening for r in readings[7:10]] == pytest.approx([0.0, 0.0, 0.0], abs=0.25)
    assert readings[9].gaze is None
    assert readings[9].opening == 0.0
    assert readings[-1].opening > 0.95
    assert readings[-1].gaze is not None


def test_the_pupil_is_measured() -> None:
    eye = EyePicture(4)
    picture = eye.draw(AHEAD, 1.0, 1)
    pupil = find_pupil(picture)
    assert pupil is not None
    assert np.hypot(*(pupil.centre - eye.pupil(AHEAD)[0])) < 0.6
    assert pupil.radius == pytest.approx(0.17 * 128, rel=0.06)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.integers(8, 300), st.integers(8, 300), st.integers(0, 255))
def test_no_picture_breaks_the_search(seed: int, width: int, height: int, spread: int) -> None:
    rng = np.random.default_rng(seed)
    picture = rng.integers(0, spread + 1, (height, width)).astype(np.uint8)
    pupil = find_pupil(picture)
    assert pupil is None or np.isfinite((*pupil.centre, *pupil.axes, pupil.confidence)).all()


def test_points_that_were_not_looked_at_are_left_out_and_too_few_refused(tmp_path: Path) -> None:
    eye = EyePicture(4)
    places = [np.tile(eye.pupil(t)[0], (4, 1)) for t in GAZE_TARGETS]
    some = [p if k != 3 else p[:0] for k, p in enumerate(places)]
    found = calibrate_gaze(some, GAZE_TARGETS, (320, 240), 79.0)
    assert found.residual_deg < 0.3
    with pytest.raises(FaceCalibrationError, match="6 of 9 points"):
        calibrate_gaze([p if k < 6 else p[:0] for k, p in enumerate(places)], GAZE_TARGETS, (320, 240), 79.0)
    with pytest.raises(FaceCalibrationError, match="moved by"):
        calibrate_gaze([np.full((4, 2), 100.0)] * 9, GAZE_TARGETS, (320, 240), 79.0)
    path = tmp_path / "eye.json"
    write_gaze(path, found)
    assert np.allclose(read_gaze(path).gaze(places[0][0]), found.gaze(places[0][0]), atol=1e-3)
    path.write_text("{}")
    with pytest.raises(FaceCalibrationError, match=r"eye\.json"):
        read_gaze(path)


def test_real_eyes_are_classified_as_open_or_closed_and_their_pupils_found(shared_data: Path) -> None:
    """Every fifth picture; the bench takes all."""
    folder = shared_data / "eye" / "mrgaze"
    with (Path(__file__).parents[3] / "benchmarks" / "figures" / "eye_pupils.csv").open(encoding="utf-8") as f:
        marked = list(csv.DictReader(f))[::5]
    widths = {line.split()[0]: float(line.split()[4]) for line in (folder / "open_bbox.txt").read_text().splitlines()}
    hits = 0
    for row in marked:
        p = find_pupil(cv2.imread(str(folder / "open" / row["picture"]), cv2.IMREAD_GRAYSCALE))
        off = (
            np.inf if p is None or p.confidence <= LEAST_CONFIDENCE else np.hypot(*(p.centre - (float(row["x"]), float(row["y"]))))
        )
        hits += off < 0.15 * 0.5 * widths[f"open/{row['picture']}"]
    assert hits >= len(marked) - 1
    for path in sorted((folder / "closed").glob("*.jpg")):
        p = find_pupil(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
        assert p is None or p.confidence <= LEAST_CONFIDENCE, path.name
