"""Three made-up people at one table, on one clock: they talk, one takes the baton and hands it to a neighbour, who hands it back,
and two shake hands. What their trackers, webcam and headset would measure is taken from their postures."""

import math
from dataclasses import replace

import numpy as np

from docs.pictures.people.talking_performer import FRAME_S, heard
from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.figure.posture.hands import FLAT, OPEN, RELAXED, finger_posture, hand_rotation
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.figure.posture.sensors import Placement
from vistel.geometry.rotation import rotation_y
from vistel.protocol.pages.camera_body import FACE
from vistel.space.room import BATON, BATON_RADIUS, TABLE_HEIGHT
from vistel_sim.limbs import own_limbs
from vistel_sim.motion.layout import built_in
from vistel_sim.motion.script import UP, Hand, level
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.source import SimulatedPerson, receivers_of, simulated_people
from vistel_sim.motion.tracks import Attention, HandKey, HandState, HandTrack
from vistel_sim.pages.camera_body import face_at_rest
from vistel_sim.sentences import RATE, synthesised_sentence

TRACKED, WORN, SEEN = "aiko", "ben", "carla"
"""Who wears trackers and gloves, who a headset, and who sits before a webcam."""
CALIBRATES_S = 14.0
"""Before the beginning, the one before the webcam does what the page asks for: sits, raises both hands, rests [s]."""
SECONDS = 28.0
VOICES = {TRACKED: "espeak-ng:en-us+f3", WORN: "espeak-ng:en-us", SEEN: "espeak-ng:en-gb+f2"}
SENTENCES = (
    (0.6, TRACKED, "Good morning. I wear trackers and gloves."),
    (4.0, WORN, "I have a headset on."),
    (6.0, SEEN, "And I sit in front of a webcam."),
    (9.0, TRACKED, "Ben, take this for a moment."),
    (13.4, WORN, "It is light. Here you are."),
    (21.6, SEEN, "Pleased to meet you."),
    (23.7, TRACKED, "So am I."),
)
"""When each begins [s], who says it, and what."""
HELD = {TRACKED: -0.032, WORN: 0.046}
"""How far above the baton's middle each holds it [m]."""
CLASPED = finger_posture((10, 35, 15, 15), (28, 30, 15))
"""The fingers of a hand that shakes another."""
SEES_M = (0.010, 0.045, 0.040)
"""In the seat's frame: one camera measures distances badly. So who sits before it sees on the page that their figure's hand is
lower and nearer to them than where they want it, and reaches so much farther [m]."""
_BLINKS_S, _BLINK_S = (2.3, 5.4, 8.9, 12.2, 14.8, 18.1, 21.3, 24.6), 0.16
_LIDS_M = 0.009
_JAW_M = 0.016


class Table:
    """What everybody does and says. sound: (n,) of each voice from the beginning on, at RATE."""

    def __init__(self, conference: Conference) -> None:
        self.people = simulated_people(conference, own_limbs(conference))
        self._sitters = {name: Sitter(self.people[name]) for name in (TRACKED, WORN, SEEN)}
        layout = built_in(conference.room.seats)
        hands = {(name, side): Hand(s, side, layout) for name, s in self._sitters.items() for side in ("left", "right")}
        baton = layout.baton_for(self.people[TRACKED].seat_position)
        assert baton is not None
        near = self._sitters[WORN].out_of_seat(np.array((0.10, TABLE_HEIGHT + 0.062, 0.36)))
        hands[WORN, "left"].rest_at(near)  # beside the neighbour's hand, not in it
        _calibrate(hands[SEEN, "left"], hands[SEEN, "right"])
        _hand_round(hands[TRACKED, "right"], hands[WORN, "left"], baton.position)
        _shake(hands[TRACKED, "right"], hands[SEEN, "right"])
        self._tracks = {key: HandTrack(hand.keys) for key, hand in hands.items()}
        self._points = {BATON: baton.position} | {name: _head(p) for name, p in self.people.items()}
        # Who sits before a webcam looks at it while they are measured.
        self._points["webcam"] = self._sitters[SEEN].out_of_seat(np.array((0.0, 1.2, 1.1)))
        self._attention = {name: Attention(glances, 0.5) for name, glances in _LOOKS.items()}
        self.sound = {name: np.zeros(round(SECONDS * RATE), np.float32) for name in VOICES}
        for start_s, who, text in SENTENCES:
            spoken, start = synthesised_sentence(text, VOICES[who]), round(start_s * RATE)
            self.sound[who][start : start + len(spoken)] += spoken[: len(self.sound[who]) - start]
        self._loud = {name: heard(sound)[0] for name, sound in self.sound.items()}

    def loud(self, name: str, t: float) -> float:
        """How loud somebody's voice is, 0 to 1."""
        return float(np.interp(t / FRAME_S, np.arange(len(self._loud[name])), self._loud[name], 0.0, 0.0))

    def posture(self, name: str, t: float) -> Posture:
        """In the room, `t` seconds after the beginning, or before it."""
        sitter, phase = self._sitters[name], 2.1 * (TRACKED, WORN, SEEN).index(name)
        talk = min(1.0, 1.6 * float(np.mean([self.loud(name, t + x) for x in (-0.4, -0.2, 0.0, 0.2, 0.4)])))
        left, right = (_talking(sitter, s, self._tracks[name, s].at(t), talk, t + phase) for s in ("left", "right"))
        look = np.sum([share * self._points[what] for what, share in self._attention[name].at(t)], axis=0)
        nod = 0.05 * talk * math.sin(5.3 * t + phase)
        look = look + sitter.direction_in_room(np.array((0.02 * math.sin(0.9 * t + phase), nod, 0.0)))
        sway = np.array((0.02 + 0.008 * math.sin(1.5 * t + phase), 0.03 * math.sin(0.5 * t + phase), 0.01 * math.sin(0.8 * t)))
        return sitter.posture(left, right, look, sway, np.array((0.02 * math.sin(3.1 * t + phase), 0.0)))

    def in_seat(self, name: str, t: float) -> JointPose:
        """Their joints in their seat's frame."""
        person = self.people[name]
        joints, facing = pose_joints(person.skeleton, self.posture(name, t)), rotation_y(person.seat_heading)
        return JointPose(facing.T @ joints.rotation, (joints.position - person.seat_position) @ facing)

    def face(self, t: float) -> F64:
        """(22, 3) points of the face before the webcam, in the head's frame [m]: they talk and blink."""
        points, jaw = face_at_rest(), _JAW_M * self.loud(SEEN, t)
        lid = max((math.sin(math.pi * (t - b) / _BLINK_S) for b in _BLINKS_S if b < t < b + _BLINK_S), default=0.0)
        for name, down in (
            ("lower_lip", jaw),
            ("chin", jaw),
            ("left_upper_lid", _LIDS_M * lid),
            ("right_upper_lid", _LIDS_M * lid),
        ):
            points[FACE.index(name), 1] -= down
        return points


