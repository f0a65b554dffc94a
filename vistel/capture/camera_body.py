"""What a camera sees of a seated guest, as poses of chest, head and hands in the seat's frame, with fingers and face; and how far
each is to be believed. No bus, no clock: times come with the messages.

A camera tells directions well and distances badly, so the person's own measures are found first, while they sit upright, look at
the camera and raise both hands; who begins without that is measured by their first pictures.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.capture.followed import Followed, Followers
from vistel.capture.one_euro import AngleFilter
from vistel.figure.face.from_mesh import MeshFace
from vistel.figure.posture.channel import MatrixPose
from vistel.figure.posture.from_picture import (
    FOCAL,
    PALM_JOINTS,
    Arm,
    arm_of,
    fingers_of,
    fitted,
    palm_of,
    ray,
    turn_between,
    unprojected,
)
from vistel.figure.posture.hands import hand_rotation
from vistel.figure.posture.limits import SIDES, hand_within_limits
from vistel.figure.posture.posture import collar_scale
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.geometry.rotation import matrix_from_rotvec, rotvec_from_matrix
from vistel.protocol.pages.camera_body import BODY, FACE, HAND_POINTS
from vistel.v1.device_pb2 import CameraBodyFrame

FIRST = 15
"""Pictures by which somebody is measured who has not been calibrated."""
MOST_KEPT = 400
"""Pictures of a calibration that count, the newest: ten seconds at 30 Hz and some."""
SELDOM = 10
"""After the first pictures the measures are found anew with every tenth: that takes milliseconds."""
VISIBLE = 0.5
"""Landmarks that are less visible than this are guessed."""
FARTHEST_AWAY_M = 4.0
"""From the camera, people are taken to sit no farther [m]."""
NARROWEST = 0.05
"""Shoulders that are less broad are nobody's before this camera [picture heights]."""
SMALLEST = 0.01
"""A hand or a face that is smaller is none [picture heights]."""
INSIDE = 0.5
"""What is farther above or below the picture's middle is outside of it [picture heights]."""
PALM = 0.95
"""Networks see palms so much smaller than they are, before somebody has raised theirs..."""
SMALLEST_PALM = 0.8
"""... and at most so much."""
MOST_YAW = math.radians(60.0)
"""A chest that is turned farther aside is not believed [rad]."""
DOUBT_M = 0.03
"""One shoulder that seems nearer than the other by no more than this may not be [m]."""
BEND = 1.4
"""How much more the chest leans than the line from the seat to it: the spine bends [1]."""
HEAD_LEADS = 0.85
"""Share of the shoulders' distance from the camera that is taken from the head's; the rest is from their own breadth."""
SMOOTH = (1.2, 14.0)
"""Of directions and depths: cut-off at rest [Hz], and how it rises with speed [Hz per picture height or metre a second]."""
SMOOTH_DEPTH = (0.6, 3.0)
"""The same of what the landmarks say of depth [Hz, Hz per m/s]."""
SMOOTH_TURN = (1.2, 5.0)
"""The same of rotation vectors and fingers [Hz, Hz per rad/s]."""
_CORNERS = [FACE.index(n) for n in FACE if n.endswith("r_corner")]
_RIGID = [*_CORNERS, *(FACE.index(n) for n in ("between_eyes", "forehead", "nose", "left_temple", "right_temple"))]
"""Points of a face that no expression moves."""
_AT = {name: n for n, name in enumerate(BODY)}
_MOST_GAP_S = 60.0


class Picture(NamedTuple):
    """A frame as arrays, in picture heights, but the body's z in metres; None: not seen. visibility: (9,)."""

    body: F64
    visibility: F64
    hands: Mapping[str, F64]
    face: F64 | None


