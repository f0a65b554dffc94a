"""From the moves to a person's bones, the receivers' mounts and the transmitter's frame.

Everything is found by linear least squares about points that stay while something turns (`pivots`): the shoulder while
the straight arm swings, the elbow while the forearm does, the wrist while the hand does; the neck from two joints, the
spine from its own curve. Bones that the moves do not show stay at the average of that height.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.calibration.moves import MoveError, Moves, ReceiverTrack, mean_rotation
from vistel.figure.calibration.pivots import PivotFit, fit_pivot, halfway, solve_blocks
from vistel.figure.posture.posture import collar_scale, spine_chord
from vistel.figure.posture.sensors import RECEIVERS, TRACKER_AXES, Mount, receiver_mounts
from vistel.figure.skeleton import JOINT_INDEX, SPINE_SEGMENTS, Skeleton, measured_skeleton, standard_skeleton
from vistel.geometry.rotation import rotvec_from_matrix

Tracks = Mapping[str, ReceiverTrack]

SIDES = {"left": 1.0, "right": -1.0}
SHORTENINGS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25)
ASKEW = math.radians(75.0)
"""A receiver turned farther than this from how it should sit is on the wrong joint, or upside down."""
GOOD_MM = 6.0
"""Residual up to which a move is good [mm]."""
FAIR_MM = 12.0
"""Residual up to which a move is fair [mm]."""


@dataclass(frozen=True)
class Calibrated:
    """skeleton; mounts by receiver; transmitter: position (3,) [m] and heading [rad] in the seat's frame (see
    `sensors.transmitter_in_room`); residuals of the moves [m] by name."""

    skeleton: Skeleton
    mounts: dict[str, Mount]
    position: F64
    heading: float
    residuals: dict[str, float]

    def verdicts(self) -> dict[str, str]:
        """good, fair or poor, by move."""
        return {
            name: "good" if 1e3 * r <= GOOD_MM else "fair" if 1e3 * r <= FAIR_MM else "poor" for name, r in self.residuals.items()
        }


def calibrate(moves: Moves, height_m: float, body: Skeleton | None = None) -> Calibrated:
    """Bones (unless `body` has them), mounts and transmitter of a person of `height_m`. Raises MoveError."""
    expected = body or standard_skeleton(height_m)
    axes = _body_axes(moves["t_pose"])
    turn = _mount_rotations(moves["t_pose"], axes)
    mounts = receiver_mounts(expected)
    residuals: dict[str, float] = {}

    wrist = {s: _pivot(moves["wrists"], f"{s}_hand", turn, np.zeros(3), mounts[f"{s}_hand"].position) for s in SIDES}
    hand = {s: wrist[s].vectors[1] for s in SIDES}
    residuals["wrists"] = _rms(wrist)
    bent: dict[str, PivotFit] = {}
    swung: dict[str, PivotFit] = {}
    shortening = expected.collar_shortening
    length = {
        s: (expected.length(f"{s}_upper_arm", f"{s}_lower_arm"), expected.length(f"{s}_lower_arm", f"{s}_hand")) for s in SIDES
    }
    for s, sign in SIDES.items():
        along = np.array([sign, 0.0, 0.0])
        bent[s] = _pivot(moves["elbows"], f"{s}_hand", turn, np.zeros(3), hand[s] + along * length[s][1])
        swung[s] = _pivot(moves["arms"], f"{s}_hand", turn, np.zeros(3), hand[s] + along * sum(length[s]))
    residuals["elbows"] = _rms(bent)
    if body is None:
        swung, shortening = _with_collars(moves["arms"], turn, swung, expected)
        for s in SIDES:
            lower = float(np.linalg.norm(bent[s].vectors[1] - hand[s]))
            apart = float(np.linalg.norm(swung[s].vectors[0] - bent[s].vectors[0]))
            upper = 0.5 * (apart + float(np.linalg.norm(swung[s].vectors[1] - bent[s].vectors[1])))
            length[s] = (_plausible(upper, length[s][0], s, "upper arm"), _plausible(lower, length[s][1], s, "forearm"))
    residuals["arms"] = _rms(swung)

    rest = expected.rest
    standard_middle = 0.5 * (rest[JOINT_INDEX["left_upper_arm"]] + rest[JOINT_INDEX["right_upper_arm"]])
    shoulder = {s: swung[s].vectors[0] for s in SIDES}
    middle = 0.5 * (shoulder["left"] + shoulder["right"])
    # From the receiver on the chest; collars keep their average places about the middle of the shoulders.
    collar = {s: middle + rest[JOINT_INDEX[f"{s}_shoulder"]] - standard_middle for s in SIDES}
    chest = -collar["left"]
    neck = _neck(moves["head"], turn, expected, collar, mounts["head"].position)
    residuals["head"] = neck.residual
    spine = _spine(moves["spine"], turn, axes, expected, chest)
    residuals["spine"] = spine.residual

    skeleton = expected
    if body is None:
        skeleton = _skeleton(expected, spine.vectors[1][0], shoulder, collar, neck.vectors, length, shortening)
    mounts = {
        name: Mount(mounts[name].joint, p, turn[name])
        for name, p in (("chest", chest), ("head", neck.vectors[2]), ("left_hand", hand["left"]), ("right_hand", hand["right"]))
    }
    position, heading = _transmitter(moves["t_pose"], axes, skeleton, mounts["chest"].position)
    return Calibrated(skeleton, mounts, position, heading, residuals)


def _body_axes(tracks: Tracks) -> F64:
    """(3, 3) columns: left, up and ahead of who stands in a T-pose, in the transmitter's frame, whose Z is down."""
    across = tracks["left_hand"].position.mean(axis=0) - tracks["right_hand"].position.mean(axis=0)
    across[2] = 0.0
    span = float(np.linalg.norm(across))
    if span < 0.8:
        raise MoveError(f"t_pose: the hands are only {span:.2f} m apart; stretch both arms out to the sides and repeat")
    left, up = across / span, np.array([0.0, 0.0, -1.0])
    return np.column_stack((left, up, np.cross(left, up)))


