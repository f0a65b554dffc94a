"""A face that moves: the effect of every action unit on the vertices of one head at rest."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I64, Bool
from vistel.figure.avatar.avatar import Target
from vistel.figure.face.landmarks import Landmarks
from vistel.figure.face.lids import Lids, before_the_eye, lids_of, off_the_eye
from vistel.figure.face.lips import line_of_lips, sides_of_mouth
from vistel.figure.face.marks import MARK_COUNT, MARK_INDEX, MARKS
from vistel.figure.face.rules import FaceRules, OneSided, SkinPull, builtin_rules
from vistel.figure.face.seal import seal_of
from vistel.figure.face.targets import half, shapes_of
from vistel.geometry.smoothstep import smooth

REACH_M = 0.05
"""How far round a mark the skin follows the part of its motion that the rules do not explain [m]."""
MOST_REST = 0.012
"""How much of that motion the skin follows, at most [m]."""
BLINK = "AU45"
LIP_OF = {"upper_lip": False, "lower_lip": True, "chin": True}
"""Marks that move with what is above (False) or below the line between the lips."""
JAW_SIDE = 0.020, 0.080
"""Distances from the middle up to which skin follows the jaw wholly, and from which it no longer does [m, a standard head]."""
NEUTRAL_GAZE_LID = 0.55
"""Share of the gaze's pitch that the upper lid follows."""


@dataclass(frozen=True, eq=False)
class Expression:
    """What a face does. intensity: (K,) of the rules' units; marks: (13, 2) how far the marks are from their rest [m, a standard
    head], NaN where that is not known, None: nothing is known of them; lids: (2,) opening of the left and the right eye, 0
    closed, 1 as at rest; pitch: of the gaze, up [rad]."""

    intensity: F64
    marks: F64 | None = None
    lids: tuple[float, float] = (1.0, 1.0)
    pitch: float = 0.0

    @staticmethod
    def none(rules: FaceRules) -> "Expression":
        """A face at rest."""
        return Expression(np.zeros(len(rules.units)))

    @property
    def still(self) -> bool:
        """Whether it moves nothing."""
        moved = self.marks is not None and np.nanmax(np.abs(self.marks), initial=0.0) > 1e-4
        return not (self.intensity.any() or moved) and self.lids == (1.0, 1.0) and abs(self.pitch) < 0.01


