"""A guest with mouse and keys, and perhaps a camera or a headset, as a seated person: from where they point and look to what four
receivers and two gloves on them would measure, which the posture solver takes as it takes everybody's. No bus, no clock: times come
with the calls.

They breathe, blink and look about a little; hands go to things in an arc from above, and the trunk leans after them. What a camera
sees of them, or a headset measures, takes the place of that, but of a hand that the mouse leads and of gestures.
"""

import math
import zlib

import numpy as np

from vistel.arrays import F64
from vistel.capture.camera_body import CameraBody
from vistel.capture.followed import Followed
from vistel.capture.gestures import FIST, HandAim, gesturing
from vistel.capture.headset import Headset
from vistel.capture.spring import Spring
from vistel.figure.face.marks import REST
from vistel.figure.posture.channel import MatrixPose, blend
from vistel.figure.posture.hands import OPEN, RELAXED, hand_rotation
from vistel.figure.posture.limits import SIDES
from vistel.figure.posture.posture import Posture, Stance, spine_chord, spine_rotations
from vistel.figure.posture.sensors import Placement, receiver_mounts
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, SPINE_SEGMENTS
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_x, rotation_y, slerp
from vistel.space.people import Build
from vistel.space.room import CHAIR_HEIGHT, TABLE_HEIGHT
from vistel.v1.device_pb2 import CameraBodyFrame, HeadsetFrame, PointedHand, PointerFrame

AWAY_S = 2.0
"""Without a word of the page for so long (it is in the background), the guest rests [s]."""
HIPS_M = 0.097
"""From the seat's height to the hips of a person of REFERENCE_HEIGHT [m]."""
HIPS_BACK_M = -0.02
"""Of the hips from the seat's middle [m]."""
BREATHS_HZ = 0.24
"""Breaths a second of a person at rest."""
HEAD_RATE = 9.0
"""How quickly head and trunk follow: of a critically damped spring [rad/s]."""
HAND_RATE = np.array([7.5, 11.0, 7.5])
"""The same of a hand, sideways, up and ahead: it rises before it goes to a thing [rad/s]."""
MOST_LEAD_M = 0.5
"""A hand is led by a place no farther off: it goes at 1.6 m/s at most [m]."""
PRACTISED = 5.0
"""By how much more quickly a hand follows a gesture..."""
PRACTISED_M = 0.25
"""... when it is nearer than this to where the gesture has it [m]."""
FINGER_RATE = 14.0
"""How quickly fingers follow [rad/s]."""
ABOVE_M = 0.14
"""A hand comes to a thing from so high above it, and leaves so high above the table, to throw nothing over [m]..."""
BESIDE_M = 0.16
"""... while it is farther than this from where it goes [m]."""
NEAR_M = 0.03
"""A palm that is this near to where it is to touch closes [m]."""
COMFORTABLE = 0.86
"""Share of an arm's length from which the trunk leans after a hand..."""
LEAN = 2.8
"""... so much for each metre that is missing [rad/m]..."""
FAR_M = 0.2
"""... and once that is more than this [m]..."""
FAR_LEAN = 6.0
"""... so much more: the arm is nearly straight then [rad/m]."""
MOST_LEAN = np.array([1.3, 0.5, 0.4])
"""How far the trunk leans: forward, about its own axis, sideways [rad]."""
MOST_BEND = math.radians(50.0)
"""A hand turns from the way of its arm no further than this to take a thing [rad]."""
ELBOW_SPEED = math.radians(720.0)
"""How quickly an elbow that a camera sees turns about its arm; a quarter of it while that is not yet believed [rad/s]."""
HEAD_SHARE = 0.7
"""Of where somebody looks: the rest is the trunk's."""