def _mount_rotations(tracks: Tracks, axes: F64) -> dict[str, F64]:
    """Receiver to joint, from the T-pose in which all joints' frames are the body's own."""
    out = {name: np.ascontiguousarray(axes.T @ mean_rotation(tracks[name].rotation)) for name in RECEIVERS}
    off = {name: float(np.linalg.norm(rotvec_from_matrix(np.ascontiguousarray(m @ TRACKER_AXES.T)))) for name, m in out.items()}
    askew = [name for name in RECEIVERS if off[name] > ASKEW]
    if len(askew) == len(RECEIVERS):
        raise MoveError(
            "t_pose: every receiver points backwards: the stations of left and right hand are exchanged, or you faced away"
        )
    if askew:
        raise MoveError(
            f"t_pose: the receiver {askew[0].replace('_', ' ')} is turned by {math.degrees(off[askew[0]]):.0f}° from how it "
            "should sit; is it on another joint, or upside down? Its cable leads backwards, its label faces up"
        )
    return out


def _seen_from_chest(tracks: Tracks, name: str, turn: dict[str, F64]) -> tuple[F64, F64]:
    """(n, 3, 3) rotation of a joint and (n, 3) position of its receiver, chest's axes, from the chest's receiver."""
    chest = tracks["chest"].rotation @ turn["chest"].T
    joint = tracks[name].rotation @ turn[name].T
    away = tracks[name].position - tracks["chest"].position
    return np.einsum("nji,njk->nik", chest, joint), np.einsum("nji,nj->ni", chest, away)


def _pivot(tracks: Tracks, name: str, turn: dict[str, F64], centre: F64, arm: F64) -> PivotFit:
    rotation, p = _seen_from_chest(tracks, name, turn)
    if not centre.any():
        centre = (p - np.einsum("nij,j->ni", rotation, arm)).mean(axis=0)
    return fit_pivot(rotation, p, centre, arm)


def _with_collars(
    tracks: Tracks, turn: dict[str, F64], first: dict[str, PivotFit], expected: Skeleton
) -> tuple[dict[str, PivotFit], float]:
    """The shoulders in the T-pose, and how much collar bones lose with raised arms: what leaves the least residual."""
    best, best_cost, chosen = first, math.inf, 0.0
    for share in SHORTENINGS:
        fits: dict[str, PivotFit] = {}
        for s, sign in SIDES.items():
            rotation, p = _seen_from_chest(tracks, f"{s}_hand", turn)
            bone = expected.offsets[JOINT_INDEX[f"{s}_upper_arm"]]
            scale = np.array([collar_scale(np.ascontiguousarray(m), sign, share) for m in rotation])
            fits[s] = fit_pivot(rotation, p - (scale - 1.0)[:, None] * bone, first[s].vectors[0], first[s].vectors[1])
        cost = _rms(fits)
        if cost < best_cost - 1e-5:
            best, best_cost, chosen = fits, cost, share
    return best, chosen


