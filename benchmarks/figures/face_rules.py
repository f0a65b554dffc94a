"""Rules of the face on another head: ICT-FaceKit's fourteen expressions, seen by the simulated face and eye cameras.

The thirteen marks are stuck to the neutral head at its published landmarks. Of each expression the marks are drawn into the face
camera's picture, found there again, read as action units, and the units move the neutral head; blinks come from the eye camera's
lids. The rules were written after the literature and looked at on MakeHuman's targets, not on these shapes.
"""

import gzip
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.row import Row, at_least, at_most
from vistel.arrays import F64
from vistel.figure.face.intensities import MarkReader
from vistel.figure.face.landmarks import Landmarks
from vistel.figure.face.marks import MARK_INDEX, MARKS, REST
from vistel.figure.face.rules import SIDES, builtin_rules
from vistel.figure.face.shape import Expression, FaceShape
from vistel.vision.eye_reader import EyeReader
from vistel.vision.face_calibration import calibrate_face
from vistel.vision.face_reader import FaceReader
from vistel_sim.pictures.eye import EyePicture
from vistel_sim.pictures.face import FacePicture

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "face" / "ict"
SKIN = 9409
"""Vertices of the face itself; the others are the back of the head, teeth, eyes."""
MOVES_M = 0.0005
"""What moves less is no part of the moving region."""
EXPECTED = {
    "jawOpen": "AU26", "mouthSmile_L": "left_AU12", "mouthSmile_R": "right_AU12", "eyeBlink_L": "left_AU45",
    "eyeBlink_R": "right_AU45", "browInnerUp_L": "left_AU1", "browInnerUp_R": "right_AU1", "browDown_L": "left_AU4",
    "browDown_R": "right_AU4", "mouthPucker": "AU18", "mouthFunnel": "AU22", "cheekPuff_L": "left_AU34",
    "cheekPuff_R": "right_AU34", "mouthClose": "AU8",
}  # fmt: skip
# Of the 68 usual landmarks; the person's left has x > 0.
_LANDMARK = {
    "left_inner_brow": 22,
    "right_inner_brow": 21,
    "left_outer_brow": 25,
    "right_outer_brow": 18,
    "left_nose_wing": 35,
    "right_nose_wing": 31,
    "left_mouth_corner": 54,
    "right_mouth_corner": 48,
    "upper_lip": 51,
    "lower_lip": 57,
}


class MarkedHead:
    """The neutral head and where its marks are stuck."""

    def __init__(self) -> None:
        self.neutral = 0.01 * _vertices(DATA / "generic_neutral_mesh.obj")
        known = json.loads((DATA / "vertex_indices.json").read_text("utf-8"))["idx_to_landmark_verts"]
        eyes = np.array([self.neutral[a:b].mean(axis=0) for a, b in ((21451, 22221), (23021, 23791))])
        if eyes[0, 0] < 0.0:
            eyes = eyes[::-1]
        skin = self.neutral[:SKIN]
        self.stuck = np.zeros(len(MARKS), np.int64)
        for mark, k in _LANDMARK.items():
            self.stuck[MARK_INDEX[mark]] = known[k]
        at = self.neutral[self.stuck]
        lips = 0.5 * (at[MARK_INDEX["upper_lip"]] + at[MARK_INDEX["lower_lip"]])
        for side, sign in (("left", 1.0), ("right", -1.0)):
            corner, wing = at[MARK_INDEX[f"{side}_mouth_corner"]], at[MARK_INDEX[f"{side}_nose_wing"]]
            # Beside the nose, above the corner of the mouth, as on the standard face.
            self.stuck[MARK_INDEX[f"{side}_cheek"]] = _foremost(skin, (corner[0] + 0.014 * sign, wing[1] + 0.004))
        self.stuck[MARK_INDEX["chin"]] = _foremost(skin, (0.0, lips[1] - 0.031))
        between = self.neutral[[known[62], known[66]]].mean(axis=0)
        self.landmarks = Landmarks.of_marks(self.neutral[self.stuck], eyes, between)
        self.shape = FaceShape(skin, self.landmarks)

    def expression(self, name: str) -> F64:
        """(SKIN, 3) vertices at its full."""
        return 0.01 * _vertices(DATA / "expressions" / f"{name}.obj.gz")[:SKIN]