def picture_of(frame: CameraBodyFrame) -> Picture | None:
    """None where nobody is seen who sits before the camera: shoulders are level, more or less, the left one to the right."""
    if len(frame.body) != 3 * len(BODY) or len(frame.visibility) != len(BODY):
        return None
    body = np.reshape(np.array(frame.body, np.float64), (-1, 3)) * (1e-4, 1e-4, 1e-3)
    across = body[_AT["left_shoulder"]] - body[_AT["right_shoulder"]]
    if across[0] < max(NARROWEST, abs(float(across[1]))):
        return None
    points = {"left": frame.left_hand, "right": frame.right_hand, "face": frame.face}
    wanted = {"left": HAND_POINTS, "right": HAND_POINTS, "face": len(FACE)}
    found = {n: np.reshape(np.array(p, np.float64), (-1, 3)) * 1e-4 for n, p in points.items() if len(p) == 3 * wanted[n]}
    hands = {n: p for n, p in found.items() if float(np.ptp(p[:, :2], axis=0).max()) > SMALLEST}
    face = hands.pop("face", None)
    return Picture(body, np.array(frame.visibility, np.float64) / 255.0, hands, face)


@dataclass(frozen=True)
class Measured:
    """What calibration found. face: (22, 3) at rest, from the middle of its rigid points, and eyes: (3,) their middle from the
    camera, both in units of the face's distance from it; breadth: of a metre at the shoulders [picture heights]; turned: how much
    nearer the left shoulder seemed [m]; shoulders: (2,) their middle [picture heights]. The person's shoulders count as broad as
    the figure's, and their arms as long."""

    face: F64
    eyes: F64
    breadth: float
    turned: float
    shoulders: F64


PARTS = ("chest", "head", "face", "left_hand", "right_hand", "left_fingers", "right_fingers")


