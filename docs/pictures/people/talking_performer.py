"""Somebody made up who sits at a table and explains something: body, hands, face and voice on one clock.

Gestures are keys joined by minimum-jerk moves; the mouth follows the sound of the voice; brows, squint and smile go with the
sentences, as people's do.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vistel.arrays import F32, F64
from vistel.figure.posture.hands import FLAT, OPEN, POINT, RELAXED, hand_rotation
from vistel.figure.posture.posture import Posture
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.protocol.live_link_face import CHANNELS
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.source import SimulatedPerson
from vistel_sim.motion.tracks import HandKey, HandState, HandTrack, bump
from vistel_sim.sentences import RATE, synthesised_sentence

SECONDS = 20.0
SENTENCES = (
    (1.0, "When I bend my arm, the sleeve creases, and it is pulled up."),
    (5.9, "Now look at my forehead."),
    (8.7, "Those folds stay at the elbow, while the cloth slides through them."),
    (13.9, "And when I smile, you see it in the corners of my eyes."),
)
"""When each begins [s]."""
_BLINKS = (0.7, 3.6, 5.6, 8.2, 11.3, 13.4, 18.6)
_BLINK_S = 0.16
_PEAK = 0.7
"""Of the sound: a microphone turned up as far as it goes without clipping has some left."""
FRAME_S = 0.02
"""Of what is heard of a voice."""

Vector = tuple[float, float, float]
# When, where [m, left side of the seat's frame; mirrored on the right], where fingers and palm point, how fingers are.
Key = tuple[float, Vector, Vector, Vector, F64]
_REST: tuple[Vector, Vector, Vector, F64] = ((0.19, 0.80, 0.36), (-0.45, -0.05, 0.9), (0.0, -1.0, 0.0), RELAXED)
_OPEN: tuple[Vector, Vector, Vector, F64] = ((0.25, 0.98, 0.40), (-0.2, 0.35, 0.9), (-0.55, 0.8, 0.2), OPEN)
_LEFT: tuple[Key, ...] = (
    (0.0, *_REST),
    (1.0, *_REST),
    (2.2, (0.33, 1.15, 0.25), (-0.25, 0.9, 0.2), (-0.8, 0.0, -0.55), RELAXED),  # bends the arm
    (4.0, (0.34, 1.17, 0.24), (-0.25, 0.9, 0.15), (-0.8, 0.0, -0.55), RELAXED),
    (5.2, *_OPEN),
    (6.0, *_REST),
    (8.6, *_REST),
    (9.6, (0.33, 1.10, 0.27), (-0.35, 0.75, 0.4), (-0.7, 0.1, -0.6), RELAXED),  # bends it again ...
    (10.6, (0.26, 0.93, 0.42), (-0.3, 0.3, 0.9), (-0.6, 0.7, 0.2), OPEN),  # ... stretches it ...
    (11.6, (0.33, 1.13, 0.25), (-0.3, 0.8, 0.3), (-0.75, 0.05, -0.6), RELAXED),  # ... and once more
    (13.2, *_OPEN),
    (14.4, *_REST),
    (SECONDS, *_REST),
)
_RIGHT: tuple[Key, ...] = (
    (0.0, *_REST),
    (1.9, *_REST),
    (3.0, (0.02, 1.02, 0.36), (-0.75, 0.25, 0.55), (-0.3, -0.9, 0.2), POINT),  # shows the other elbow
    (4.2, (0.00, 1.03, 0.36), (-0.75, 0.2, 0.55), (-0.3, -0.9, 0.2), POINT),
    (5.2, *_REST),
    (6.0, *_REST),
    (7.0, (0.25, 1.07, 0.26), (-0.45, 0.85, -0.2), (-0.5, -0.1, -0.85), POINT),  # shows the forehead
    (8.0, (0.25, 1.08, 0.26), (-0.45, 0.85, -0.2), (-0.5, -0.1, -0.85), POINT),
    (9.2, *_REST),
    (10.0, *_REST),
    (11.0, *_OPEN),
    (12.6, (0.29, 1.00, 0.38), (-0.05, 0.35, 0.9), (-0.5, 0.85, 0.1), OPEN),
    (13.6, *_REST),
    (14.6, *_REST),
    (15.7, *_OPEN),
    (17.4, (0.30, 1.01, 0.36), (0.0, 0.4, 0.9), (-0.45, 0.85, 0.1), FLAT),
    (18.8, *_REST),
    (SECONDS, *_REST),
)


class Performer:
    """What they do `t` seconds after they began. sound: (n,) of their voice at RATE."""

    def __init__(self, person: SimulatedPerson, look: Sequence[float]) -> None:
        """look: (3,) where they look, room frame."""
        self._sitter = Sitter(person)
        self._look = np.array(look, np.float64)
        self._hands = [HandTrack([_hand(self._sitter, side, k) for k in keys]) for side, keys in ((1.0, _LEFT), (-1.0, _RIGHT))]
        self.sound = np.zeros(round(SECONDS * RATE), np.float32)
        for start_s, text in SENTENCES:
            spoken, start = synthesised_sentence(text), round(start_s * RATE)
            self.sound[start : start + len(spoken)] += spoken[: len(self.sound) - start]
        self.sound *= _PEAK / np.abs(self.sound).max()
        self._loud, self._bright = heard(self.sound)

    def posture(self, t: float) -> Posture:
        talk = self._at(self._loud, t - 0.05)
        left, right = (_beating(track.at(t), k, t, talk) for k, track in enumerate(self._hands))
        nod = 0.02 * math.sin(2.3 * t) + 0.03 * talk * math.sin(7.1 * t)
        sway = np.array((0.02 + 0.012 * math.sin(1.5 * t), 0.05 * math.sin(0.55 * t), 0.015 * math.sin(0.8 * t + 1.0)))
        aside = 0.10 * math.sin(0.9 * t) * math.sin(0.31 * t)
        look = self._look + self._sitter.direction_in_room(np.array((aside, 1.5 * nod - 0.04, 0.0)))
        # Looks at the elbow when pointing at it.
        at_elbow = bump(t, (2.6, 3.2), (3.7, 4.3))
        look = look + 0.55 * at_elbow * (self._sitter.out_of_seat(np.array((0.36, 1.0, 0.3))) - look)
        return self._sitter.posture(left, right, look, sway, np.array((0.02 * math.sin(3.1 * t), 0.0)))

    def channels(self, t: float) -> list[float]:
        """61 values, order of CHANNELS."""
        names = list[str](CHANNELS)
        v: dict[str, float] = dict.fromkeys(names, 0.0)
        loud, bright = self._at(self._loud, t), self._at(self._bright, t)
        v["jawOpen"] = 0.42 * loud
        v["mouthFunnel"] = 0.55 * loud * max(0.0, 1.0 - 1.6 * bright)
        stretch = 0.35 * loud * max(0.0, bright - 0.35)
        brows = bump(t, (6.2, 6.9), (8.1, 8.9)) + 0.45 * bump(t, (1.3, 1.7), (2.3, 2.9)) + 0.4 * bump(t, (11.2, 11.7), (12.3, 13.0))
        v["browInnerUp"] = min(1.0, brows)
        frown = 0.7 * bump(t, (9.2, 9.7), (10.4, 11.0))
        smile = 0.85 * bump(t, (15.0, 15.9), (18.8, 19.7)) + 0.2 * bump(t, (4.6, 5.0), (5.6, 6.1))
        squint = 0.95 * bump(t, (15.2, 16.0), (18.7, 19.5))
        lid = max((math.sin(math.pi * (t - b) / _BLINK_S) for b in _BLINKS if b < t < b + _BLINK_S), default=0.0)
        for side in ("Left", "Right"):
            v[f"mouthStretch{side}"], v[f"browOuterUp{side}"], v[f"browDown{side}"] = stretch, 0.85 * min(1.0, brows), frown
            v[f"mouthSmile{side}"], v[f"cheekSquint{side}"], v[f"eyeSquint{side}"] = smile, squint, 0.5 * squint
            v[f"eyeBlink{side}"] = lid
        return [v[name] for name in names]

    def _at(self, track: F64, t: float) -> float:
        return float(np.interp(t, np.arange(len(track)) * FRAME_S, track, 0.0, 0.0))


def still(person: SimulatedPerson, look: F64) -> Posture:
    """Of somebody who sits with their hands on the table and looks at a point of the room, (3,)."""
    sitter = Sitter(person)
    left, right = (HandTrack([_hand(sitter, side, (0.0, *_REST))]).at(0.0) for side in (1.0, -1.0))
    return sitter.posture(left, right, look, np.zeros(3), np.zeros(2))


def _hand(sitter: Sitter, side: float, key: Key) -> HandKey:
    """side: 1 for the left hand, -1 for the right one."""
    t, at, fingers, palm, bend = key
    mirror = np.array((side, 1.0, 1.0))
    along, across = (sitter.direction_in_room(np.array(v) * mirror) for v in (fingers, palm))
    rotation = quaternion_from_matrix(hand_rotation(side, along, across))
    return HandKey(t, sitter.out_of_seat(np.array(at) * mirror), rotation, bend)


def _beating(hand: HandState, row: int, t: float, talk: float) -> HandState:
    """A hand that beats a little with the speech."""
    beat = talk * (0.012 * math.sin(8.3 * t + row) + 0.008 * math.sin(5.1 * t + 2.0 * row))
    fingers = hand.fingers * (1.0 - 0.1 * talk * math.sin(4.0 * t))
    return replace(hand, position=hand.position + np.array((0.0, beat, 0.0)), fingers=fingers)


def heard(sound: F32) -> tuple[F64, F64]:
    """How loud a voice is in each frame, 0 to 1, and how bright: 0 as in "oo", 1 as in "ee"; smooth enough for lips."""
    size = round(FRAME_S * RATE)
    frames = sound[: len(sound) // size * size].reshape(-1, size).astype(np.float64)
    loud = np.sqrt((frames**2).mean(axis=1))
    power = np.abs(np.fft.rfft(frames * np.hanning(size), axis=1)) ** 2
    pitch = np.fft.rfftfreq(size, 1.0 / RATE)
    low, high = (power[:, (pitch > a) & (pitch < b)].sum(axis=1) for a, b in ((200.0, 1000.0), (1600.0, 3200.0)))
    bright = high / np.maximum(low + high, 1e-9)
    window = np.hanning(7) / np.hanning(7).sum()
    most = max(float(np.quantile(loud, 0.97)), 1e-6)
    return np.convolve(np.clip(loud / most, 0.0, 1.0), window, "same"), np.convolve(np.sqrt(bright), window, "same")
