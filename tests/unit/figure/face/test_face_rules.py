"""Action units: from marks and loudness; what they do to a head; marks that are lost."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.arrays import F64
from vistel.audio.heard_voices import Speech
from vistel.audio.visemes import VISEMES
from vistel.figure.face.countenance import Countenance
from vistel.figure.face.intensities import MarkReader, by_loudness, by_visemes
from vistel.figure.face.landmarks import Landmarks, landmarks_of
from vistel.figure.face.marks import MARK_INDEX, REST, Expressions
from vistel.figure.face.rules import FaceRuleError, builtin_rules, load_rules
from vistel.figure.face.shape import Expression, FaceShape
from vistel.figure.posture.posture import Posture, interpolate
from vistel.protocol.live_link_face import CHANNELS

SECOND = 1_000_000_000
RULES = builtin_rules()


@pytest.fixture(scope="module")
def head() -> tuple[FaceShape, Landmarks, F64]:
    avatar = closed_person()
    marks = landmarks_of(avatar)
    shape = FaceShape(avatar.mesh.vertices, marks)
    return shape, marks, avatar.mesh.vertices[shape.vertex].astype(np.float64)


def units(**strength: float) -> Expression:
    out = np.zeros(len(RULES.units))
    for name, value in strength.items():
        out[RULES.names.index(name)] = value
    return Expression(out)


def marks_of(**channels: float) -> F64:
    values = [channels.get(name, 0.0) for name in CHANNELS]
    return Expressions(CHANNELS).marks(values)


@pytest.mark.parametrize(
    ("channel", "unit"),
    [
        ("browInnerUp", "left_AU1"),
        ("browOuterUpLeft", "left_AU2"),
        ("browDownRight", "right_AU4"),
        ("cheekSquintLeft", "left_AU6"),
        ("noseSneerRight", "right_AU9"),
        ("mouthSmileLeft", "left_AU12"),
        ("mouthFrownRight", "right_AU15"),
        ("mouthStretchLeft", "left_AU20"),
        ("mouthPucker", "AU18"),
        ("mouthFunnel", "AU22"),
        ("jawOpen", "AU26"),
        ("jawLeft", "AU30"),
        ("jawRight", "AU30R"),
        ("mouthClose", "AU8"),
    ],
)
def test_marks_name_the_unit_that_moved_them(channel: str, unit: str) -> None:
    reader = MarkReader(RULES)
    for strength in (0.5, 1.0):
        intensity, _ = reader.read(marks_of(**{channel: strength}))
        strongest = reader.strongest(intensity)
        assert strongest is not None
        named = RULES.names[strongest]
        assert named in (unit, unit.replace("left", "right")) if channel == "browInnerUp" else named == unit
    half, whole = (reader.read(marks_of(**{channel: s}))[0][RULES.names.index(unit)] for s in (0.5, 1.0))
    assert 0.0 < half < whole


def test_a_still_face_with_noise_does_nothing() -> None:
    rng, reader = np.random.default_rng(3), MarkReader(RULES)
    for _ in range(50):
        intensity, _ = reader.read(REST + rng.normal(0.0, 1.5e-4, REST.shape))
        assert not intensity.any()


def test_marks_that_are_missing_count_for_nothing_and_none_at_all_is_a_face_at_rest() -> None:
    reader, smile = MarkReader(RULES), marks_of(mouthSmileLeft=1.0)
    lost = smile.copy()
    lost[[MARK_INDEX["left_cheek"], MARK_INDEX["chin"]]] = np.nan
    lost[MARK_INDEX["right_outer_brow"]] = (4.0, 4.0)
    intensity, moved = reader.read(lost)
    assert RULES.names[int(reader.strongest(intensity) or 0)] == "left_AU12"
    assert np.isnan(moved[MARK_INDEX["chin"]]).all()
    nothing, _ = reader.read(np.full_like(REST, np.nan))
    assert not nothing.any()


def test_the_jaw_opens_below_the_lips_and_leaves_the_rest_of_the_face(head: tuple[FaceShape, Landmarks, F64]) -> None:
    shape, marks, p = head
    moved = shape.offsets(units(AU26=1.0))
    chin, lip = (np.linalg.norm(p - marks.marks[MARK_INDEX[m]], axis=1) < 0.008 for m in ("chin", "upper_lip"))
    assert moved[chin, 1].max() < -0.02
    assert np.abs(moved[lip & (p[:, 1] > marks.between[1] + 0.002)]).max() < 0.002
    assert not moved[p[:, 1] > marks.middle[1]].any()
    closed = shape.offsets(units(AU26=1.0, AU8=1.0))
    below = lip | (np.linalg.norm(p - marks.marks[MARK_INDEX["lower_lip"]], axis=1) < 0.006)
    assert closed[below, 1].min() > 0.6 * moved[below, 1].min()


def test_a_blink_brings_the_upper_lid_to_the_lower_and_looking_down_half_way(head: tuple[FaceShape, Landmarks, F64]) -> None:
    shape, marks, p = head
    eye = marks.eyes[0]
    edge = (np.abs(p[:, 0] - eye[0]) < 0.004) & (p[:, 2] > eye[2] + 0.011) & (np.abs(p[:, 1] - eye[1]) < 0.012)
    upper, lower = edge & (p[:, 1] > eye[1]), edge & (p[:, 1] < eye[1])

    def gap(e: Expression) -> float:
        q = p + shape.offsets(e)
        return float(q[upper, 1].min() - q[lower, 1].max())

    still = Expression.none(RULES)
    assert gap(still) > 0.006
    assert gap(replace(still, lids=(0.0, 1.0))) < 0.002
    assert gap(replace(still, pitch=-0.4)) < 0.9 * gap(still)
    right = shape.offsets(replace(still, lids=(0.0, 1.0)))
    assert not right[p[:, 0] < -0.005].any()


def test_what_the_rules_leave_of_a_mark_is_followed_by_the_skin_round_it(head: tuple[FaceShape, Landmarks, F64]) -> None:
    shape, marks, p = head
    moved = np.zeros((len(REST), 2))
    moved[MARK_INDEX["left_cheek"]] = (0.003, 0.002)
    made = shape.offsets(Expression(np.zeros(len(RULES.units)), moved))
    at = np.argmin(np.linalg.norm(p - marks.marks[MARK_INDEX["left_cheek"]], axis=1))
    assert made[at, :2] / marks.scale == pytest.approx((0.003, 0.002), abs=5e-4)
    assert np.abs(made[p[:, 0] < -0.01]).max() < 1e-4


def test_a_face_whose_marks_are_lost_goes_back_to_rest_gently_and_comes_back_gently() -> None:
    face = Countenance()
    smiling = Posture(face=marks_of(mouthSmileLeft=1.0, mouthSmileRight=1.0))
    k = RULES.names.index("left_AU12")
    for n in range(60):
        now = face.step(smiling, n * SECOND // 60)
    high = now.expression.intensity[k]
    assert high > 0.6
    assert now.actions["AU12"] >= high
    seen = [face.step(Posture(), SECOND + n * SECOND // 60).expression.intensity[k] for n in range(180)]
    assert seen[0] > 0.9 * high
    assert seen[30] < 0.5 * high
    assert seen[-1] == 0.0
    back = [face.step(smiling, 4 * SECOND + n * SECOND // 60).expression.intensity[k] for n in range(60)]
    assert back[0] < 0.2 * high
    assert back[-1] > 0.9 * high


def test_skin_at_a_mark_missing_from_the_start_goes_where_the_others_say(head: tuple[FaceShape, Landmarks, F64]) -> None:
    shape, marks, p = head
    lost = marks_of(jawOpen=0.8)
    lost[[MARK_INDEX["chin"], MARK_INDEX["left_inner_brow"]]] = np.nan
    chin = np.linalg.norm(p - marks.marks[MARK_INDEX["chin"]], axis=1) < 0.008
    moved, whole = (shape.offsets(Countenance().step(Posture(face=m)).expression) for m in (lost, marks_of(jawOpen=0.8)))
    assert np.isfinite(moved).all()
    assert moved[chin, 1].max() < 0.7 * whole[chin, 1].max() < -0.008


def test_who_is_only_heard_moves_the_mouth_and_who_is_silent_does_not() -> None:
    face = Countenance()
    loud = [face.step(Posture(), n * SECOND // 60, Speech(-22.0)) for n in range(120)]
    jaw = [s.expression.intensity[RULES.names.index("AU26")] for s in loud]
    assert max(jaw) > 0.15
    assert min(jaw[30:]) < 0.1
    assert max(abs(b - a) for a, b in pairwise(jaw[1:])) < 0.08
    assert face.step(Posture(), 20 * SECOND).expression.still
    assert not by_loudness(RULES, -60.0, 1.0).any()
    assert not by_loudness(RULES, float("nan"), 1.0).any()


def mouth(weights: dict[str, float], level_db: float = -20.0) -> tuple[float, float]:
    """How far apart the lips are, and how wide the mouth is more than at rest [m]."""
    speech = Speech(level_db, np.array([weights.get(viseme, 0.0) for viseme in VISEMES]))
    marks = np.tensordot(by_visemes(RULES, speech), np.array([u.pattern for u in RULES.units]), 1)
    left, right, upper, lower = (
        marks[MARK_INDEX[m]] for m in ("left_mouth_corner", "right_mouth_corner", "upper_lip", "lower_lip")
    )
    return float(upper[1] - lower[1]), float(left[0] - right[0])


def test_a_mouth_takes_the_shape_of_what_is_said() -> None:
    assert mouth({"sil": 1.0}) == (0.0, 0.0)
    assert mouth({"PP": 1.0})[0] < 0.001
    assert mouth({"aa": 1.0})[0] > 0.01
    assert mouth({"PP": 0.5, "aa": 0.5})[0] < 0.003  # lips that shut are shut
    assert mouth({"ou": 1.0})[1] < -0.01
    assert mouth({"ih": 1.0})[1] > 0.004
    assert mouth({"aa": 1.0}, -60.0)[0] == pytest.approx(0.6 * mouth({"aa": 1.0})[0])


def test_a_mouth_follows_visemes_at_once_and_marks_that_are_seen_before_them() -> None:
    face, wide = Countenance(), Speech(-20.0, np.eye(len(VISEMES))[VISEMES.index("aa")])
    jaw = RULES.names.index("AU26")
    opening = [face.step(Posture(), n * SECOND // 100, wide).expression.intensity[jaw] for n in range(10)]
    assert opening[-1] > 0.4 and opening[4] > 0.8 * opening[-1]
    seen = Countenance()
    for n in range(100):
        state = seen.step(Posture(face=REST), n * SECOND // 60, wide)
    assert state.expression.intensity[jaw] == 0.0


def test_a_posture_between_two_has_the_face_between_them() -> None:
    a, b = Posture(face=REST, lids=np.ones(2)), Posture(face=REST + 0.01, lids=np.zeros(2))
    middle = interpolate(a, b, 0.5)
    assert middle.face is not None
    assert np.allclose(middle.face, REST + 0.005)
    assert middle.lids is not None
    assert np.allclose(middle.lids, 0.5)
    assert interpolate(Posture(), b, 0.2).face is None
    assert interpolate(Posture(), b, 0.8).face is not None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[units]]\nname = "AU1"\ntitle = "x"\nmarks = { nose = [0, 1] }', "there is no mark 'nose'"),
        ('[[units]]\nname = "AU1"\ntitle = "x"\n[[units]]\nname = "AU1"\ntitle = "x"', "AU1 twice"),
        ('[[units]]\nname = "AU1"\ntitle = "x"\n[visemes]\nxx = { AU1 = 1 }', "there is no viseme xx; there are sil, PP"),
        ('[[units]]\nname = "AU1"\ntitle = "x"\n[visemes]\nPP = { AU2 = 1 }', "visemes: there is no unit AU2"),
        ('[[units]]\nname = "AU1"\ntitle = "x"\n[visemes]\nPP = { AU1 = 7 }', "visemes.PP.AU1"),
        ("[[units]]", "name"),
        ("units = ", "not valid TOML"),
    ],
)
def test_a_file_of_rules_that_is_wrong_is_reported_in_a_line(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "rules.toml"
    file.write_text(text)
    with pytest.raises(FaceRuleError, match=said):
        load_rules(file)
    with pytest.raises(FaceRuleError, match="cannot be read"):
        load_rules(tmp_path / "none.toml")