class _Hand:
    """One hand: where it is, and how far it has closed."""

    def __init__(self, rest: HandAim) -> None:
        self.place, self.fingers = Spring(rest.palm), Spring(rest.fingers)
        self.rotation = quaternion_from_matrix(np.ascontiguousarray(rest.rotation))
        self.closing = False

    def beside(self, place: F64) -> float:
        """How far it is from a place, seen from above: 0 there .. 1 beside it."""
        aside = math.hypot(self.place.at[0] - place[0], self.place.at[2] - place[2])
        return min(1.0, max(0.0, aside - NEAR_M) / BESIDE_M)

    def follow(self, aim: HandAim, dt: float, practised: float) -> HandAim:
        """practised: share of a gesture, whose movements are small and quick once the hand is there."""
        lead = aim.palm - self.place.at
        far = float(np.linalg.norm(lead))
        quick = 1.0 + PRACTISED * practised * max(0.0, 1.0 - far / PRACTISED_M)
        palm = self.place.follow(self.place.at + lead * min(1.0, MOST_LEAD_M / max(far, 1e-9)), dt, quick * HAND_RATE)
        share = 1.0 - math.exp(-quick * HEAD_RATE * dt)
        self.rotation = slerp(self.rotation, quaternion_from_matrix(np.ascontiguousarray(aim.rotation)), share)
        return HandAim(palm, matrix_from_quaternion(self.rotation), self.fingers.follow(aim.fingers, dt, FINGER_RATE))


