"""Body measures of a shape of the model, defined as ANSUR II's are (Gordon and others 2014, Natick/TR-15/007) as far as a mesh that
stands with its arms held off and at rest allows. `data/ansur.toml` has the measured people's; `COLUMNS` says which of ANSUR's
measures each is.

Not as there: the span adds up the arm's bones, breadth over the shoulders is that of arms let down, and girths are the shortest way
round a plane section, as a tape takes it."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial import ConvexHull

from vistel.arrays import F64, I32
from vistel.figure.body_model.model import BodyModel, Shape
from vistel.figure.skeleton import JOINTS, finger_joints

COLUMNS = {
    "stature": "stature", "span": "span", "acromion height": "acromialheight", "waist height": "waistheightomphalion",
    "crotch height": "crotchheight", "knee height": "kneeheightmidpatella", "ankle height": "lateralmalleolusheight",
    "biacromial breadth": "biacromialbreadth", "shoulder breadth": "bideltoidbreadth", "chest depth": "chestdepth",
    "waist breadth": "waistbreadth", "waist depth": "waistdepth", "hip breadth": "hipbreadth",
    "buttock depth": "buttockdepth", "head length": "headlength", "head breadth": "headbreadth",
    "head girth": "headcircumference", "face breadth": "bizygomaticbreadth", "face height": "mentonsellionlength",
    "eye distance": "interpupillarybreadth", "ear length": "earlength", "ear breadth": "earbreadth",
    "upper arm length": "shoulderelbowlength", "forearm length": "radialestylionlength",
    "forearm-hand length": "forearmhandlength", "hand length": "handlength", "palm length": "palmlength",
    "hand breadth": "handbreadth", "hand girth": "handcircumference", "foot length": "footlength",
    "foot breadth": "footbreadthhorizontal", "neck girth": "neckcircumference", "chest girth": "chestcircumference",
    "waist girth": "waistcircumference", "hip girth": "buttockcircumference", "thigh girth": "thighcircumference",
    "upper arm girth": "bicepscircumferenceflexed", "forearm girth": "forearmcircumferenceflexed",
    "calf girth": "calfcircumference", "ankle girth": "anklecircumference", "wrist girth": "wristcircumference",
}  # fmt: skip
"""Our name of each measure, and ANSUR II's."""
_MIDDLE = 0.003
"""So near the middle a vertex counts as in it [m]."""
_ACROMION = 0.010
"""The tip of a shoulder blade is so much farther out than the joint's middle [m]: a third of its reach over a humeral head of 24 mm
(acromion index 0.65, Nyffeler and others 2006)."""
_FLEXED_ARM = 1.07
"""ANSUR II has the girth of an upper arm with the elbow bent and the muscles tense: about so much more than at rest."""
_FLEXED_FOREARM = 1.03
"""The same for the forearm."""
_NAVEL = "stomach-navel-in"
"""The target that moves a navel most."""
_NIPPLE = "nipple-point-incr"
"""The target that moves a nipple most."""
_EAR = "ear-trans-up"
"""The target that moves an ear as a whole."""


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Rows of the skin by which measures are taken, the same for all people. trunk, leg, arm, hand, head, foot: of one side where
    there are two; ear: of the left one."""

    trunk: I32
    leg: I32
    arm: I32
    hand: I32
    foot: I32
    head: I32
    ear: I32
    navel: int
    nipple: int
    crotch: int
    acromion: int
    menton: int
    sellion: int
    fingertip: int
    edges: dict[str, I32]


@cache
def landmarks(model: BodyModel) -> Landmarks:
    """Of a model, found on its base."""
    usual = model.stood(model.base.astype(np.float64))
    p, at = usual.points[: model.body], usual.joints
    joint = np.array([_limb(j) for j in [*JOINTS, *["left arm", "left arm", "right arm", "right arm"]]])
    of = joint[model.bone[: model.body, 0]]
    group = {name: np.flatnonzero(of == name).astype(np.int32) for name in np.unique(of)}
    middle = np.flatnonzero(np.abs(p[:, 0]) < _MIDDLE)
    crotch = middle[(p[middle, 1] > at["left_lower_leg"][1]) & (p[middle, 1] < at["hips"][1])]
    shoulder = at["left_upper_arm"]
    # The tip of the shoulder blade is over the joint's outer side.
    over = np.flatnonzero((np.abs(p[:, 0] - shoulder[0] - 0.012) < 0.008) & (np.abs(p[:, 2] - shoulder[2]) < 0.03))
    eye = at["left_eye"]
    front = middle[p[middle, 2] > eye[2] - 0.02]
    chin = front[(p[front, 1] < eye[1] - 0.07) & (p[front, 1] > eye[1] - 0.16) & (p[front, 2] > p[front, 2].max() - 0.045)]
    bridge = front[np.abs(p[front, 1] - eye[1] - 0.006) < 0.012]
    hand = group["left hand"]
    edges = {
        name: _edges(model.closed, np.concatenate([group[g] for g in groups]))
        for name, groups in (
            ("torso", ("trunk", "left leg", "right leg")),
            ("neck", ("trunk", "head")),
            ("leg", ("left leg", "left foot")),
            ("arm", ("left arm", "left hand")),
            ("hand", ("left hand",)),
        )
    }
    mean, tip = at["left_middle_distal"] - at["left_hand"], p[hand] - at["left_hand"]
    return Landmarks(
        trunk=np.concatenate([group["trunk"], group["left leg"], group["right leg"]]),
        leg=group["left leg"],
        arm=group["left arm"],
        hand=hand,
        foot=group["left foot"],
        head=group["head"],
        ear=_moved(model, _EAR, p),
        navel=_most(model, _NAVEL, p),
        nipple=_most(model, _NIPPLE, p),
        crotch=int(crotch[np.argmin(p[crotch, 1])]),
        acromion=int(over[np.argmax(p[over, 1])]),
        menton=int(chin[np.argmin(p[chin, 1])]),
        sellion=int(bridge[np.argmin(p[bridge, 2])]),
        fingertip=int(hand[np.argmax(tip @ mean)]),
        edges=edges,
    )


def measures(model: BodyModel, shape: Shape) -> dict[str, float]:
    """All of COLUMNS [m]."""
    mark, at = landmarks(model), shape.joints
    p = shape.points[: model.body]
    shoulder, elbow, wrist = at["left_upper_arm"], at["left_lower_arm"], at["left_hand"]
    knee, ankle = at["left_lower_leg"], at["left_foot"]
    arm, fore = _unit(elbow - shoulder), _unit(wrist - elbow)
    hand_axis = _unit(at["left_middle_proximal"] - wrist)
    up = np.array((0.0, 1.0, 0.0))
    crotch = p[mark.crotch]
    eye = shape.eyes[0]

    def level(y: float, edges: str = "torso") -> F64:
        return _section(p, mark.edges[edges], np.array((0.0, y, 0.0)), up)

    def across(edges: str, point: F64, normal: F64) -> F64:
        return _section(p, mark.edges[edges], point, normal)

    chest, waist = level(p[mark.nipple, 1]), level(p[mark.navel, 1])
    hip_levels = [level(float(crotch[1]) + above) for above in (0.04, 0.06, 0.08, 0.10, 0.12, 0.14)]
    buttock = max(hip_levels, key=lambda s: float(np.ptp(s[:, 2])))
    thigh = level(crotch[1] - 0.025, "leg")
    shank = knee - ankle
    calves = [across("leg", ankle + t * shank, _unit(shank)) for t in np.linspace(0.55, 0.85, 7)]
    ankles = [across("leg", ankle + t * shank, _unit(shank)) for t in np.linspace(0.10, 0.35, 6)]
    neck_axis = _unit(at["head"] - at["neck"])
    necks = [across("neck", at["neck"] + t * (at["head"] - at["neck"]), neck_axis) for t in np.linspace(0.3, 0.9, 6)]
    knuckle = 0.5 * (at["left_index_proximal"] + at["left_little_proximal"])
    palm = across("hand", knuckle - 0.006 * hand_axis, hand_axis)
    deltoid = _outward(p[mark.arm], shoulder, arm)
    head = p[np.setdiff1d(mark.head, mark.ear)]
    brow = head[(head[:, 1] > eye[1] + 0.012) & (head[:, 1] < eye[1] + 0.075)]
    cheek = head[(np.abs(head[:, 1] - eye[1] + 0.022) < 0.016) & (head[:, 2] > eye[2] - 0.055)]
    ear = p[mark.ear]
    foot = p[mark.foot]
    tip = p[mark.fingertip]
    hand = float((tip - wrist) @ hand_axis)
    upper, lower = float(np.linalg.norm(elbow - shoulder)), float(np.linalg.norm(wrist - elbow))
    behind = 0.5 * _girth(across("arm", elbow, _unit(arm + fore))) / np.pi
    return {
        "stature": float(np.ptp(p[:, 1])),
        "span": 2.0 * (float(shoulder[0]) + upper + lower + hand),
        "acromion height": float(p[mark.acromion, 1]),
        "waist height": float(p[mark.navel, 1]),
        "crotch height": float(crotch[1]),
        "knee height": float(knee[1]),
        "ankle height": float(ankle[1]),
        "biacromial breadth": 2.0 * (float(shoulder[0]) + _ACROMION),
        "shoulder breadth": 2.0 * (float(shoulder[0]) + deltoid),
        "chest depth": float(np.ptp(chest[:, 2])),
        "waist breadth": float(np.ptp(waist[:, 0])),
        "waist depth": float(np.ptp(waist[:, 2])),
        "hip breadth": float(np.ptp(buttock[:, 0])),
        "buttock depth": float(np.ptp(buttock[:, 2])),
        "head length": float(np.ptp(brow[:, 2])),
        "head breadth": float(np.ptp(brow[:, 0])),
        "head girth": _girth(_section(p, mark.edges["neck"], np.array((0.0, eye[1] + 0.032, 0.0)), up)),
        "face breadth": float(np.ptp(cheek[:, 0])),
        "face height": float(np.linalg.norm(p[mark.sellion] - p[mark.menton])),
        "eye distance": float(np.linalg.norm(shape.eyes[0] - shape.eyes[1])),
        "ear length": float(np.ptp(ear[:, 1])),
        "ear breadth": float(np.ptp(ear[:, 2])),
        "upper arm length": float(np.linalg.norm(p[mark.acromion] - elbow)) + behind,
        "forearm length": lower,
        "forearm-hand length": lower + hand + behind,
        "hand length": hand,
        "palm length": float((at["left_middle_proximal"] - wrist) @ hand_axis) + 0.06 * hand,
        "hand breadth": _breadth(palm, hand_axis, at["left_index_proximal"] - at["left_little_proximal"]),
        "hand girth": _girth(palm),
        "foot length": float(np.ptp(foot[:, 2])),
        "foot breadth": float(np.ptp(foot[foot[:, 1] < 0.06, 0])),
        "neck girth": min(_girth(s) for s in necks),
        "chest girth": _girth(chest),
        "waist girth": _girth(waist),
        "hip girth": _girth(buttock),
        "thigh girth": _girth(thigh),
        "upper arm girth": _FLEXED_ARM
        * max(_girth(across("arm", shoulder + t * (elbow - shoulder), arm)) for t in (0.45, 0.55, 0.65)),
        "forearm girth": _FLEXED_FOREARM * max(_girth(across("arm", elbow + t * (wrist - elbow), fore)) for t in (0.12, 0.2, 0.3)),
        "calf girth": max(_girth(s) for s in calves),
        "ankle girth": min(_girth(s) for s in ankles),
        "wrist girth": _girth(across("arm", wrist - 0.012 * fore, fore)),
    }


def _limb(joint: str) -> str:
    """Group of a joint's vertices."""
    side, _, rest = joint.partition("_")
    if side not in ("left", "right"):
        return "head" if joint in ("head", "jaw") else joint if " " in joint else "trunk"
    if rest == "shoulder":
        return "trunk"
    if rest.endswith("eye"):
        return "head"
    if "thumb" in rest:
        return f"{side} thumb"
    if rest == "hand" or joint in finger_joints(side):
        return f"{side} hand"
    return f"{side} {'arm' if 'arm' in rest else 'foot' if rest in ('foot', 'toes') else 'leg'}"