class CameraBody:
    """Follows one guest. All places are in their seat's frame."""

    def __init__(self, skeleton: Skeleton, base: F64) -> None:
        """base: (3,) of the spine when they sit."""
        rest, spine = skeleton.rest, JOINT_INDEX["spine_1"]
        top = base + np.array((0.0, skeleton.spine, 0.0))

        def seated(*joints: str) -> F64:
            return top + np.mean([rest[JOINT_INDEX[j]] for j in joints], axis=0) - rest[spine] - (0.0, skeleton.spine, 0.0)

        self._base, self._top = base, top
        self._eyes_at_rest = seated("left_eye", "right_eye")
        self._eyes = self._eyes_at_rest - seated("head")
        self._middle = seated("left_upper_arm", "right_upper_arm")
        self._shoulder = {s: seated(f"{s}_upper_arm") - top for s in SIDES}
        self._collar = seated("left_shoulder") - top
        self._from_collar = {s: self._shoulder[s] - (seated(f"{s}_shoulder") - top) for s in SIDES}
        self._shortening = skeleton.collar_shortening
        hanging = 2.0 * (self._collar[0] + _collar(-1.0, self._shortening) * self._from_collar["left"][0])
        self._breadth = float(hanging)
        self._arms = np.array((skeleton.upper_arm, skeleton.lower_arm))
        self._palm = {
            s: np.array([rest[JOINT_INDEX[f"{s}_{j}"]] - rest[JOINT_INDEX[f"{s}_hand"]] for j in PALM_JOINTS]) for s in SIDES
        }
        thumb = ("thumb_metacarpal", "thumb_proximal", "thumb_distal")
        bones = pairwise([rest[JOINT_INDEX[f"left_{j}"]] for j in thumb])
        self._thumb = {name: b - a for name, (a, b) in zip(thumb, bones, strict=False)}
        self._kept: list[Picture] = []
        self._calibrating, self._counted = False, 0
        self._measured: Measured | None = None
        self._mesh: MeshFace | None = None
        self._filters: dict[str, AngleFilter] = {}
        self._sizes: list[float] = []
        self._palms = PALM
        self._distances: dict[str, tuple[float, F64]] = {}
        self._parts = Followers(PARTS)
        self._t, self._begun_ns = -math.inf, 0

    @property
    def seen(self) -> bool:
        """Whether anything of the guest is as the camera sees it."""
        return self._parts.seen

    def take(self, frame: CameraBodyFrame) -> None:
        """What the camera sees; a picture that is older than the last is left out."""
        self._begun_ns = self._begun_ns or frame.picture_t_ns
        t = (frame.picture_t_ns - self._begun_ns) * 1e-9
        if t <= self._t:
            return
        dt = min(_MOST_GAP_S, t - self._t)
        self._t = t
        self._parts.arrive(frame.header.t_ns, dt if dt < _MOST_GAP_S else None)
        picture = picture_of(frame)
        if picture is None:
            return
        self._measure(picture, calibrating=frame.calibrating)
        if self._measured is not None and self._mesh is not None:
            self._follow(picture, self._measured, self._mesh, dt)

    def at(self, t_ns: int, dt: float, without: frozenset[str] = frozenset()) -> dict[str, Followed]:
        """See `Followers.at`."""
        return self._parts.at(t_ns, dt, without)

    def _measure(self, picture: Picture, *, calibrating: bool) -> None:
        if calibrating and not self._calibrating:
            self._kept, self._counted, self._sizes, self._palms = [], 0, [], PALM
        self._calibrating = calibrating
        if picture.face is None or not (calibrating or len(self._kept) < FIRST):
            return
        self._kept = [*self._kept, picture][-MOST_KEPT:]
        self._counted += 1
        if self._counted > FIRST and self._counted % SELDOM:
            return
        # Who raises their arms leans, and lifts the marks of the shoulders.
        hanging = [p for p in self._kept if _hanging(p.body)] or self._kept
        faces = np.array([unprojected(p.face) for p in hanging if p.face is not None])
        eyes = np.median(faces[:, _CORNERS].mean(axis=1), axis=0)
        face = np.median(faces - faces[:, _RIGID].mean(axis=1, keepdims=True), axis=0)
        bodies = np.array([p.body for p in hanging])
        shoulders = bodies[:, [_AT["left_shoulder"], _AT["right_shoulder"]]]
        breadth = max(1e-3, float(np.median([_broad(body) / self._collars(body) for body in bodies])))
        middle = np.median(shoulders[:, :, :2].mean(axis=1), axis=0)
        self._measured = Measured(face, eyes, breadth, float(np.median(shoulders[:, 0, 2] - shoulders[:, 1, 2])), middle)
        self._mesh = MeshFace(dict(zip(FACE, face, strict=True)))

    def _follow(self, picture: Picture, measured: Measured, mesh: MeshFace, dt: float) -> None:
        away = min(FARTHEST_AWAY_M, FOCAL / measured.breadth)  # of the shoulders at calibration [m]
        head_away = away - (self._eyes_at_rest[2] - self._middle[2])
        camera = self._eyes_at_rest - head_away * measured.eyes
        ahead = self._head(picture, measured, mesh, camera, head_away)
        chest = self._chest(picture, measured, camera, away, None if ahead is None else ahead - head_away)
        for s in SIDES:
            self._arm(s, picture, camera, chest, dt)

    def _scale(self, body: F64, side: str) -> float:
        """How long the collar bone is, which is shorter the higher the arm is raised."""
        raised = body[_AT[f"{side}_elbow"], 1] - body[_AT[f"{side}_shoulder"], 1]
        return _collar(raised / max(1e-3, _broad(body)) * self._breadth / float(self._arms[0]), self._shortening)

    def _collars(self, body: F64) -> float:
        """How broad the shoulders are [m]."""
        return sum(abs(float((self._shoulder[s] + (self._scale(body, s) - 1.0) * self._from_collar[s])[0])) for s in SIDES)

    def _head(self, picture: Picture, measured: Measured, mesh: MeshFace, camera: F64, head_away: float) -> float | None:
        """How far the head is from the camera; None where it is not seen."""
        if picture.face is None:
            return None
        mesh_now = unprojected(picture.face)
        placed = fitted(measured.face[_RIGID], mesh_now[_RIGID])
        away = head_away / max(0.2, placed.scale)
        at = away * (placed.shift + placed.scale * placed.rotation @ measured.face[_CORNERS].mean(axis=0))
        at = self._smooth("eyes", at, *SMOOTH)
        rotation = self._smooth_turn("head", placed.rotation @ turn_between(np.array((0.0, 0.0, 1.0)), -measured.eyes))
        self._parts.aim("head", camera + at - rotation @ self._eyes, rotation)
        own = (mesh_now - placed.shift) @ placed.rotation / max(0.01, placed.scale)
        points: dict[str, F64] = dict(zip(FACE, own, strict=True))
        marks = self._smooth("marks", mesh.marks(points).ravel() * 100.0, *SMOOTH) / 100.0
        gaze = self._smooth("gaze", mesh.gaze(points), *SMOOTH_TURN)
        self._parts.aim("face", np.zeros(3), np.eye(3), np.concatenate((marks, gaze, mesh.lids(points))))
        return away

    def _chest(self, picture: Picture, measured: Measured, camera: F64, away: float, moved: float | None) -> MatrixPose:
        """The chest at the top of the spine. moved: how much farther the head is than at calibration [m]."""
        left, right = (picture.body[_AT[f"{s}_shoulder"]] for s in SIDES)
        turned = float(self._smooth("turned", np.array((left[2] - right[2] - measured.turned,)), *SMOOTH_DEPTH)[0])
        turned = math.copysign(max(0.0, abs(turned) - DOUBT_M), turned)
        yaw = min(MOST_YAW, max(-MOST_YAW, math.asin(min(1.0, max(-1.0, -turned / self._breadth)))))
        ends = self._smooth("shoulders", np.concatenate((left[:2], right[:2])), *SMOOTH)
        left_at, right_at = ends[:2], ends[2:]
        broad = max(1e-3, float(np.linalg.norm(left_at - right_at)))
        own = FOCAL * self._collars(picture.body) * math.cos(yaw) / broad
        distance = own if moved is None else HEAD_LEADS * (away + moved) + (1.0 - HEAD_LEADS) * own
        distance = float(self._smooth("shoulders away", np.array((distance,)), *SMOOTH)[0])
        at_rest = camera + away * ray(measured.shoulders)
        middle = camera + distance * ray(0.5 * (left_at + right_at)) + self._middle - at_rest
        across = np.array((*(left_at - right_at) / broad * math.cos(yaw), -math.sin(yaw)))
        lean = rotvec_from_matrix(turn_between(self._middle - self._base, middle - self._base))
        up = _rotation(BEND * lean)[:, 1]
        up = up - (up @ across) * across
        up /= max(1e-6, float(np.linalg.norm(up)))
        rotation = np.column_stack((across, up, np.cross(across, up)))
        top = middle - rotation @ (self._middle - self._top)
        chest = MatrixPose(top, rotation)
        self._parts.aim("chest", top + rotation @ self._collar, rotation)
        return chest

    def _arm(self, side: str, picture: Picture, camera: F64, chest: MatrixPose, dt: float) -> None:
        shoulder_at, elbow_at, wrist_at = (picture.body[_AT[f"{side}_{n}"]] for n in ("shoulder", "elbow", "wrist"))
        hand = picture.hands.get(side)
        if hand is None and (picture.visibility[_AT[f"{side}_wrist"]] < VISIBLE or abs(wrist_at[1]) > INSIDE):
            self._distances.pop(side, None)
            return
        sign = SIDES[side]
        wrist_xy = wrist_at[:2] if hand is None else hand[0, :2]
        found = self._smooth(f"{side} arm", np.concatenate((elbow_at[:2], wrist_xy)), *SMOOTH)
        depths = np.array((elbow_at[2], wrist_at[2])) - shoulder_at[2]
        depths = self._smooth(f"{side} depths", depths, *SMOOTH_DEPTH)
        mesh = None if hand is None else unprojected(hand)
        placed = None if mesh is None else palm_of(mesh, self._palm[side])
        palm = None if placed is None else self._palms / max(0.1, placed.scale)
        collar = self._shoulder[side] + (self._scale(picture.body, side) - 1.0) * self._from_collar[side]
        shoulder = chest.position + chest.rotation @ collar
        last = self._distances.get(side)
        if palm is not None and self._calibrating and not _hanging(picture.body):
            bare = arm_of(Arm(found[:2], found[2:], depths), camera, shoulder, self._arms, None if last is None else last[1], dt)
            self._sizes = [*self._sizes, float(bare[2][1]) / palm * self._palms][-MOST_KEPT:]
            self._palms = min(1.0, max(SMALLEST_PALM, float(np.median(self._sizes))))
        arm = Arm(found[:2], found[2:], depths, palm)
        elbow, wrist, distances = arm_of(arm, camera, shoulder, self._arms, None if last is None else last[1], dt)
        self._distances[side] = self._t, distances
        if mesh is None or placed is None:
            fore = (wrist - elbow) / max(1e-6, float(np.linalg.norm(wrist - elbow)))
            rotation = hand_rotation(sign, fore, np.array((-sign * 0.8, -0.5, 0.3)))
        else:
            rotation = self._smooth_turn(f"{side} hand", placed.rotation)
            fingers = hand_within_limits(fingers_of(mesh, placed.rotation, sign, self._thumb))
            self._parts.aim(f"{side}_fingers", np.zeros(3), np.eye(3), self._smooth(f"{side} fingers", fingers, *SMOOTH_TURN))
        self._parts.aim(f"{side}_hand", wrist, rotation, _elbow(shoulder, elbow, wrist, chest.rotation))

    def _smooth_turn(self, name: str, rotation: F64) -> F64:
        """As `_smooth`, of a rotation (3, 3)."""
        u, _, vt = np.linalg.svd(np.reshape(self._smooth(name, rotation.ravel(), *SMOOTH_TURN), (3, 3)))
        return np.ascontiguousarray(u @ vt)

    def _smooth(self, name: str, values: F64, cutoff_hz: float, gain: float) -> F64:
        found = self._filters.get(name)
        if found is None:
            found = self._filters[name] = AngleFilter(cutoff_hz, gain, restart_s=max(0.5, 3.0 * self._parts.interval))
        return found.update(self._t, values)


def _collar(along: float, shortening: float) -> float:
    """`collar_scale` of an upper arm whose direction has the height `along`: -1 hanging .. 1 overhead."""
    upper_arm = np.eye(3)
    upper_arm[1, 0] = along
    return collar_scale(upper_arm, 1.0, shortening)


def _broad(body: F64) -> float:
    """How broad the shoulders are in the picture."""
    across = body[_AT["left_shoulder"]] - body[_AT["right_shoulder"]]
    return math.hypot(across[0], across[1])


def _hanging(body: F64) -> bool:
    """Whether both hands are below the shoulders."""
    return bool(body[[_AT["left_wrist"], _AT["right_wrist"]], 1].max() < body[_AT["left_shoulder"], 1])


def _elbow(shoulder: F64, elbow: F64, wrist: F64, chest: F64) -> F64:
    """(3,) offset of an elbow from the line between shoulder and wrist [m], in the chest's frame."""
    along = wrist - shoulder
    aside = elbow - shoulder - along * float((elbow - shoulder) @ along) / max(1e-9, float(along @ along))
    return chest.T @ aside


def _rotation(rotvec: F64) -> F64:
    return matrix_from_rotvec(np.ascontiguousarray(rotvec))
