"""What `vistel bench looks_human` counts: faces where they are, joints that are seen, features that stand out from skin."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.looks_human.bench_looks_human import face_score, hands_found, landmark_errors
from benchmarks.looks_human.contrast import CHEEK, MOUTH, contrasts
from benchmarks.looks_human.truth import distances, truth_of
from vistel.figure.posture.posture import pose_joints, standing
from vistel.figure.skeleton import standard_skeleton
from vistel.render.view.camera import FAR, NEAR, look_at

WIDTH, HEIGHT = 320, 240


def test_a_face_counts_only_where_one_is() -> None:
    faces = [(0.9, 10.0, 10.0, 20.0, 20.0), (0.6, 90.0, 90.0, 20.0, 20.0)]
    assert face_score(faces, (100.0, 102.0, 15.0)) == 0.6
    assert face_score(faces, (60.0, 60.0, 15.0)) == 0.0


@pytest.fixture
def stood() -> tuple:
    skeleton = standard_skeleton(1.75)
    return skeleton, pose_joints(skeleton, standing()), look_at((0.0, 1.2, 2.5), (0.0, 1.0, 0.0), 1.0)


def test_somebody_who_faces_the_camera_is_seen_and_behind_a_wall_is_not(stood: tuple) -> None:
    open_air = truth_of("ann", *stood, np.full((HEIGHT, WIDTH), FAR))
    assert open_air["turned"] < 15.0 and open_air["whole"] and open_air["face_seen"] == 1.0
    assert all(open_air["joints_seen"].values()) and all(hand["seen"] == 1.0 for hand in open_air["hands"])
    walled = truth_of("ann", *stood, np.full((HEIGHT, WIDTH), 1.0))
    assert walled["face_seen"] == 0.0 and not any(walled["joints_seen"].values())


def test_landmarks_at_the_joints_have_no_error_and_hidden_ones_do_not_count(stood: tuple) -> None:
    person = truth_of("ann", *stood, np.full((HEIGHT, WIDTH), FAR))
    marks = np.zeros((33, 3))
    for k, at in person["joints"].items():
        marks[int(k), :2] = at
    person["joints_seen"]["11"] = False
    marks[11] = 1e6
    frame = {"people": [person], "found": {"pose": marks.tolist()}}
    assert max(landmark_errors(frame)) < 1e-9
    marks[12, 0] += 0.02 * person["stature"]
    frame["found"]["pose"] = marks.tolist()
    assert max(landmark_errors(frame)) == pytest.approx(2.0)


def test_small_and_hidden_hands_do_not_count() -> None:
    hands = [{"long": 40.0, "seen": 1.0}, {"long": 20.0, "seen": 1.0}, {"long": 40.0, "seen": 0.2}]
    assert hands_found([{"people": [{"hands": hands}], "found": {"hands": [False, True, True]}}]) == [False]


def test_depths_of_a_picture_are_metres() -> None:
    assert distances(np.array([0.0, 1.0])) == pytest.approx([NEAR, FAR])


def test_darker_features_have_more_contrast_and_plain_skin_has_none() -> None:
    per_m, eyes = 1000.0, np.array([[92.0, 100.0], [155.0, 100.0]])
    plain = np.full((260, 260, 3), 190, np.uint8)
    assert max(contrasts(plain, eyes, per_m).values()) == pytest.approx(0.0, abs=1e-6)
    drawn = plain.copy()
    mouth = round(100.0 + MOUTH * per_m)
    assert MOUTH > CHEEK
    drawn[mouth - 5 : mouth + 5, 105:143] = 120
    found = contrasts(drawn, eyes, per_m)
    assert found["mouth"] > 0.2 and found["eyes"] == pytest.approx(0.0, abs=1e-6)
    drawn[mouth - 5 : mouth + 5, 105:143] = 60
    assert contrasts(drawn, eyes, per_m)["mouth"] > found["mouth"]
