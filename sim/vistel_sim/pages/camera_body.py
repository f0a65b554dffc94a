"""What a camera in front of a seated person would find of them in its picture: landmarks of a known posture, with noise."""

from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.from_picture import FOCAL
from vistel.figure.posture.limits import SIDES
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import FINGERS, JOINT_INDEX, REFERENCE_HEIGHT, Skeleton
from vistel.protocol.pages.camera_body import FACE, Point, Seen

_JOINT = {"shoulder": "upper_arm", "elbow": "lower_arm", "wrist": "hand", "hip": "upper_leg"}
_MIDDLE_MM = {
    "between_eyes": (0, 78, 96),
    "forehead": (0, 128, 88),
    "nose": (0, 44, 118),
    "upper_lip": (0, 18, 104),
    "lower_lip": (0, 17, 104),
    "chin": (0, -14, 92),
}
_LEFT_MM = {
    "temple": (72, 58, 18),
    "outer_corner": (46, 74, 74),
    "inner_corner": (17, 73, 84),
    "upper_lid": (32, 80, 90),
    "lower_lid": (32, 69, 88),
    "iris": (32, 75, 88),
    "mouth_corner": (25, 17, 92),
    "brow": (30, 96, 92),
}


def face_at_rest() -> F64:
    """(22, 3) points of a face in the head's frame [m], of a person of REFERENCE_HEIGHT."""
    rows = [
        _MIDDLE_MM[n] if n in _MIDDLE_MM else np.array(_LEFT_MM[n.split("_", 1)[1]]) * (1 if n.startswith("left_") else -1, 1, 1)
        for n in FACE
    ]
    return np.array(rows, np.float64) * 1e-3


@dataclass
class SimulatedCamera:
    """A camera that looks along -Z of the seat's frame. position: (3,) [m]; focal: in picture heights; noise: of a point in the
    picture [picture heights]; depth_noise: of the body's depths [m]; its picture is `aspect` times as wide as high."""

    position: F64 = field(default_factory=lambda: np.array((0.0, 1.2, 1.1)))
    focal: float = FOCAL
    noise: float = 0.0
    depth_noise: float = 0.0
    aspect: float = 4.0 / 3.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Its noise is its own."""
        self._random = np.random.default_rng(self.seed)

    def see(self, skeleton: Skeleton, joints: JointPose, face: F64 | None = None) -> Seen:
        """A person, joints in the seat's frame; face: (22, 3) in the head's frame [m], by default at rest."""
        scale, head = skeleton.height / REFERENCE_HEIGHT, JOINT_INDEX["head"]
        points = (face_at_rest() if face is None else face) * scale
        in_seat = joints.position[head] + points @ joints.rotation[head].T
        body = np.array([in_seat[FACE.index("nose")], *(self._joint(joints, j, s) for j in _JOINT.values() for s in SIDES)])
        at = self._across(body)
        depth = body[:, 2] - body[-2:, 2].mean() + self.depth_noise * self._random.standard_normal(len(body))
        inside = (np.abs(at[:, 0]) < 0.5 * self.aspect) & (np.abs(at[:, 1]) < 0.5)
        hands = {s: self._mesh(self._hand(skeleton, joints, s)) if self.sees_hand(joints, s) else () for s in SIDES}
        return Seen(
            [(float(x), float(y), float(z)) for (x, y), z in zip(at, depth, strict=True)],
            [0.95 if there else 0.1 for there in inside],
            hands["left"],
            hands["right"],
            self._mesh(in_seat),
        )

    def _joint(self, joints: JointPose, name: str, side: str) -> F64:
        return joints.position[JOINT_INDEX[f"{side}_{name}"]]

    def sees_hand(self, joints: JointPose, side: str) -> bool:
        """Whether a hand is in the picture."""
        at = self._across(self._joint(joints, "hand", side)[None])[0]
        return bool(abs(at[0]) < 0.5 * self.aspect - 0.05 and abs(at[1]) < 0.45)

    def _hand(self, skeleton: Skeleton, joints: JointPose, side: str) -> F64:
        """(21, 3) points of a hand."""
        rows = [self._joint(joints, "hand", side)]
        for finger in FINGERS:
            digits = ("metacarpal", "proximal", "distal") if finger == "thumb" else ("proximal", "intermediate", "distal")
            names = [JOINT_INDEX[f"{side}_{finger}_{digit}"] for digit in digits]
            rows += [joints.position[j] for j in names]
            rows.append(joints.position[names[-1]] + joints.rotation[names[-1]] @ skeleton.tip[names[-1]])
        return np.array(rows)

    def _across(self, points: F64) -> F64:
        """(n, 2) where points (n, 3) are in the picture."""
        seen = points - self.position
        at = self.focal * seen[:, :2] / -seen[:, 2:]
        return at + self.noise * self._random.standard_normal(at.shape)

    def _mesh(self, points: F64) -> list[Point]:
        """As a network finds the points of a small thing: with depths against its first point, all in picture heights."""
        per_metre = self.focal / -(points[0, 2] - self.position[2])
        depths = (points[:, 2] - points[0, 2]) * per_metre + 2.0 * self.noise * self._random.standard_normal(len(points))
        return [(float(x), float(y), float(z)) for (x, y), z in zip(self._across(points), depths, strict=True)]