class PointerCapture:
    """From what one guest's page says to postures."""

    def __init__(self, name: str, build: Build, seat: Stance) -> None:
        """name: of the participant, from which blinks and sway follow; build: joints and palms of their figure."""
        skeleton = build.skeleton
        self._skeleton, self._build, self._seat = skeleton, build, seat
        self._solver = PostureSolver(skeleton, seat)
        self._mounts = receiver_mounts(skeleton)
        self._scale = skeleton.height / REFERENCE_HEIGHT
        rest, spine = skeleton.rest, JOINT_INDEX["spine_1"]
        self._base = np.array([0.0, CHAIR_HEIGHT + HIPS_M * self._scale, HIPS_BACK_M]) + skeleton.offsets[spine]
        top = rest[spine] + np.array([0.0, skeleton.spine, 0.0])
        self._from_top = {j: rest[JOINT_INDEX[j]] - top for j in ("left_shoulder", "neck", "left_upper_arm", "right_upper_arm")}
        self._head_bone = skeleton.offsets[JOINT_INDEX["head"]]
        self._phase = zlib.crc32(name.encode()) % 6283 * 1e-3
        self._arm = skeleton.upper_arm + skeleton.lower_arm
        upright = self._base + np.array([0.0, skeleton.spine, 0.0])
        self._shoulder = {s: upright + self._from_top[f"{s}_upper_arm"] for s in SIDES}
        self._hands = {s: _Hand(self._lap(s)) for s in SIDES}
        self._camera, self._headset = CameraBody(skeleton, self._base), Headset(build, self._base)
        self._look, self._trunk = Spring(np.array([0.0, -0.15])), Spring(np.zeros(3))
        self._frame = PointerFrame()
        self._frame_ns = self._begun_ns = self._t_ns = 0

    def take(self, frame: PointerFrame) -> None:
        """What the page says the guest does."""
        if frame.gesture_number != self._frame.gesture_number:
            self._begun_ns = frame.header.t_ns
        self._frame, self._frame_ns = frame, frame.header.t_ns

    def see(self, frame: CameraBodyFrame | HeadsetFrame) -> None:
        """What the page's camera sees of the guest, or their headset measures."""
        if isinstance(frame, HeadsetFrame):
            self._headset.take(frame)
        else:
            self._camera.take(frame)

    def solve(self, t_ns: int) -> Posture:
        """The posture at `t_ns`, later than the last one."""
        dt = min(0.1, (t_ns - self._t_ns) * 1e-9) if self._t_ns else 0.0
        self._t_ns = t_ns
        t_s = t_ns * 1e-9 % 86_400.0 + self._phase
        frame = self._frame if t_ns - self._frame_ns < AWAY_S * 1e9 else PointerFrame(head_pitch=-0.2)
        made = gesturing(self._frame.gesture, (t_ns - self._begun_ns) * 1e-9, _direction(frame.head_yaw, frame.head_pitch))
        wanted = np.array([frame.head_yaw, frame.head_pitch])
        yaw, pitch = self._look.follow(wanted, dt, HEAD_RATE) + made.head + _sway(t_s, 0.010)
        aims: dict[str, HandAim] = {}
        for s, led in (("left", frame.left), ("right", frame.right)):
            aim = made.hands.get(s)
            aim = self._lap(s) if aim is None else HandAim(aim.palm * self._scale, aim.rotation, aim.fingers)
            pointed = frame.HasField(s)
            aim = self._led(s, led) if pointed else aim if s in made.hands else self._leaving(s, aim)
            aims[s] = self._hands[s].follow(aim, dt, made.share if s in made.hands and not pointed else 0.0)
            if not pointed:
                self._hands[s].closing = False
        busy = frozenset(f"{s}_{part}" for s in SIDES if frame.HasField(s) or s in made.hands for part in ("hand", "fingers"))
        seen = self._camera.at(t_ns, dt, busy) | self._headset.at(t_ns, dt, busy)
        wrists = {s: aim.palm - aim.rotation @ self._palm(s) for s, aim in aims.items()}
        turn = np.array([0.0, (1.0 - HEAD_SHARE) * yaw, 0.0])
        trunk = self._trunk.follow(self._lean(wrists) + turn, dt, 0.6 * HEAD_RATE)
        placed = self._placed(trunk, yaw, pitch, wrists, aims, t_s)
        receivers = {n: self._measured(n, blend(p, seen[n].pose, seen[n].share) if n in seen else p) for n, p in placed.items()}
        fingers = tuple(_mixed(aims[s].fingers, seen.get(f"{s}_fingers")) for s in SIDES)
        elbows = {s: self._elbow(s, hand, dt) for s in SIDES if (hand := seen.get(f"{s}_hand")) is not None and len(hand.more)}
        posture = self._solver.solve(t_ns * 1e-9, receivers, (fingers[0], fingers[1]), elbows).posture
        gaze = np.clip(wanted - (yaw, pitch), -0.5, 0.5) + _glance(t_s)
        face = np.concatenate((REST.ravel(), gaze, np.full(2, _lids(t_s))))
        face = _mixed(face, seen.get("face"))
        marks = np.reshape(face[:-4], REST.shape) if "face" in seen else None
        return Posture(posture.dofs, posture.hands, posture.stance, face[-4:-2], posture.joints, marks, face[-2:])

    def _elbow(self, side: str, hand: Followed, dt: float) -> F64:
        """(3,) where an elbow points: as the camera sees it, but no quicker there than elbows turn."""
        now = self._solver.elbow(side) / max(1e-9, float(np.linalg.norm(self._solver.elbow(side))))
        aim = hand.more / max(1e-9, float(np.linalg.norm(hand.more)))
        off = math.acos(min(1.0, max(-1.0, float(now @ aim))))
        most = (ELBOW_SPEED if hand.share == 1.0 else 0.25 * ELBOW_SPEED) * dt
        if off <= most:
            return aim
        return (math.sin(off - most) * now + math.sin(most) * aim) / math.sin(off)

    def _palm(self, side: str) -> F64:
        return self._build.palm[0 if side == "left" else 1]

    def _lap(self, side: str) -> HandAim:
        """The hand at rest in the lap."""
        sign = SIDES[side]
        wrist = self._shoulder[side] + np.array([-sign * 0.10, -0.70, 0.44]) * self._arm
        rotation = rotation_y(-sign * math.radians(70.0))
        return HandAim(wrist + rotation @ self._palm(side), rotation, RELAXED)

    def _led(self, side: str, led: PointedHand) -> HandAim:
        """A hand that is led to a place: palm down over a table, forward where it is high up."""
        hand, sign = self._hands[side], SIDES[side]
        place = np.array([led.palm.x, led.palm.y, led.palm.z])
        from_shoulder = place - self._shoulder[side]
        way = math.atan2(-sign * from_shoulder[2], sign * from_shoulder[0])  # about +Y: fingers point away from the shoulder
        turn = way
        if led.HasField("turn"):
            off = (led.turn + 0.5 * math.pi - way + 0.5 * math.pi) % math.pi - 0.5 * math.pi  # either end of the thing ahead
            turn = way + min(MOST_BEND, max(-MOST_BEND, off))
        fingers = sign * (rotation_y(turn)[:, 0])
        raised = min(1.0, max(0.0, (from_shoulder[1] / self._scale + 0.12) / 0.30)) * math.radians(75.0)
        up = np.array([0.0, 1.0, 0.0])
        fingers, palm = math.cos(raised) * fingers + math.sin(raised) * up, math.sin(raised) * fingers - math.cos(raised) * up
        away = float(np.linalg.norm(hand.place.at - place))
        hand.closing = led.close and (hand.closing or away < NEAR_M)
        above = 0.0 if hand.closing else ABOVE_M * hand.beside(place)
        return HandAim(place + above * up, hand_rotation(sign, fingers, palm), FIST if hand.closing else OPEN)

    def _leaving(self, side: str, rest: HandAim) -> HandAim:
        """A hand on its way to rest: over the table as long as it is there."""
        at = self._hands[side].place.at
        above = max(0.0, min(float(at[1]), TABLE_HEIGHT + ABOVE_M) - float(rest.palm[1])) * self._hands[side].beside(rest.palm)
        return HandAim(rest.palm + np.array([0.0, above, 0.0]), rest.rotation, rest.fingers)

    def _lean(self, wrists: dict[str, F64]) -> F64:
        """Rotation vector (3,) of the trunk that brings the shoulders within reach of the hands."""
        lean = np.zeros(3)
        for s, sign in SIDES.items():
            d = wrists[s] - self._shoulder[s]
            far = float(np.linalg.norm(d))
            excess = max(0.0, far - COMFORTABLE * self._arm)
            ahead = d / max(far, 1e-6)
            forward = LEAN * excess + FAR_LEAN * max(0.0, excess - FAR_M)
            turned, aside = -sign * 1.8 * excess, -1.2 * excess
            lean += np.array([forward * max(0.0, ahead[2]), turned * max(0.0, ahead[2]), aside * ahead[0]])
        return MOST_LEAN * np.tanh(lean / MOST_LEAN)

    def _placed(
        self, trunk: F64, yaw: float, pitch: float, wrists: dict[str, F64], aims: dict[str, HandAim], t_s: float
    ) -> dict[str, MatrixPose]:
        """Where chest, head and hands are, in the seat's frame."""
        breath = math.sin(2.0 * math.pi * BREATHS_HZ * t_s)
        bent = trunk + np.array([0.012 + 0.006 * breath, 0.0, 0.0])
        bent[:2] += _sway(0.7 * t_s, 0.006)
        chest = np.ascontiguousarray(spine_rotations(bent)[SPINE_SEGMENTS])
        top = self._base + spine_chord(bent, self._skeleton.spine / SPINE_SEGMENTS)[SPINE_SEGMENTS]
        top = top + np.array([0.0, 0.0015 * breath, 0.0])
        head = rotation_y(yaw) @ rotation_x(-pitch)
        neck = matrix_from_quaternion(slerp(quaternion_from_matrix(chest), quaternion_from_matrix(head), 0.5))
        return {
            "chest": MatrixPose(top + chest @ self._from_top["left_shoulder"], chest),
            "head": MatrixPose(top + chest @ self._from_top["neck"] + neck @ self._head_bone, head),
            **{f"{s}_hand": MatrixPose(wrists[s], aim.rotation) for s, aim in aims.items()},
        }

    def _measured(self, name: str, pose: MatrixPose) -> Placement:
        """What the receiver there measures, in the room."""
        p_seat, rotation = pose
        mount, facing = self._mounts[name], rotation_y(self._seat.heading)
        at = self._seat.position + facing @ (p_seat + rotation @ mount.position)
        return at, quaternion_from_matrix(np.ascontiguousarray(facing @ rotation @ mount.rotation))


