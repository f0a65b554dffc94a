"""Which things somebody means, and where: by what they say, point at, look at, have selected or hold."""

import colorsys
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import FINGERS, JOINT_INDEX
from vistel.space.actions import Refused, unseen
from vistel.space.arguments import Along, Shown, Size, Towards, Which
from vistel.space.commands.names import COLOURS
from vistel.space.people import Posed
from vistel.space.room import ROOM_RADIUS, TABLE_HEIGHT
from vistel.space.things.things import Thing

WITHIN = math.radians(12.0)
"""What is pointed or looked at lies this near the line, seen from finger or eyes."""
PARTS = ("proximal", "intermediate", "distal")


@cache
def name_of_colour(colour: int) -> str:
    """The name of the colour nearest to 0xRRGGBBAA."""
    hue, light, strength = _seen(colour)
    if strength < 0.12 or light < 0.12:
        return "black" if light < 0.25 else "white" if light > 0.75 else "grey"

    def apart(name: str) -> float:
        h, shade, s = _seen(COLOURS[name])
        turn = abs(h - hue)
        grey = 10.0 if s < 0.12 else 0.0
        return min(turn, 1.0 - turn) * 4.0 + abs(shade - light) + 0.3 * abs(s - strength) + grey

    return min(COLOURS, key=apart)


def _seen(colour: int) -> tuple[float, float, float]:
    """Hue, lightness, strength, each 0..1."""
    r, g, b = ((colour >> shift & 0xFF) / 255.0 for shift in (24, 16, 8))
    hue, light, strength = colorsys.rgb_to_hls(r, g, b)
    return hue, light, strength * (1.0 - abs(2.0 * light - 1.0))


def _cosine(a: F64, b: F64) -> float:
    return float(a @ b) / max(1e-9, float(np.sqrt((a @ a) * (b @ b))))


@dataclass(frozen=True)
class Speaker:
    """Who asks, and what can be known of them. posed: None before their first motion; selected, held: ids of things."""

    name: str
    posed: Posed | None
    selected: tuple[str, ...]
    held: tuple[str, ...]

    def direction(self, towards: Towards) -> F64:
        """(3,) unit vector in the room."""
        if towards in (Towards.UP, Towards.DOWN):  # which do not depend on the speaker
            return np.array([0.0, 1.0 if towards is Towards.UP else -1.0, 0.0])
        ahead, right = self.ahead, self.right
        return {Towards.RIGHT: right, Towards.LEFT: -right, Towards.AHEAD: ahead, Towards.BACK: -ahead}[towards]

    def axis(self, along: Along) -> F64:
        """(3,) unit vector in the room of an axis that does not depend on the thing."""
        if along is Along.UP:
            return np.array([0.0, 1.0, 0.0])
        return {Along.ACROSS: self.right, Along.AHEAD: self.ahead}[along]

    @cached_property
    def ahead(self) -> F64:
        """(3,) horizontal: where the speaker faces. Raises Refused when nobody knows."""
        heading = self._known.figure.posture.stance.heading if self._known.figure.posture else 0.0
        return np.array([math.sin(heading), 0.0, math.cos(heading)])

    @property
    def right(self) -> F64:
        """(3,) horizontal: to the speaker's right."""
        return np.array([-self.ahead[2], 0.0, self.ahead[0]])

    @property
    def _known(self) -> Posed:
        if self.posed is None:
            raise Refused(unseen(self.name))
        return self.posed

    def before(self, distance: float) -> F64:
        """(3,) on the floor so far before the speaker [m]."""
        neck = self._known.joints.position[JOINT_INDEX["neck"]]
        return neck * (1.0, 0.0, 1.0) + distance * self.ahead

    def lines(self, shown: Shown) -> list[tuple[F64, F64]]:
        """Origin and direction (3,) of the lines along which the speaker points (the hand that points more first) or looks."""
        joints = self._known.joints
        if shown is Shown.LOOKED_AT:
            eyes = [JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]
            middle = joints.position[eyes].mean(axis=0)
            return [(middle, joints.rotation[eyes[0]][:, 2].copy())]
        hands = [self._finger(side) for side in ("left", "right")]
        hands.sort(key=lambda hand: -hand[0])
        return [(origin, line) for _, origin, line in hands]

    def _finger(self, side: str) -> tuple[float, F64, F64]:
        """How much a hand points, by its index finger, straighter than the others, and by how far ahead it is; that
        finger's end and direction."""
        joints, straight = self._known.joints, dict[str, float]()
        for finger in FINGERS[1:]:
            base, middle, tip = (joints.position[JOINT_INDEX[f"{side}_{finger}_{part}"]] for part in PARTS)
            straight[finger] = _cosine(middle - base, tip - middle)
        base, _, tip = (joints.position[JOINT_INDEX[f"{side}_index_{part}"]] for part in PARTS)
        others = sum(straight[finger] for finger in FINGERS[2:]) / 3.0
        ahead = float((tip - joints.position[JOINT_INDEX["neck"]]) @ self.ahead)
        line = tip - base
        return straight["index"] - others + ahead, tip, line / max(1e-9, float(np.sqrt(line @ line)))

    def pointed_place(self) -> F64:
        """(3,) where the speaker points on the table or the floor. Raises Refused for the sky and for far away."""
        for origin, line in self.lines(Shown.POINTED):
            for height in (TABLE_HEIGHT, 0.0):
                if line[1] < -0.05 and origin[1] > height:
                    spot = origin + line * ((height - origin[1]) / line[1])
                    if math.hypot(spot[0], spot[2]) < ROOM_RADIUS:
                        return spot
        raise Refused("you point at no place in the room")