def _most(model: BodyModel, target: str, p: F64) -> int:
    """The left vertex that a target moves most."""
    k = model.targets.names.index(target)
    rows = slice(model.targets.start[k], model.targets.start[k + 1])
    vertex, offset = model.targets.vertex[rows], model.targets.offset[rows]
    left = (vertex < model.body) & (p[np.minimum(vertex, model.body - 1), 0] > -_MIDDLE)
    return int(vertex[left][np.argmax(np.linalg.norm(offset[left], axis=1))])


def _moved(model: BodyModel, target: str, p: F64) -> I32:
    """The left vertices of the skin that a target moves visibly."""
    k = model.targets.names.index(target)
    rows = slice(model.targets.start[k], model.targets.start[k + 1])
    vertex, offset = model.targets.vertex[rows], np.linalg.norm(model.targets.offset[rows], axis=1)
    vertex = vertex[(offset > 0.97 * offset.max()) & (vertex < model.body)]
    return vertex[p[vertex, 0] > 0.0]


def _edges(triangles: I32, rows: I32) -> I32:
    """(E, 2) edges of triangles with all corners among some rows."""
    inside = np.zeros(int(triangles.max()) + 1, np.bool_)
    inside[rows] = True
    tri = triangles[inside[triangles].all(axis=1)]
    ends = np.sort(np.concatenate([tri[:, [0, 1]], tri[:, [1, 2]], tri[:, [2, 0]]]), axis=1)
    return np.unique(ends, axis=0).astype(np.int32)