def _mixed(values: F64, seen: Followed | None) -> F64:
    """Values as the camera has them, as far as that is believed."""
    return values if seen is None else values + seen.share * (seen.more - values)


def _direction(yaw: float, pitch: float) -> F64:
    return np.array([math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)])


def _sway(t_s: float, much: float) -> F64:
    """(2,) of nobody who holds quite still [rad]: sines that do not repeat within minutes."""
    return much * np.array(
        [math.sin(0.43 * t_s) + 0.6 * math.sin(1.13 * t_s + 1.0), math.sin(0.37 * t_s + 2.0) + 0.5 * math.sin(0.97 * t_s)]
    )


def _glance(t_s: float) -> F64:
    """(2,) by which the eyes are off what they look at [rad]; they jump, and rest between jumps."""
    n = math.floor(t_s / 1.4 + 0.3 * math.sin(t_s * 0.31))
    return 0.03 * np.array([math.sin(12.9898 * n), 0.6 * math.sin(78.233 * n)])


def _lids(t_s: float) -> float:
    """Opening of both eyes: a blink every three to six seconds."""
    n = math.floor(t_s / 4.2)
    since = t_s - 4.2 * n - 1.3 - 1.2 * math.sin(12.9898 * n)
    return 1.0 - math.sin(math.pi * since / 0.17) if 0.0 <= since < 0.17 else 1.0
