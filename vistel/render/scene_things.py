"""Things in the picture: what each looks like, how soft ones are pressed now, and what people have selected."""

import logging
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64
from vistel.figure.body import PosedBody
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.ghosts.constraint import ConstraintGhost
from vistel.render.figures.figures import DrawableFigure
from vistel.render.overlays.labels import Label
from vistel.render.overlays.overlays import LabelView
from vistel.render.painter import DrawnThing, Painter
from vistel.render.room.room import linear
from vistel.render.scene_written import Written
from vistel.render.stage.stage import Instant
from vistel.render.things.outlines import Outline, colours_of
from vistel.render.things.soft import Reshaped, SoftThings, is_soft
from vistel.space.boards.board import SHAPE as BOARD
from vistel.space.boards.board import front_of
from vistel.space.commands.panel import SHAPE as PANEL
from vistel.space.files.model import Polymesh
from vistel.space.files.surfaces import SurfacePiece, pieces_of
from vistel.space.things.tessellate import Surface3, join
from vistel.space.things.things import Thing, ThingPrimitive

log = logging.getLogger("vistel.renderer")


RESTING = 1.0
"""Detail of a soft thing while nothing bends it; it needs many more triangles to be dented."""
MOST_LINES = 3
"""Round a thing that many have selected; all their names are over it."""
OVER = 0.04
"""From a thing's top to the names over it [m]."""