def _neck(tracks: Tracks, turn: dict[str, F64], expected: Skeleton, collar: dict[str, F64], mount: F64) -> PivotFit:
    """Neck joint from the chest's receiver, bone to the head's joint, receiver from there."""
    rotation, p = _seen_from_chest(tracks, "head", turn)
    rest = expected.rest
    neck = collar["left"] + rest[JOINT_INDEX["neck"]] - rest[JOINT_INDEX["left_shoulder"]]
    still = np.broadcast_to(np.eye(3), rotation.shape)
    return solve_blocks(
        [still, halfway(rotation), rotation], p, [neck, expected.offsets[JOINT_INDEX["head"]], mount], [0.03, 0.03, 0.05]
    )


def _spine(tracks: Tracks, turn: dict[str, F64], axes: F64, expected: Skeleton, chest: F64) -> PivotFit:
    """The spine's foot, its length (first number of the second vector) and the chest's receiver from its top."""
    rotation = np.einsum("ji,njk->nik", axes, tracks["chest"].rotation @ turn["chest"].T)
    p = tracks["chest"].position @ axes
    chord = np.array([spine_chord(rotvec_from_matrix(np.ascontiguousarray(m)), 1.0 / SPINE_SEGMENTS)[8] for m in rotation])
    by_length = np.zeros_like(rotation)
    by_length[:, :, 0] = chord
    rest = expected.rest
    top = rest[JOINT_INDEX["spine_1"]] + np.array([0.0, expected.spine, 0.0])
    from_top = rest[JOINT_INDEX["left_shoulder"]] - top + chest
    length = np.array([expected.spine, 0.0, 0.0])
    foot = (p - chord * expected.spine - np.einsum("nij,j->ni", rotation, from_top)).mean(axis=0)
    still = np.broadcast_to(np.eye(3), rotation.shape)
    return solve_blocks([still, by_length, rotation], p, [foot, length, from_top], [0.3, 0.06, 0.02])


def _skeleton(
    expected: Skeleton,
    spine: float,
    shoulder: dict[str, F64],
    collar: dict[str, F64],
    neck: list[F64],
    length: dict[str, tuple[float, float]],
    shortening: float,
) -> Skeleton:
    """The measured bones on an average person; the legs are shorter by as much as the spine is longer."""
    rest, offsets = expected.rest, expected.offsets
    more = spine - expected.spine
    found: dict[str, F64] = {"hips": rest[0] - (0.0, more, 0.0)}
    for k in range(2, SPINE_SEGMENTS + 1):
        found[f"spine_{k}"] = np.array([0.0, spine / SPINE_SEGMENTS, 0.0])
    top = rest[JOINT_INDEX["spine_1"]] + np.array([0.0, expected.spine, 0.0])
    # spine_8 is where the last segment begins.
    last = np.array([0.0, spine / SPINE_SEGMENTS, 0.0])
    left = rest[JOINT_INDEX["left_shoulder"]] - top + last
    found["neck"] = left + neck[0] - collar["left"]
    found["head"] = neck[1]
    for s, sign in SIDES.items():
        found[f"{s}_shoulder"] = left + collar[s] - collar["left"]
        found[f"{s}_upper_arm"] = shoulder[s] - collar[s]
        found[f"{s}_lower_arm"] = np.array([sign * length[s][0], 0.0, 0.0])
        found[f"{s}_hand"] = np.array([sign * length[s][1], 0.0, 0.0])
        legs = -(offsets[JOINT_INDEX[f"{s}_lower_leg"]][1] + offsets[JOINT_INDEX[f"{s}_foot"]][1])
        for part in ("lower_leg", "foot"):
            found[f"{s}_{part}"] = offsets[JOINT_INDEX[f"{s}_{part}"]] * ((legs - more) / legs)
    return measured_skeleton(expected, found, shortening)


def _transmitter(tracks: Tracks, axes: F64, skeleton: Skeleton, chest: F64) -> tuple[F64, float]:
    """Position and heading of the transmitter in the frame of the seat on which the person stood."""
    # In the T-pose the chest's receiver is where its mount says, over the seat.
    here = skeleton.rest[JOINT_INDEX["left_shoulder"]] + chest
    position = here - axes.T @ tracks["chest"].position.mean(axis=0)
    forward = axes.T @ np.array([1.0, 0.0, 0.0])
    return position, math.atan2(forward[0], forward[2])


def _plausible(found: float, expected: float, side: str, bone: str) -> float:
    if not 0.7 * expected < found < 1.4 * expected:
        raise MoveError(
            f"elbows: the {side} {bone} would be {1e2 * found:.0f} cm long, {1e2 * expected:.0f} cm are usual; "
            "repeat arms (straight), elbows (upper arms still) and wrists (forearms still) in this order"
        )
    return found


def _rms(fits: dict[str, PivotFit]) -> float:
    return math.sqrt(sum(f.residual**2 for f in fits.values()) / len(fits))
