"""Skin that gives way where people touch, as pages are told it: offsets from where their bones alone would have it.

A page poses figures by their joints. Where something presses on somebody, the engine poses them with and without it, and what
differs is sent: for each drawn corner of the figure's file how far it is moved, and its normal, both as they are at rest, so that
the page's bones carry them along.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.body import PosedBody, pose_body
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.figure.rigid.weights import joints_only
from vistel.implicit.deformation.ghost_source import GhostSource
from vistel.render.figures.ghosts import Ghosts
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import ActingGhost

PERIOD_NS = 66_000_000
"""From one look at who presses whom to the next: at every second frame."""
MOVED_M = 3e-4
"""What moves less is left as it is [m]."""
CHANGED_M = 1.5e-3
"""Somebody's skin is told anew where a corner has moved by more since it was told [m]: a hand that rests trembles."""
SEAT = "chair"
"""The shape of things which people sit on: where they press is not seen, and always there."""
MOST_PEOPLE = 8
"""Whose skin is looked at, at most."""
LEAST_VOLUME = 0.2
"""Where bones fold the surroundings of a vertex to less of their volume, the page's skin has no inside to be pressed into."""
_MOST = 127


@dataclass(frozen=True, eq=False)
class Pressed:
    """corner: (N,) of the figure's file; offset: (N, 3) [m] and normal: (N, 3) of each, in the frame of the figure at rest."""

    corner: NDArray[np.uint32]
    offset: F64
    normal: F64

    def differs(self, other: Pressed, by_m: float) -> bool:
        """Whether one sees that it is not as `other`: a corner is elsewhere by more than `by_m`."""
        most = 1 + max(self.corner.max(), other.corner.max())
        offsets = np.zeros((2, most, 3))
        offsets[0, self.corner], offsets[1, other.corner] = self.offset, other.offset
        return bool(np.abs(offsets[0] - offsets[1]).max() > by_m)

    def row(self, who: str) -> dict[str, object]:
        """As a page reads it (clients/web/console/figures/skin.ts)."""
        step_m = max(float(np.abs(self.offset).max()), 1e-6) / _MOST
        return {
            "who": who,
            "step_m": step_m,
            "corners": _text(self.corner.astype("<u4")),
            "offsets": _text(np.rint(self.offset / step_m).astype(np.int8)),
            "normals": _text(np.rint(_MOST * self.normal).astype(np.int8)),
        }


class PressedFigure:
    """Somebody's figure, as far as it takes to know where their skin gives way. Not for two threads at once."""

    def __init__(self, avatar: Avatar) -> None:
        self._figure, mesh = Figure(avatar), avatar.mesh
        self.body, self.skeleton = avatar.body, avatar.skeleton
        bones = self._figure.skin.influences
        self._joint, self._share = joints_only(bones.bone, bones.weight)
        order = np.argsort(mesh.corner_vertex, kind="stable")
        self._corners = order.astype(np.uint32)
        """Of the first vertex, then of the second ..."""
        self._first = np.searchsorted(mesh.corner_vertex[order], np.arange(len(mesh.vertices) + 1))

    def ghosts(self, posed: PosedBody, target: NDArray[np.bool_] | None) -> GhostSource:
        """As `DrawableFigure.ghosts`."""
        return self._figure.ghosts(posed, target=target)

    def posed(self, posture: Posture) -> PosedBody:
        """Their primitives in a posture."""
        return pose_body(self.body, pose_joints(self.skeleton, posture))

    def pressed(self, posture: Posture, ghosts: Sequence[GhostSource]) -> Pressed | None:
        """What `ghosts` do to them in a posture; None: nothing that is seen."""
        alone = self._figure.pose(posture).vertices.copy()
        state = self._figure.pose(posture, ghosts)
        moved = state.vertices - alone
        at = np.flatnonzero(np.abs(moved).max(axis=1) > MOVED_M)
        carried = self._carried(at, state.joints)
        unfolded = np.linalg.det(carried) > LEAST_VOLUME
        at, back = at[unfolded], np.linalg.inv(carried[unfolded])
        if not len(at):
            return None
        offset = np.einsum("nij,nj->ni", back, moved[at])
        normal = np.einsum("nij,nj->ni", back, state.normals[at])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        counts = self._first[at + 1] - self._first[at]
        corner = np.concatenate([self._corners[self._first[v] : self._first[v + 1]] for v in at])
        return Pressed(corner, np.repeat(offset, counts, axis=0), np.repeat(normal, counts, axis=0))

    def _carried(self, vertices: NDArray[np.intp], joints: JointPose) -> F64:
        """(N, 3, 3) how bones turn the surroundings of vertices in the figure's file."""
        turned = np.einsum("nk,nkij->nij", self._share[vertices].astype(np.float64), joints.rotation[self._joint[vertices]])
        return turned / self._share[vertices].sum(axis=1, dtype=np.float64)[:, None, None]


class LookTimes:
    """When it is looked at who presses what. What stands still, as a log does where nobody plays it, is seen for long: then it is
    looked at as it is."""

    def __init__(self) -> None:
        self._seen_ns = 0

    def at(self, now_ns: int) -> tuple[int, bool]:
        """Called once for each frame, of `now_ns`: a number that is the same for frames of which one look is enough; and whether
        it stands still."""
        stands, self._seen_ns = now_ns == self._seen_ns, now_ns
        return now_ns if stands else now_ns // PERIOD_NS, stands


class PressedSkin:
    """Of all people of a room. figure: somebody's, None while it is being made and where there is none."""

    def __init__(self, figure: Callable[[ParticipantInfo], PressedFigure | None]) -> None:
        self._figure, self._ghosts = figure, Ghosts()
        self._looked: tuple[int, tuple[ActingGhost, ...], tuple[str, ...]] | None = None
        """When, at which pairs, at whose figures."""
        self._times = LookTimes()
        self._told: dict[str, Pressed] = {}
        self._words = json.dumps({"kind": "skin", "people": []})

    def words(self, now: Instant) -> str:
        """JSON: whose skin is pressed where, as of the last look."""
        seats = {thing.id for thing in now.things.values() if thing.shape == SEAT}
        acting = tuple(ghost for ghost in now.world.ghosts if ghost.source not in seats)
        touching = {name for ghost in acting for name in (ghost.target, ghost.source)}
        people = [person for person in now.people if person.about.name in touching][:MOST_PEOPLE]
        made = [(person, figure) for person in people if (figure := self._figure(person.about)) is not None]
        when, stands = self._times.at(now.now_ns)
        at = when, acting, tuple(person.about.name for person, _ in made)
        if at != self._looked:
            self._looked = at
            self._look(replace(now, world=replace(now.world, ghosts=acting)), made, MOVED_M if stands else CHANGED_M)
        return self._words

    def _look(self, now: Instant, people: list[tuple[PersonNow, PressedFigure]], by_m: float) -> None:
        figures = {person.about.name: figure for person, figure in people}
        postures = {person.about.name: person.posture for person, _ in people}
        posed = {name: figure.posed(postures[name]) for name, figure in figures.items()}
        found = {
            name: figures[name].pressed(postures[name], ghosts) for name, ghosts in self._ghosts.of(now, figures, posed).items()
        }
        pressed = {name: skin for name, skin in found.items() if skin is not None}
        if pressed.keys() != self._told.keys() or any(skin.differs(self._told[name], by_m) for name, skin in pressed.items()):
            self._told = pressed
            self._words = json.dumps({"kind": "skin", "people": [skin.row(name) for name, skin in pressed.items()]})


def _text(array: NDArray[np.generic]) -> str:
    return base64.b64encode(array.tobytes()).decode()