class ThingsShown:
    """Keeps the painter's things as the world's are. fixed: ids of those that are drawn with the room; models: what things look
    like, more may come."""

    def __init__(self, painter: Painter, models: Mapping[str, Polymesh], detail: float, fixed: Iterable[str]) -> None:
        self._painter, self._models, self._detail = painter, models, detail
        self._fixed = frozenset(fixed)
        self._things: dict[str, Thing] = {}
        self._lacking: set[str] = set()
        self._extent: dict[str, tuple[F64, F64]] = {}
        self._soft = SoftThings()
        self._reshaped: dict[str, Reshaped | None] = {}
        self._written = Written(painter)
        self._live: dict[str, int] = {}
        """Which picture of a participant's screen a panel shows; none: its page."""

    def meet(self, instant: Instant) -> None:
        """Make the pictures of things that are new or changed."""
        for thing_id, thing in instant.things.items():
            if thing_id in self._fixed or thing.hidden or not (thing.primitives or thing.looks):
                continue
            complete = all(k.model in self._models for k in thing.looks)
            if self._things.get(thing_id) is thing and not (complete and thing_id in self._lacking):
                continue
            if not complete and thing.pages and thing_id in self._things:
                continue  # the page before is seen until the new one is here
            if complete:
                self._lacking.discard(thing_id)
            elif thing_id not in self._lacking:
                self._lacking.add(thing_id)
                log.info("event=model_awaited thing=%s shown=what_is_felt_of_it", thing_id)
            self._show(thing)
            self._things[thing_id] = thing
            self._live.pop(thing_id, None)
        for thing_id in set(self._things) - {name for name, thing in instant.things.items() if not thing.hidden}:
            self._painter.drop_thing(thing_id)
            self._soft.drop(thing_id)
            self._lacking.discard(thing_id)
            self._live.pop(thing_id, None)
            del self._things[thing_id]
        self._written.meet(self._things, instant.world.strokes)
        self._show_screens(instant)

    def reshape(
        self,
        instant: Instant,
        shapes: Mapping[str, DrawableFigure],
        posed: Mapping[str, PosedBody],
        pulls: Mapping[str, Sequence[tuple[ThingPrimitive, ConstraintGhost]]],
    ) -> None:
        """Put the surfaces of soft things that have changed where they are drawn from. See `SoftThings.reshaped`."""
        now = self._soft.reshaped(instant, shapes, posed, pulls)
        for thing_id, shape in now.items():
            if shape is self._reshaped.get(thing_id):
                continue
            skin = self._soft.of(thing_id).skin
            parts = [_vertices(piece, back, skin.surface, shape) for piece, back in zip(skin.pieces, skin.back, strict=True)]
            own = [part for part, piece in zip(parts, skin.pieces, strict=True) if not piece.mesh]
            whole = [(np.concatenate([p for p, _ in own]), np.concatenate([n for _, n in own]))] if own else []
            meshes = [part for part, piece in zip(parts, skin.pieces, strict=True) if piece.mesh]
            self._painter.reshape_thing(thing_id, [*whole, *meshes])
        self._reshaped = now

    def views(self, instant: Instant) -> list[DrawnThing]:
        """Where things are drawn."""
        out: list[DrawnThing] = []
        for thing_id, (position, rotation) in instant.world.poses.items():
            if thing_id in self._things:
                matrix = np.eye(4, dtype=np.float32)
                shape = self._reshaped.get(thing_id)
                if shape is None or not shape.in_room:
                    matrix[:3, :3] = matrix_from_quaternion(rotation)
                    matrix[:3, 3] = position
                out.append(DrawnThing(thing_id, matrix, shape is not None))
                out += [DrawnThing(piece, matrix) for piece in self._written.pieces.get(thing_id, ())]
        return out

    def fronts(self, instant: Instant) -> list[F64]:
        """Corners (4, 3) of boards and panels where they stand, from the lower left one round."""
        out: list[F64] = []
        for thing_id, (position, rotation) in instant.world.poses.items():
            thing = self._things.get(thing_id)
            front = front_of(thing) if thing is not None and thing.shape in (BOARD, PANEL) and thing.primitives else None
            if front is not None:
                way = np.array((np.zeros(3), front.across, front.across + front.up, front.up))
                out.append((front.corner + way) @ matrix_from_quaternion(np.ascontiguousarray(rotation)).T + position)
        return out

    def selections(self, instant: Instant) -> tuple[list[Outline], list[LabelView]]:
        """What people have selected, and their names over it."""
        who: dict[str, list[str]] = {}
        for name, chosen in instant.world.selected:
            for thing_id in chosen:
                who.setdefault(thing_id, []).append(name)
        known = {p.about.name: p.about.display_name for p in instant.people}
        own = colours_of([*known, *(name for name, _ in instant.world.selected)])
        outlines: list[Outline] = []
        labels: list[LabelView] = []
        for thing_id, names in who.items():
            if thing_id not in instant.things or thing_id not in instant.world.poses or instant.things[thing_id].hidden:
                continue
            colours = tuple(own[name] for name in names)
            outlines.append(Outline(thing_id, colours[:MOST_LINES]))
            said = ", ".join(known.get(name, name) for name in names)
            position, rotation = instant.world.poses[thing_id]
            low, high = self._extent.get(thing_id, (np.zeros(3), np.zeros(3)))
            upwards = matrix_from_quaternion(np.ascontiguousarray(rotation))[1]
            top = float(np.maximum(upwards * low, upwards * high).sum())
            labels.append(LabelView(Label(said, frame=colours[0]), position + np.array((0.0, top + OVER, 0.0))))
        return outlines, labels

    def _show_screens(self, instant: Instant) -> None:
        for thing_id, thing in self._things.items():
            shown = instant.screens.get(thing.pages.by) if thing.pages is not None and thing.pages.live else None
            if shown is not None and self._live.get(thing_id) != shown.number:
                self._live[thing_id] = shown.number
                self._painter.repaint_thing(thing_id, shown.rgb)
            elif shown is None and self._live.pop(thing_id, None) is not None:
                self._painter.repaint_thing(thing_id, None)

    def _show(self, thing: Thing) -> None:
        if is_soft(thing):
            self._reshaped.pop(thing.id, None)
            pieces: Sequence[SurfacePiece] = self._soft.make(thing, self._models).skin.pieces
        else:
            self._soft.drop(thing.id)
            self._reshaped.pop(thing.id, None)
            pieces = pieces_of(thing, self._models, self._detail)
        self._painter.set_thing(thing.id, *_drawn(pieces))
        if is_soft(thing):
            self._painter.set_resting(thing.id, *_drawn(pieces_of(thing, self._models, RESTING)))
        every = np.concatenate([np.zeros((1, 3)), *(p.surface.vertices for p in pieces)])
        self._extent[thing.id] = every.min(axis=0), every.max(axis=0)


def _drawn(pieces: Sequence[SurfacePiece]) -> tuple[Surface3 | None, F32, list[SurfacePiece]]:
    """All pieces in plain colours as one surface, the colours of its vertices (n, 3), and the other pieces."""
    own = [p for p in pieces if not p.mesh]
    colours = np.repeat(
        np.array([linear(p.colour[0] << 24 | p.colour[1] << 16 | p.colour[2] << 8) for p in own], np.float32).reshape(-1, 3),
        [len(p.surface.vertices) for p in own],
        axis=0,
    )
    return join([p.surface for p in own]) if own else None, colours, [p for p in pieces if p.mesh]


def _vertices(piece: SurfacePiece, back: NDArray[np.int64], rest: Surface3, shape: Reshaped | None) -> tuple[F32, F32]:
    """Places and normals (n, 3) of a piece's vertices now; where nothing bends it, its edges stay as sharp as they are."""
    if shape is None:
        return rest.vertices[back], piece.surface.normals
    own = (piece.surface.normals @ shape.turn.T).astype(np.float32)
    return shape.positions[back], np.where(shape.bent[back, None], shape.normals[back], own)