def rows() -> Iterator[Row]:
    if not DATA.is_dir():
        print(f"wrinkle: no head at {DATA}; the rows of the face are left out", file=sys.stderr)
        return
    head, rules = MarkedHead(), builtin_rules()
    reader = MarkReader(rules)
    case = "ICT head, 14 expressions through the face camera"
    errors: list[float] = []
    moved: list[float] = []
    right = 0
    for n, (name, expected) in enumerate(EXPECTED.items()):
        true = head.expression(name)
        expression = seen(head, reader, true, name, n)
        shut = int(np.argmin(expression.lids))
        strongest = reader.strongest(expression.intensity)
        named = "nothing" if strongest is None else rules.names[strongest]
        if strongest is None and expression.lids[shut] < 0.5:
            named = f"{SIDES[shut]}_AU45"
        error, motion = measured(head, expression, true)
        right += named == expected
        errors.append(error)
        moved.append(motion)
        yield Row("wrinkle", f"ICT {name}: {motion:.1f} mm of motion, named {named}", "mean vertex error", "mm", error)
    mean = float(np.mean(errors))
    yield Row(
        "wrinkle",
        case,
        "mean vertex error, moving region",
        "mm",
        mean,
        "the neutral head",
        float(np.mean(moved)),
        target=at_most(1.5),
    )
    share = 100.0 * right / len(EXPECTED)
    yield Row("wrinkle", case, "right action unit named", "%", share, target=at_least(90))


def seen(head: MarkedHead, reader: MarkReader, true: F64, name: str, seed: int) -> Expression:
    """What the cameras make of an expression."""
    # Marks as they would be on the standard face: the helmet's camera looks along the head's axis.
    scale = head.landmarks.scale
    moved = (true[head.stuck] - head.neutral[head.stuck])[:, :2] / scale
    painter = FacePicture(seed)
    camera = FaceReader(calibrate_face([painter.draw(REST, k) for k in range(30)]))
    marks = None
    for k in range(20):  # the face moves there within a third of a second
        share = min(1.0, k / 12.0)
        marks = camera.read(painter.draw(REST + share * moved, 100 + k), 1.0 / 60.0).marks
    lids = _lids(name, seed)
    if marks is None:
        return Expression(np.zeros(len(reader.rules.units)), None, lids)
    intensity, moved = reader.read(marks)
    return Expression(intensity, moved, lids)


def measured(head: MarkedHead, e: Expression, true: F64) -> tuple[float, float]:
    """Mean error and mean true motion over what moves in truth [mm]. What moves though it should not adds to the error without
    widening what the mean is taken over: spreading a motion thin wins nothing."""
    made = head.neutral[:SKIN].copy()
    made[head.shape.vertex] += head.shape.offsets(e)
    motion = np.linalg.norm(true - head.neutral[:SKIN], axis=1)
    moves = motion > MOVES_M
    wrong = np.linalg.norm(made - true, axis=1)
    counted = moves | (np.linalg.norm(made - head.neutral[:SKIN], axis=1) > MOVES_M)
    return 1e3 * float(wrong[counted].sum() / moves.sum()), 1e3 * float(motion[moves].mean())


def _lids(name: str, seed: int) -> tuple[float, float]:
    """Of an eye that blinks, if the expression is one, as the eye camera sees it."""
    out = [1.0, 1.0]
    for eye, side in enumerate("LR"):
        painter, camera = EyePicture(seed + eye), EyeReader()
        opening = 0.0 if name == f"eyeBlink_{side}" else 1.0
        reading = None
        for k in range(40):
            now = 1.0 if k < 25 else opening
            reading = camera.read(painter.draw(np.zeros(2), now, k))
        out[eye] = float(np.clip(reading.opening, 0.0, 1.0)) if reading is not None else 1.0
    return out[0], out[1]


def _foremost(v: F64, at: tuple[float, float]) -> int:
    near = np.hypot(v[:, 0] - at[0], v[:, 1] - at[1])
    close = np.flatnonzero(near < near.min() + 0.003)
    return int(close[np.argmax(v[close, 2])])


def _vertices(path: Path) -> F64:
    data = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    return np.array([[float(x) for x in line.split()[1:4]] for line in data.decode().splitlines() if line.startswith("v ")])