class FaceShape:
    """The rules laid on one head."""

    def __init__(
        self,
        vertices: NDArray[np.floating],
        marks: Landmarks,
        rules: FaceRules | None = None,
        triangles: NDArray[np.integer] | None = None,
        targets: Sequence[Target] = (),
        still: Bool | None = None,
    ) -> None:
        """vertices: (V, 3) at rest, of skin that may move. triangles: (T, 3) of it; None: taken for closed between the lips.
        targets: the head's own shapes, which take the place of the rules for the units that they mean. still: (V,) vertices of
        what is worn over the face and takes no part in it (`vistel.figure.avatar.avatar.rigid`)."""
        self.rules = builtin_rules() if rules is None else rules
        self.landmarks = marks
        scale = self._scale = marks.scale
        v = np.asarray(vertices, np.float64)
        near = np.abs(v - marks.middle) < np.array((0.11, 0.16, 0.12)) * scale
        may = near.all(axis=1) & (v[:, 2] > marks.hinge[2] - 0.02 * scale)
        self.vertex: I64 = np.flatnonzero(may if still is None else may & ~still)
        """(F,) those that may move at all."""
        # After them the marks themselves, which show how far the rules move them.
        self._p = np.concatenate((v[self.vertex], marks.marks))
        self._below, inside = below_the_lips(self._p, marks), np.zeros(len(self._p), np.bool_)
        side = np.full(len(v), np.nan)
        if triangles is not None:
            side, within = sides_of_mouth(v, np.asarray(triangles, np.int64), marks)
            inside[:-MARK_COUNT] = within[self.vertex]
            self._below[:-MARK_COUNT] = _of_lip(
                self._p[:-MARK_COUNT], side[self.vertex], self._below[:-MARK_COUNT], within[self.vertex], marks
            )
        self._outside = 1.0 - inside.astype(np.float64)
        self.jaw = _jaw_weight(self._p, self._below, marks, inside)
        """(F,) share of the jaw's motion."""
        self._unit = np.array([self._pulled(u) for u in self.rules.units]).reshape(len(self.rules.units), -1)
        self._jaw = np.radians([u.unit.jaw for u in self.rules.units]).reshape(-1, 2)
        self._close = np.zeros((len(self.rules.units), 2, 2))
        for k, u in enumerate(self.rules.units):
            for eye in range(2):
                if u.side == 0 or (u.side > 0) == (eye == 0):
                    self._close[k, eye] = u.unit.lids
        self._blinks = [-1, -1]
        if targets:
            self._own(targets, len(v))
        self._follow = self._following()
        faces = None if triangles is None else self._faces(np.asarray(triangles, np.int64), len(v))
        self._lids = [lids_of(self._p, eye, scale, faces) for eye in marks.eyes]
        self._round_eye = [before_the_eye(self._p[:-MARK_COUNT], eye, marks.ball) for eye in marks.eyes]
        self._seal = None
        if targets and triangles is not None and faces is not None:
            self._seal = seal_of(self._p[:-MARK_COUNT], faces, side[self.vertex], marks)

    def offsets(self, e: Expression) -> F32:
        """(F, 3) how far each vertex moves [m]."""
        e = self._blinking(e)
        p = self._by_rules(e)
        if e.marks is not None:
            made = (p[-MARK_COUNT:] - self.landmarks.marks)[:, :2]
            rest = np.nan_to_num(self._scale * e.marks - made)
            p[:, :2] += self._follow @ np.clip(rest, -MOST_REST * self._scale, MOST_REST * self._scale)
        if self._seal is not None:
            self._seal.part_lips(p)
        for eye, lid in enumerate(self._lids):
            self._blink(p, lid, e, eye)
            if self.landmarks.ball > 0.0:
                off_the_eye(p, self._p, self._round_eye[eye], self.landmarks.eyes[eye], self.landmarks.ball)
        return np.asarray((p - self._p)[:-MARK_COUNT], np.float32)

    def _by_rules(self, e: Expression) -> F64:
        """(F + 13, 3) places after pulls and jaw."""
        active = np.flatnonzero(e.intensity > 1e-4)
        moved = (e.intensity[active] @ self._unit[active]).reshape(-1, 3) if len(active) else np.zeros_like(self._p)
        p = self._p + moved
        opens, turns = (float(x) for x in e.intensity @ self._jaw)
        return self._jaw_turned(p, opens, turns) if opens or turns else p

    def _faces(self, triangles: I64, count: int) -> I64:
        """Those of `triangles` whose corners all may move, by their places among these."""
        place = np.full(count, -1)
        place[self.vertex] = np.arange(len(self.vertex))
        faces = place[triangles]
        return faces[(faces >= 0).all(axis=1)]

    def _own(self, targets: Sequence[Target], count: int) -> None:
        """Replace units by the head's own morph targets."""
        place = np.full(count, -1)
        place[self.vertex] = np.arange(len(self.vertex))
        at = [self._skin_at(name) for name in MARKS]
        for k, u in enumerate(self.rules.units):
            shapes, split = shapes_of(u, targets)
            if not shapes:
                continue
            moved = np.zeros_like(self._p)
            for shape in (t.of(place) for t in shapes):
                np.add.at(moved, shape.vertex, shape.offset)
            if split:
                moved *= half(self._p, self.landmarks.middle, self._scale, u.side)[:, None]
            moved[-MARK_COUNT:] = moved[at]
            self._unit[k], self._jaw[k], self._close[k] = moved.ravel(), 0.0, 0.0
            if u.unit.name == BLINK:
                self._blinks[0 if u.side > 0 else 1] = k

    def _skin_at(self, mark: str) -> int:
        """The vertex nearest to a mark, of the lip that it is on, and not inside the mouth."""
        away = np.linalg.norm(self._p - self.landmarks.marks[MARK_INDEX[mark]], axis=1)
        other = self._outside < 0.5
        if mark in LIP_OF:
            other |= (self._below > 0.5) != LIP_OF[mark]
        return int(np.argmin((away + other)[:-MARK_COUNT]))

    def _blinking(self, e: Expression) -> Expression:
        """The head's own morph targets for the lids, where it has them."""
        if max(self._blinks) < 0 or e.lids == (1.0, 1.0):
            return e
        intensity, lids = e.intensity.copy(), list(e.lids)
        for eye, k in enumerate(self._blinks):
            if k >= 0:
                intensity[k] = min(1.0, max(float(intensity[k]), 1.0 - e.lids[eye]))
                lids[eye] = 1.0
        return replace(e, intensity=intensity, lids=(lids[0], lids[1]))

    def _pulled(self, u: OneSided) -> F64:
        """(F, 3) displacement by a unit's pulls at intensity 1."""
        total, out = np.zeros(len(self._p)), np.zeros_like(self._p)
        for pull in u.unit.pulls:
            weight = self._falloff(u, pull)
            move = 1e-3 * self._scale * np.array((u.mirror * pull.move[0], pull.move[1], pull.move[2]))
            total += weight
            out += weight[:, None] * move
        return out / np.maximum(1.0, total)[:, None]

    def _falloff(self, u: OneSided, pull: SkinPull) -> F64:
        centre = self.landmarks.marks[u.mark(pull.at)]
        offset = np.array((u.mirror * pull.offset[0], pull.offset[1], pull.offset[2]))
        away = (self._p - centre - 1e-3 * self._scale * offset) / (1e-3 * self._scale * np.array(pull.radius))
        weight = self._outside * np.maximum(0.0, 1.0 - (away * away).sum(axis=1)) ** 2
        if pull.lip == "lower":
            weight = weight * self._below
        elif pull.lip == "upper":
            weight = weight * (1.0 - self._below)
        return weight

    def _following(self) -> F64:
        """(F + 13, 13) how skin follows the part of each mark's motion that the rules do not explain: all at the mark, none at the
        others, smoothly between (Wendland's C2 kernel), separately for each lip, and none beyond the face."""
        p, marks, scale = self._p, self.landmarks, self._scale
        weight = np.stack([_round(p, m, REACH_M * scale) for m in marks.marks], axis=1)
        for name in ("lower_lip", "chin"):
            weight[:, MARK_INDEX[name]] *= self._below
        for name in ("upper_lip", "left_nose_wing", "right_nose_wing"):
            weight[:, MARK_INDEX[name]] *= 1.0 - self._below
        across, up, ahead = (np.abs(p[:, 0] - marks.middle[0]), np.abs(p[:, 1] - marks.middle[1]), p[:, 2] - marks.hinge[2])
        rim = smooth((0.11 - across / scale) / 0.03) * smooth((0.16 - up / scale) / 0.04) * smooth((ahead / scale + 0.02) / 0.04)
        own = weight[-MARK_COUNT:] + 1e-3 * np.eye(MARK_COUNT)
        return (rim * self._outside)[:, None] * (weight @ np.linalg.inv(own))

    def _jaw_turned(self, p: F64, opens: float, turns: float) -> F64:
        """Turned about the hinge: down by `opens`, to the left by `turns` [rad], each vertex its share."""
        w, q = self.jaw, p - self.landmarks.hinge
        a, b = w * opens, w * turns
        c, s = np.cos(a), np.sin(a)
        y, z = c * q[:, 1] - s * q[:, 2], s * q[:, 1] + c * q[:, 2]
        c, s = np.cos(b), np.sin(b)
        return np.column_stack((c * q[:, 0] + s * z, y, c * z - s * q[:, 0])) + self.landmarks.hinge

    def _blink(self, p: F64, lid: Lids, e: Expression, eye: int) -> None:
        """Turn both lids of an eye about its centre, in place."""
        if len(lid.vertex) == 0:
            return
        shut = e.intensity @ self._close[:, eye]
        by = 1.0 - e.lids[eye]
        upper, lower = (float(np.clip(s + by, -0.6, 1.0)) for s in shut)
        # The upper lid follows a gaze down, never farther than to the lower lid.
        follow = NEUTRAL_GAZE_LID * -e.pitch * (1.0 - max(0.0, upper))
        if abs(upper) < 1e-3 and abs(lower) < 1e-3 and abs(follow) < 1e-3:
            return
        turn = lid.angle * np.where(lid.upper, upper, lower) + follow * lid.follow
        q = p[lid.vertex] - lid.centre
        c, s = np.cos(turn), np.sin(turn)
        q[:, 1], q[:, 2] = c * q[:, 1] - s * q[:, 2], s * q[:, 1] + c * q[:, 2]
        p[lid.vertex] = q + lid.centre