def _section(p: F64, edges: I32, point: F64, normal: F64) -> F64:
    """(N, 3) where edges cross a plane."""
    d = (p - point) @ normal
    a, b = d[edges[:, 0]], d[edges[:, 1]]
    cut = (a < 0.0) != (b < 0.0)
    t = (a[cut] / (a[cut] - b[cut]))[:, None]
    return p[edges[cut, 0]] + t * (p[edges[cut, 1]] - p[edges[cut, 0]])


def _girth(section: F64) -> float:
    """The shortest way round points of a plane [m]; 0 where there are none."""
    if len(section) < 4:
        return 0.0
    q = section - section.mean(axis=0)
    flat = q @ np.linalg.svd(q, full_matrices=False)[2][:2].T
    return float(ConvexHull(flat).area)


def _breadth(section: F64, normal: F64, along: F64) -> float:
    """Of a plane section across `normal`, the way nearest to `along` [m]."""
    axis = _unit(along - (along @ normal) * normal)
    return float(np.ptp(section @ axis)) if len(section) else 0.0


def _outward(arm: F64, shoulder: F64, axis: F64) -> float:
    """How far the upper third of an arm goes out from its bone, away from the body [m]."""
    q = arm - shoulder
    along = q @ axis
    out = _unit(np.cross((0.0, 0.0, 1.0), axis))
    return float((q @ (out if out[0] > 0.0 else -out))[(along > 0.02) & (along < 0.11)].max())


def _unit(v: F64) -> F64:
    return v / max(float(np.linalg.norm(v)), 1e-12)
