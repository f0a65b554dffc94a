"""Marks of drawn faces are found, centred and identified; what cannot be identified is reported as not seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vistel.figure.face.marks import MARK_COUNT, MARK_INDEX, REST, Expressions
from vistel.protocol.live_link_face import CHANNELS
from vistel.vision.colour_key import FULL, ColourKey
from vistel.vision.face_calibration import FaceCalibration, FaceCalibrationError, calibrate_face, read_face, write_face
from vistel.vision.face_reader import FaceReader
from vistel.vision.spots import find_spots, split_spot
from vistel_sim.phone import talking
from vistel_sim.pictures.face import FacePicture, View

DT = 1 / 60


@pytest.fixture(scope="module")
def painter() -> FacePicture:
    return FacePicture(3)


@pytest.fixture(scope="module")
def calibration(painter: FacePicture) -> FaceCalibration:
    return calibrate_face([painter.draw(REST, k) for k in range(8)])


def test_a_key_reads_half_a_mark_as_half_in_any_light() -> None:
    skin, mark = np.array((118.0, 148.0, 196.0)), np.array((78.0, 190.0, 62.0))
    key = ColourKey(mark, np.outer(skin, skin))
    for light in (1.0, 0.5):
        frame = np.rint(light * np.array([[mark, 0.5 * (mark + skin), skin]])).astype(np.uint8)
        full, half, none = key.apply(frame)[0]
        assert full == pytest.approx(FULL * light, abs=3)
        assert half == pytest.approx(0.5 * FULL * light, abs=3)
        assert none <= 3


def test_two_marks_run_together_are_taken_apart() -> None:
    y, x = np.mgrid[0:40, 0:60]
    key = np.zeros((40, 60), np.uint8)
    for cx in (22.0, 33.0):
        key[np.hypot(x - cx, y - 20.0) < 7.0] = FULL
    spots = find_spots(key, FULL)
    assert len(spots) == 1
    centres, masses = split_spot(key, tuple(spots.box[0]), FULL, np.array([[20.0, 18.0], [36.0, 22.0]]))
    assert np.abs(centres - [[21.5, 20.0], [33.5, 20.0]]).max() < 0.7
    assert masses.min() > 100


def test_a_neutral_face_is_learnt_from_pictures_alone(painter: FacePicture, calibration: FaceCalibration) -> None:
    assert np.abs(calibration.neutral - painter.centres(REST)).max() < 0.3
    assert calibration.wander_px < 0.1
    assert 0.0 < calibration.misfit_mm < 3.0


def test_a_mirrored_picture_is_learnt_when_asked_for(painter: FacePicture) -> None:
    frames = [np.ascontiguousarray(painter.draw(REST, k)[:, ::-1]) for k in range(5)]
    found = calibrate_face(frames, mirrored=True)
    mirrored = (639.0, 0.0) + painter.centres(REST) * (-1.0, 1.0)
    assert np.abs(found.neutral - mirrored).max() < 0.3
    reading = FaceReader(found).read(frames[0], DT)
    assert reading.marks is not None
    assert np.abs(reading.marks - REST).max() < 0.002


def test_pictures_without_a_face_are_refused_with_what_was_seen() -> None:
    with pytest.raises(FaceCalibrationError, match="0 of 5 pictures"):
        calibrate_face([np.full((480, 640, 3), 90, np.uint8)] * 5)
    with pytest.raises(FaceCalibrationError, match="no picture"):
        calibrate_face([])


def test_a_talking_face_is_read_to_a_fraction_of_a_pixel(painter: FacePicture, calibration: FaceCalibration) -> None:
    reader, expressions = FaceReader(calibration), Expressions(CHANNELS)
    errors, head = [], []
    for k in range(120):
        marks = expressions.marks(talking(2.0 + k * DT))
        view = View(gains=(1.0 - 0.003 * k,) * 3)
        reading = reader.read(painter.draw(marks, k, view), DT)
        assert reading.marks is not None
        errors.append(np.hypot(*(reading.pixels - painter.centres(marks, view)).T)[reading.seen])
        head.append(np.abs(reading.marks - marks).max())
    assert np.sqrt((np.concatenate(errors) ** 2).mean()) < 0.2
    assert np.max(head) < 0.002


def test_a_hidden_mark_is_predicted_from_the_others_and_found_again(painter: FacePicture, calibration: FaceCalibration) -> None:
    reader = FaceReader(calibration)
    chin = MARK_INDEX["chin"]
    x, y = painter.centres(REST)[chin]
    cover = View(covers=((x, y, 30.0),))
    for k in range(5):
        reader.read(painter.draw(REST, k), DT)
    hidden = [reader.read(painter.draw(REST, 5 + k, cover), DT) for k in range(20)][-1]
    assert not hidden.seen[chin]
    assert hidden.seen.sum() >= MARK_COUNT - 2
    assert np.hypot(*(hidden.pixels[chin] - (x, y))) < 12.0
    back = [reader.read(painter.draw(REST, 30 + k), DT) for k in range(5)][-1]
    assert back.seen.all()


def test_marks_that_pass_over_each_other_are_never_exchanged(painter: FacePicture, calibration: FaceCalibration) -> None:
    reader = FaceReader(calibration)
    low, up = MARK_INDEX["lower_lip"], MARK_INDEX["upper_lip"]
    for k in range(120):
        marks = REST.copy()
        marks[low] += (0.5 - 0.5 * np.cos(2 * np.pi * k / 120)) * 1.3 * (REST[up] - REST[low])
        reading = reader.read(painter.draw(marks, k), DT)
        off = np.hypot(*(reading.pixels - painter.centres(marks)).T)
        assert (off[reading.seen] < 3.0).all(), k
    assert reading.seen.all()


@pytest.mark.parametrize(
    ("who", "over"), [("right_mouth_corner", "upper_lip"), ("left_mouth_corner", "left_nose_wing"), ("chin", "lower_lip")]
)
def test_a_mark_that_stays_beyond_another_is_not_taken_for_it(
    painter: FacePicture, calibration: FaceCalibration, who: str, over: str
) -> None:
    """Long enough that all marks are looked for anew meanwhile: then both ways round look like a face that is pulled."""
    reader = FaceReader(calibration)
    a, b = MARK_INDEX[who], MARK_INDEX[over]
    way = np.concatenate((np.linspace(0.0, 1.3, 24), np.full(44, 1.3), np.linspace(1.3, 0.0, 24), np.zeros(30)))
    for k, share in enumerate(way):
        marks = REST.copy()
        marks[a] += share * (REST[b] - REST[a])
        reading = reader.read(painter.draw(marks, k), DT)
        off = np.hypot(*(reading.pixels - painter.centres(marks)).T)
        assert (off[reading.seen] < 5.0).all(), k
    assert reading.seen.all()


def test_a_spot_of_two_marks_of_which_one_was_lost_tells_nobodys_place(painter: FacePicture, calibration: FaceCalibration) -> None:
    """The reader begins while two marks run together: it cannot know of the second."""
    reader = FaceReader(calibration)
    low, up = MARK_INDEX["lower_lip"], MARK_INDEX["upper_lip"]
    marks = REST.copy()
    marks[low] = REST[up] + (0.0, -0.0042)
    for k in range(40):
        reading = reader.read(painter.draw(marks, k), DT)
        off = np.hypot(*(reading.pixels - painter.centres(marks)).T)
        assert (off[reading.seen] < 3.0).all(), k


def test_a_helmet_that_slips_takes_the_face_with_it_for_a_moment_only(painter: FacePicture, calibration: FaceCalibration) -> None:
    reader = FaceReader(calibration)
    view = View(slip=(0.003, -0.004, 0.02))
    before, after = painter.draw(REST, 0), painter.draw(REST, 1, view)
    readings = [reader.read(after if k >= 5 else before, DT if k < 10 else 0.1) for k in range(70)]
    assert all(r.marks is not None for r in readings)
    assert np.abs(readings[7].marks - REST).max() > 0.002
    assert np.abs(readings[-1].marks - REST).max() < 0.0015


def test_noise_is_no_face(calibration: FaceCalibration) -> None:
    reader = FaceReader(calibration)
    rng = np.random.default_rng(0)
    for _ in range(5):
        reading = reader.read(rng.integers(0, 256, (480, 640, 3)).astype(np.uint8), DT)
        assert reading.marks is None
        assert "no face" in reading.trouble


def test_a_calibration_is_written_and_read(tmp_path: Path, calibration: FaceCalibration) -> None:
    path = tmp_path / "face.json"
    write_face(path, calibration)
    again = read_face(path)
    assert np.abs(again.neutral - calibration.neutral).max() < 0.001
    assert (again.width, again.height) == (640, 480)
    for text in ("{}", "[1", '{"width": 640, "height": 480}', path.read_text().replace('"mass"', '"mess"')):
        path.write_text(text)
        with pytest.raises(FaceCalibrationError, match=r"face\.json"):
            read_face(path)
    with pytest.raises(FaceCalibrationError, match="cannot be read"):
        read_face(tmp_path / "none.json")