def meant(which: Which, speaker: Speaker, things: Sequence[Thing], positions: F64, radii: F64) -> list[int]:
    """Rows of the things meant; positions (N, 3), radii (N,) of all. Raises Refused for none, or for several where one was
    asked for."""
    if which.is_this:
        return _this(speaker, things, positions, radii)
    rows = [n for n, t in enumerate(things) if fits(which, t)]
    # A panel is called after its file: one that shows "ball.pdf" is the ball only where there is no ball.
    rows = [n for n in rows if fits(which, things[n], by_title=False)] or rows
    if which.shown is not None:
        chosen = set(_shown(which.shown, speaker, things, positions, radii))
        only = len(rows) == 1 and which.shown is Shown.POINTED and bool(which.name or which.shape or which.colour)
        # "That cone" is the cone where there is no other; and "the" is easily heard as "that".
        rows = rows if only else [n for n in rows if n in chosen]
    if not rows:
        raise Refused(_nothing(which))
    rows = [n for n in rows if not things[n].hidden] or rows
    if which.size is not None:
        loose = [n for n in rows if not things[n].fixed] or rows
        rows = [(max if which.size is Size.LARGEST else min)(loose, key=lambda n: float(radii[n]))]
    if which.every or which.shown in (Shown.SELECTED, Shown.HELD):
        loose = [n for n in rows if not things[n].fixed]
        return loose or rows
    if len(rows) > 1 and which.name:
        exact = [n for n in rows if things[n].name.lower() == which.name.lower()]
        rows = exact or rows
    if len(rows) > 1:
        rows = [n for n in rows if not things[n].fixed] or rows
    if len(rows) > 1:
        rows = _narrowed(rows, speaker, things, positions, radii)
    if len(rows) > 1:
        names = ", ".join(f"the {things[n].name}" for n in rows[:4]) + (", ..." if len(rows) > 4 else "")
        raise Refused(f"{len(rows)} things may be meant ({names}); say which, point at it, or say all of them")
    return rows


def fits(which: Which, thing: Thing, *, by_title: bool = True) -> bool:
    """Whether what is said of it is true of a thing, wherever it is. by_title: also by the words in the title of a panel."""
    if which.thing and thing.id != which.thing:
        return False
    words = which.name.lower().split()
    called = f"{thing.id} {thing.name}" if by_title or thing.pages is None else ""
    known = f"{called} {thing.shape} {name_of_colour(thing.colour)}".lower().split()
    return (
        all(word in known or (which.every and any(one in known for one in _singular(word))) for word in words)
        and (not which.shape or thing.shape == which.shape)
        and (not which.colour or name_of_colour(thing.colour) == which.colour)
    )


def _singular(word: str) -> tuple[str, ...]:
    """What "balls" and "boxes" may be many of."""
    return tuple(word[: -len(end)] for end in ("s", "es") if word.endswith(end) and len(word) > len(end) + 1)


_SHOWN = {
    Shown.POINTED: "where you point",
    Shown.LOOKED_AT: "where you look",
    Shown.SELECTED: "that you have selected",
    Shown.HELD: "in your hands",
}


def _nothing(which: Which) -> str:
    if which.thing:
        return f"there is no thing {which.thing!r} in the room"
    said = " ".join(word for word in (which.colour, which.name or which.shape or "thing") if word)
    return f"there is no {said} {_SHOWN[which.shown] if which.shown else 'in the room'}"


def _this(speaker: Speaker, things: Sequence[Thing], positions: F64, radii: F64) -> list[int]:
    for shown in (Shown.SELECTED, Shown.HELD, Shown.POINTED, Shown.LOOKED_AT):
        if shown in (Shown.POINTED, Shown.LOOKED_AT) and speaker.posed is None:
            continue
        if rows := _shown(shown, speaker, things, positions, radii):
            return rows
    raise Refused("nothing is meant by this: select a thing, hold it, point at it or look at it")


def _narrowed(rows: list[int], speaker: Speaker, things: Sequence[Thing], positions: F64, radii: F64) -> list[int]:
    """Of several things that fit, those the speaker also shows."""
    for shown in (Shown.SELECTED, Shown.HELD, Shown.POINTED, Shown.LOOKED_AT):
        if shown in (Shown.POINTED, Shown.LOOKED_AT) and speaker.posed is None:
            continue
        chosen = set(_shown(shown, speaker, [things[n] for n in rows], positions[rows], radii[rows]))
        if chosen:
            return [rows[k] for k in sorted(chosen)]
    return rows


def _shown(shown: Shown, speaker: Speaker, things: Sequence[Thing], positions: F64, radii: F64) -> list[int]:
    by_list: dict[Shown, Callable[[], tuple[str, ...]]] = {
        Shown.SELECTED: lambda: speaker.selected,
        Shown.HELD: lambda: speaker.held,
    }
    if shown in by_list:
        named = by_list[shown]()
        return [n for n, t in enumerate(things) if t.id in named]
    for origin, line in speaker.lines(shown):
        best, least = -1, WITHIN
        for n, thing in enumerate(things):
            if thing.fixed or thing.hidden:
                continue
            to = positions[n] - origin
            distance = float(np.sqrt(to @ to))
            if distance < 1e-6:
                continue
            off = math.acos(max(-1.0, min(1.0, float(to @ line) / distance)))
            off = max(0.0, off - math.atan2(0.5 * float(radii[n]), distance))
            if off < least:
                best, least = n, off
        if best >= 0:
            return [best]
    return []