class Tracked:
    """What the simulated devices of the one with trackers and gloves are moved by. begun_s: the device's time of the beginning."""

    def __init__(self, table: Table) -> None:
        self._table, self.begun_s = table, math.inf

    def posture(self, participant: str, t_s: float) -> Posture:
        """See `MotionSource`, as below."""
        return self._table.posture(participant, max(-CALIBRATES_S, t_s - self.begun_s))

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        return receivers_of(self._table.people[participant], self.posture(participant, t_s))

    def hand_angles(self, participant: str, t_s: float) -> F64:
        return self.posture(participant, t_s).hands

    def speaking(self, participant: str, t_s: float) -> float:
        return self._table.loud(participant, t_s - self.begun_s)

    def things(self, t_s: float) -> dict[str, Placement]:
        return {}


_LOOKS = {
    TRACKED: [
        *((-60.0, WORN), (2.4, SEEN), (4.2, WORN), (6.2, SEEN), (9.0, WORN), (9.7, BATON), (11.6, WORN)),
        *((18.6, BATON), (20.5, SEEN)),
    ],
    WORN: [
        *((-60.0, TRACKED), (5.2, SEEN), (8.8, TRACKED), (10.2, BATON), (11.6, TRACKED), (18.8, BATON), (20.8, SEEN)),
        (23.9, TRACKED),
    ],
    SEEN: [(-60.0, "webcam"), (-3.0, TRACKED), (4.3, WORN), (6.2, TRACKED), (9.8, BATON), (11.8, WORN), (17.8, TRACKED)],
}


def _head(person: SimulatedPerson) -> F64:
    return person.seat_position + rotation_y(person.seat_heading) @ np.array((0.0, 0.68 * person.skeleton.height, 0.05))


def _talking(sitter: Sitter, side: str, hand: HandState, talk: float, t: float) -> HandState:
    """A hand that goes with the speech, as far as it is free."""
    sign, share = (1.0 if side == "left" else -1.0), hand.free * talk
    beat = share * np.array((sign * 0.03, 0.08 + 0.03 * math.sin(4.3 * t + sign), 0.03 * math.sin(2.9 * t)))
    return replace(
        hand, position=hand.position + sitter.direction_in_room(beat), fingers=hand.fingers + 0.6 * share * (OPEN - RELAXED)
    )


def _between(a: Hand, b: Hand, towards_centre: float, height: float) -> F64:
    """(3,) between two seats, moved towards the table's middle by a share, so high above the table [m]."""
    middle = 0.5 * (a.sitter.person.seat_position + b.sitter.person.seat_position) * (1.0 - towards_centre)
    return middle + (TABLE_HEIGHT + height) * UP


def _calibrate(left: Hand, right: Hand) -> None:
    """As the page asks for: sit upright, then raise both hands beside the head, and take them down before the beginning."""
    for hand in (left, right):
        place = hand.sitter.out_of_seat(np.array((hand.sign * 0.34, 1.16, 0.22)))
        raised = hand_rotation(hand.sign, UP, hand.sitter.direction_in_room(np.array((0.0, 0.0, 1.0))))
        hand.keys.insert(0, replace(hand.keys[0], t=-9.0, free=0.0))
        hand.hold(-7.5, place, raised, FLAT)
        hand.hold(-4.5, place, raised, FLAT)
        hand.keys.append(HandKey(-2.5, *hand.home, RELAXED, 0.0, 1.0))