def below_the_lips(p: F64, marks: Landmarks) -> F64:
    """(N,) 0 above, 1 below the line between the lips; beyond the corners of the mouth the change is wide."""
    line, across = line_of_lips(p, marks)
    beyond = np.clip((across - 0.75) / 0.55, 0.0, 1.0)
    soft = marks.scale * (0.0009 + 0.020 * beyond * beyond)
    return smooth((line - p[:, 1]) / soft * 0.5 + 0.5)


def _of_lip(p: F64, side: F64, below: F64, inside: NDArray[np.bool_], marks: Landmarks) -> F64:
    """(N,) `below`, sharp between the lips' edges where it is known which lip a vertex is of, as it was at the corners."""
    _, across = line_of_lips(p, marks)
    corner = np.where(inside, 0.0, smooth((across - 0.72) / 0.25))
    return np.where(np.isnan(side), below, side + corner * (below - side))


def _jaw_weight(p: F64, below: F64, marks: Landmarks, inside: NDArray[np.bool_]) -> F64:
    """(N,) how much of the jaw's turn a vertex makes: all below the lips to the chin, little at the throat, nothing above; what is
    inside the mouth moves with its own jaw, as teeth do."""
    scale, m = marks.scale, marks.marks
    q = p - marks.hinge
    angle = np.arctan2(-q[:, 1], q[:, 2])
    at = 0.5 * (m[MARK_INDEX["left_mouth_corner"]] + m[MARK_INDEX["right_mouth_corner"]]) - marks.hinge
    mouth = float(np.arctan2(-at[1], at[2]))
    chin = m[MARK_INDEX["chin"]] - marks.hinge
    last = float(np.arctan2(-chin[1], chin[2]))
    half = abs(m[MARK_INDEX["left_mouth_corner"]][0] - m[MARK_INDEX["right_mouth_corner"]][0]) * 0.5
    aside = np.abs(p[:, 0] - marks.middle[0])
    # Beside the mouth the cheek stretches over a wide angle; towards the corners of the jaw the skin follows less and less.
    cheek = smooth((angle - (mouth - 0.33)) / 0.60)
    at_lips = (1.0 - smooth((aside / half - 0.45) / 0.5)) * smooth((q[:, 2] - 0.045 * scale) / (0.02 * scale))
    at_lips = np.where(inside, 1.0, at_lips)
    weight = (cheek + at_lips * (below - cheek)) * (1.0 - smooth((aside / scale - JAW_SIDE[0]) / (JAW_SIDE[1] - JAW_SIDE[0])))
    throat = 1.0 - smooth((angle - last - 0.18) / 0.62)
    return weight * throat


def _round(p: F64, mark: F64, reach: float) -> F64:
    away = np.linalg.norm(p - mark, axis=1) / reach
    return np.maximum(0.0, 1.0 - away) ** 4 * (4.0 * away + 1.0)