def _hand_round(giver: Hand, taker: Hand, baton: F64) -> None:
    """The giver takes the baton, and gives it to the taker, who looks at it, gives it back, and it is put down."""
    closed, fist = giver.closed(BATON_RADIUS), taker.closed(BATON_RADIUS)
    down = hand_rotation(-1.0, giver.sitter.direction_in_room(np.array((0.0, 0.0, 1.0))), -UP)
    pick = giver.wrist_for(baton + HELD[TRACKED] * down[:, 2], down)
    above = pick + 0.085 * UP
    meet = _between(giver, taker, 0.40, 0.24)
    fa, fb = level(meet - giver.shoulder()), level(meet - taker.shoulder())
    give, take = hand_rotation(-1.0, fa, np.cross(UP, fa)), hand_rotation(1.0, fb, -np.cross(UP, fb))
    gives, takes = giver.wrist_for(meet + HELD[TRACKED] * UP, give), taker.wrist_for(meet + HELD[WORN] * UP, take)
    off_a, off_b = -0.07 * np.cross(UP, fa) - 0.03 * fa, 0.07 * np.cross(UP, fb) - 0.03 * fb
    seen = hand_rotation(1.0, *(taker.sitter.direction_in_room(np.array(d)) for d in ((-0.25, 0.1, 0.95), (-1.0, 0.15, 0.0))))
    look = taker.wrist_for(taker.sitter.out_of_seat(np.array((0.06, TABLE_HEIGHT + 0.28, 0.38))), seen)

    # Whoever lets go, and whoever takes a thing away, waits until the other is seen to hold it, or to have
    # let go, half a second and more after they have.
    giver.leave(8.2)
    giver.hold(9.5, above, down, OPEN, 0.06)
    giver.hold(10, pick, down, OPEN)
    giver.hold(10.4, pick, down, closed)
    giver.hold(10.6, pick, down, closed)
    giver.hold(11.1, pick + 0.07 * UP, down, closed)
    giver.hold(12, gives, give, closed, 0.02)
    giver.hold(13.1, gives, give, closed)
    giver.hold(13.45, gives, give, OPEN)
    giver.hold(13.9, gives + off_a, give, OPEN)
    giver.hold(15.2, gives + off_a, give, OPEN)
    giver.hold(16.6, gives, give, OPEN)
    giver.hold(17, gives, give, closed)
    giver.hold(18.5, gives, give, closed)
    giver.hold(19.5, pick + 0.06 * UP, down, closed, 0.03)
    giver.hold(19.9, pick, down, closed)
    giver.hold(20, pick, down, closed)
    giver.hold(20.35, pick, down, OPEN)
    giver.hold(20.7, above, down, OPEN)

    taker.leave(10.6)
    taker.hold(11.9, takes + off_b, take, OPEN, 0.03)
    taker.hold(12.2, takes, take, OPEN)
    taker.hold(12.6, takes, take, fist)
    taker.hold(13.4, takes, take, fist)
    taker.hold(14.1, look, seen, fist)
    taker.hold(14.4, look + 0.01 * UP, seen, fist)
    taker.hold(15.3, takes, take, fist)
    taker.hold(17.1, takes, take, fist)
    taker.hold(17.45, takes, take, OPEN)
    taker.hold(17.9, takes + off_b, take, OPEN)
    taker.rest(18.9)


def _shake(one: Hand, other: Hand) -> None:
    """Two right hands meet between their people, go up and down, and part."""
    spot = _between(one, other, 0.42, 0.27)
    along = level(other.shoulder() - one.shoulder())
    for hand, ahead in ((one, along), (other, -along)):
        palm = np.cross(UP, ahead)
        rotation = hand_rotation(-1.0, ahead, palm)
        middle = hand.grip + np.array((0.0, BATON_RADIUS, 0.0))
        wrist = spot - rotation @ middle - 0.003 * palm
        if hand is other:
            wrist = wrist + hand.sitter.direction_in_room(np.array(SEES_M))
        apart = wrist - 0.05 * palm - 0.07 * ahead
        if hand is other:
            hand.leave(20.9)
        hand.hold(22.1, apart, rotation, FLAT, 0.03)
        hand.hold(22.6, wrist, rotation, FLAT)
        hand.hold(22.9, wrist, rotation, CLASPED)
        for n in range(6):
            hand.hold(23.15 + 0.22 * n, wrist + (0.022 if n % 2 else -0.022) * UP, rotation, CLASPED)
        hand.hold(24.6, wrist, rotation, CLASPED)
        hand.hold(24.9, wrist, rotation, FLAT)
        hand.hold(25.4, apart, rotation, FLAT)
        hand.rest(26.6)
