"""What somebody does at a window with mouse, keyboard and 3D mouse: looks about, walks, picks, selects, drags things.

It turns the window's events into requests. The thread that draws owns it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import moderngl
import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.render.interaction.dragging import Dragging
from vistel.render.interaction.events import LEFT, RIGHT, Button, Event, FocusLost, InputState, Key, Pointer, Wheel
from vistel.render.interaction.interface import InputWindow
from vistel.render.interaction.navigation import LOOK, Deflection, Viewpoint, moves, navigated
from vistel.render.interaction.panel import KEYS, Panel, PanelState, open_panel
from vistel.render.interaction.picking import Hit, Ray, Targets, ray_through
from vistel.render.interaction.requests import CommandRequest, DrawingRequest, RecordRequest, Request
from vistel.render.interaction.status import ConferenceStatus
from vistel.render.interaction.writing import Writing
from vistel.render.stage.stage import Instant
from vistel.render.things.outlines import Outline
from vistel.render.view.camera import Camera, overview
from vistel.render.view.screens import Box, Sight, fitted
from vistel.render.view.view import Choices, Mode
from vistel.space import actions as ask
from vistel.space.actions import Action
from vistel.space.arguments import Reaction, Which
from vistel.space.files.model import Polymesh
from vistel.space.files.surfaces import pieces_of
from vistel.space.things.things import Thing

log = logging.getLogger("vistel.renderer")


CLICK = 4.0
"""A mouse that moved no further than this while its button was down clicked [pixels]."""
HOVER = (235, 235, 235)
"""Colour of the line round what the mouse is on."""
ARRIVED = 0.01
"""A thing that was dropped is shown at that place until the world's own place is as near to it as this [m] ..."""
AFTER_NS = 700_000_000
"""... but no longer than this."""
_ACTIONS: Mapping[str, Action] = MappingProxyType(
    {"take": ask.Grip(), "let go": ask.Release(), "undo": ask.Undo(), "redo": ask.Redo()}
)
ERASER = "x"
"""Key with which the mouse rubs out what is written on a board."""
_KEYS = {"g": "take", "l": "let go", "u": "undo", "y": "redo", "f9": "record"}
_REACTIONS = dict(zip("12345", Reaction, strict=True))
"""Keys with which one reacts while shift is held down: those of a guest's page, where they need no shift."""


@dataclass
class _Dropped:
    """A thing that was dropped, and where. world: (3,) where the world had it in the last picture."""

    thing: str
    pose: Pose
    t_ns: int
    world: F64 | None = None

    def over(self, world: F64, now_ns: int) -> bool:
        """Whether the world, which has it at (3,) now, has moved it to where it was dropped, or never will."""
        before, self.world = world if self.world is None else self.world, world
        along = world - before
        share = float((self.pose[0] - before) @ along) / max(1e-12, float(along @ along))
        nearest = before + min(1.0, max(0.0, share)) * along
        return float(np.linalg.norm(nearest - self.pose[0])) < ARRIVED or now_ns - self.t_ns > AFTER_NS


class WindowInteraction:
    """participant: in whose name; choices: as the picture begins; walled: it is drawn for a tracked head, nobody walks in it;
    stereo: both eyes' pictures are in it; models: what things look like."""

    def __init__(
        self,
        ctx: moderngl.Context,
        window: InputWindow,
        participant: str,
        choices: Choices,
        title: str,
        models: Mapping[str, Polymesh],
        *,
        walled: bool = False,
        stereo: bool = False,
        panel: Callable[[moderngl.Context], Panel | None] = open_panel,
    ) -> None:
        self._window, self._participant, self._title, self._models = window, participant, title, models
        self.choices = choices
        self.status = ConferenceStatus()
        self.deflection = Deflection()
        self._walled, self._stereo = walled, stereo
        self._panel = panel(ctx)
        self._help = False
        self._held = InputState()
        self._targets, self._known = Targets(), dict[str, Thing]()
        self._viewpoint: Viewpoint | None = None
        self._base: Camera | None = None
        self._dragging: Dragging | None = None
        self._dropped: _Dropped | None = None
        self._writing: Writing | None = None
        self._pressed: Pointer | None = None
        self._dragged = False
        self._hit: Hit | None = None
        self._requests: list[Request] = []
        self._ignored: set[int] = set()
        self._before_ns = 0

    # -- between two pictures -------------------------------------------------------------------------------------

    def take(self, instant: Instant, sights: list[Sight], size: tuple[int, int]) -> None:
        """Process the events since the last picture, whose `sights` and `size` were these."""
        seconds = (instant.now_ns - self._before_ns) * 1e-9 if self._before_ns else 0.0
        self._before_ns = instant.now_ns
        self._learn(instant)
        for event in self._window.events():
            self._event(event, instant, sights, size)
        if not self._walled and moves(self._held.keys, self.deflection):
            self._walk(navigated(self._viewpoint_now(), self._held.keys, self.deflection, seconds))
        ray = self._ray(self._held.at, sights, size)
        self._hit = self._targets.first_hit(ray, instant.world.poses) if ray is not None else None
        if self._dragging is not None:
            self._drag(self._dragging, ray, instant, sights)

    def requests(self) -> list[Request]:
        """The requests since the last call."""
        out, self._requests = self._requests, []
        return out

    def camera(self, base: Camera) -> Camera:
        """Where the picture is taken from; base: where it would be if nobody had walked."""
        if self.choices.mode is Mode.FREE and self._viewpoint is not None:
            return self._viewpoint.camera
        self._base = base
        return base

    def predicted(self, instant: Instant) -> Instant:
        """The instant with the dragged thing already where the world will have it in a moment."""
        moved = self._dragging if self._dragging is not None and self._dragged else self._dropped
        if moved is None:
            return instant
        if moved.thing not in instant.world.poses:
            return instant
        if isinstance(moved, _Dropped) and moved.over(instant.world.poses[moved.thing][0], instant.now_ns):
            self._dropped = None
            return instant
        pose = moved.pose if isinstance(moved, _Dropped) else Pose(moved.position, moved.rotation)
        return replace(instant, world=replace(instant.world, poses={**instant.world.poses, moved.thing: pose}))

    def outlines(self, outlines: list[Outline]) -> list[Outline]:
        """With a line round what the mouse is on."""
        thing = self._dragging.thing if self._dragging else self._hit.thing if self._hit else ""
        if not thing or self._known[thing].fixed:
            return outlines
        others = [o for o in outlines if o.thing != thing]
        own = [o.colours for o in outlines if o.thing == thing]
        return [*others, Outline(thing, (*own[0], HOVER) if own else (HOVER,))]

    def rows(self) -> tuple[tuple[str, bool], ...]:
        """What is written over the picture where there is no panel."""
        if self._panel is not None:
            return ()
        notices = ((self.status.notice, self.status.warning),) if self.status.notice else ()
        keys = tuple((f"{key:<20} {does}", False) for key, does in KEYS) if self._help else ()
        return (*notices, *keys)

    def draw(self, instant: Instant, hertz: float, drawn: float) -> None:
        """The panel, into the window's framebuffer, which is bound."""
        size = self._window.size()
        if self._panel is None or not all(size):
            return
        shown = PanelState(
            self.status,
            instant.people,
            instant.now_ns,
            hertz,
            drawn,
            self._title,
            self._stereo,
            self._walled,
            self._name(self._hit.thing if self._hit else ""),
            ", ".join(self._name(t) for t in self._selected(instant)),
        )
        scale = max(0.8, min(2.0, size[1] / 800.0))
        self._chosen(self._panel.draw(shown, self.choices, size, 1.0 / max(1.0, hertz or 30.0), scale))
        for action in self._panel.pressed:
            self._do(action)

    def go_on(self, before: WindowInteraction) -> None:
        """Take over what was set at another one, except its light."""
        self.choices = replace(before.choices, light=self.choices.light)
        self._viewpoint, self._base, self._help = before._viewpoint, before._base, before._help

    def leave(self) -> None:
        """Nobody is at it any more: what is dragged is dropped."""
        self._drop(self._before_ns)
        self._write_no_more()

    def close(self) -> None:
        """Give everything back."""
        if self._panel is not None:
            self._panel.close()

    # -- events ----------------------------------------------------------------------------------------------------

    def _event(self, event: Event, instant: Instant, sights: list[Sight], size: tuple[int, int]) -> None:
        before = self._held.at
        self._held.take(event)
        first = not isinstance(event, Button | Pointer) or event.window == 0
        if self._panel is not None and first and self._panel.take(event):
            if isinstance(event, Button):
                self._ignored.add(event.number)
            self._held.keys.clear()
            return
        if isinstance(event, Button):
            self._button(event, instant, sights, size)
        elif isinstance(event, Pointer):
            self._moved(event, before)
            self._write(self._ray(event, sights, size), instant)
        elif isinstance(event, Wheel):
            if self._dragging is not None:
                self._dragging.nearer(event.notches)
            elif not self._walled:
                self._walk(self._viewpoint_now().zoomed(event.notches))
        elif isinstance(event, Key) and event.down:
            self._key(event.name, instant)
        elif isinstance(event, FocusLost):
            self._drop(instant.now_ns)
            self._write_no_more()

    def _button(self, event: Button, instant: Instant, sights: list[Sight], size: tuple[int, int]) -> None:
        if not event.down and event.number in self._ignored:
            self._ignored.discard(event.number)
            return
        if event.number != LEFT:
            return
        at = Pointer(event.x, event.y, event.window)
        if event.down:
            self._pressed, self._dragged = at, False
            ray = self._ray(at, sights, size)
            self._hit = self._targets.first_hit(ray, instant.world.poses) if ray is not None else None
            if self._hit is not None and ray is not None:
                at_board = self._known[self._hit.thing], instant.world.poses[self._hit.thing], ray
                self._writing = Writing.begin(*at_board, ERASER in self._held.keys, instant.now_ns)
            if self._writing is not None:
                self._pressed = None
            elif self._hit is not None and self._may_drag(self._hit.thing, instant):
                camera = self._sight(at, sights, size).camera
                pose = instant.world.poses[self._hit.thing]
                self._dragging = Dragging.begin(self._hit, camera, pose, instant.now_ns)
            return
        if self._writing is not None:
            self._write_no_more()
            return
        if self._pressed is not None and not self._dragged:
            self._select(instant)
        if self._dragging is not None:
            self._drag(self._dragging, self._ray(at, sights, size), instant, sights)
        self._pressed = None
        self._drop(instant.now_ns)

    def _moved(self, event: Pointer, before: Pointer | None) -> None:
        if before is None or before.window != event.window:
            return
        across, down = event.x - before.x, event.y - before.y
        if self._pressed is not None and max(abs(event.x - self._pressed.x), abs(event.y - self._pressed.y)) > CLICK:
            if not self._dragged and self._dragging is not None:
                self._requests.append(CommandRequest(ask.Select(Which(self._dragging.thing))))
            self._dragged = True
        if self._dragging is not None and "r" in self._held.keys:
            self._dragging.turn(across, down, self._viewpoint_now().camera)
        elif RIGHT in self._held.buttons and RIGHT not in self._ignored and not self._walled:
            turn = LOOK / max(1, self._window.size()[1])
            self._walk(self._viewpoint_now().turned(turn * across, turn * down))

    def _write(self, ray: Ray | None, instant: Instant) -> None:
        """Go on writing to where a ray meets the board."""
        if self._writing is not None and ray is not None and self._writing.board in instant.world.poses:
            asked = self._writing.move(instant.world.poses[self._writing.board], ray, instant.now_ns)
            self._requests += [CommandRequest(action) for action in asked]

    def _write_no_more(self) -> None:
        if self._writing is not None:
            self._requests += [CommandRequest(action) for action in self._writing.rest()]
        self._writing = None

    def _key(self, key: str, instant: Instant) -> None:
        if key in _KEYS:
            self._do(_KEYS[key])
        elif key == "f1":
            self._help = not self._help
            if self._panel is not None:
                self._panel.open = not self._panel.open
        elif key == "escape":
            self._drop(instant.now_ns)
        elif key == "r" and self._dragging is None:
            up = any(hand.participant == self._participant for hand in instant.world.signals.raised)
            self._requests.append(CommandRequest(ask.RaiseHand(down=up)))
        elif key in _REACTIONS and "shift" in self._held.keys:
            self._requests.append(CommandRequest(ask.React(_REACTIONS[key])))
        elif not self._walled and key in ("1", "2", "3"):
            self._chosen(replace(self.choices, mode=(Mode.SEAT, Mode.FREE, Mode.ROOM)[int(key) - 1]))
        elif not self._walled and key == "f" and instant.people:
            names = sorted(p.about.name for p in instant.people)
            now = names.index(self.choices.who) if self.choices.mode is Mode.FOLLOW and self.choices.who in names else -1
            self._chosen(replace(self.choices, mode=Mode.FOLLOW, who=names[(now + 1) % len(names)]))

    def _do(self, action: str) -> None:
        """What a button of the panel, or its key, stands for."""
        self._requests.append(RecordRequest(not self.status.film) if action == "record" else CommandRequest(_ACTIONS[action]))

    def _chosen(self, now: Choices) -> None:
        """What was set, by key or in the panel."""
        before, self.choices = self.choices, now
        if now.mode is Mode.FREE and before.mode is not Mode.FREE:
            self._viewpoint = Viewpoint.at(self._base or overview())
        if now.light != before.light or now.scale != before.scale:
            light, scale = (now.light if now.light != before.light else None), (now.scale if now.scale != before.scale else None)
            self._requests.append(DrawingRequest(light, scale))

    # -- looking and walking -----------------------------------------------------------------------------------------

    def _viewpoint_now(self) -> Viewpoint:
        if self.choices.mode is Mode.FREE and self._viewpoint is not None:
            return self._viewpoint
        return Viewpoint.at(self._base or overview())

    def _walk(self, viewpoint: Viewpoint) -> None:
        self._viewpoint = viewpoint
        self.choices = replace(self.choices, mode=Mode.FREE)

    # -- things ------------------------------------------------------------------------------------------------------

    def _learn(self, instant: Instant) -> None:
        """What can be pointed at now."""
        for name, thing in instant.things.items():
            if self._known.get(name) is not thing:
                self._known[name] = thing
                self._targets.put(name, [p.surface for p in pieces_of(thing, self._models, 0.4)])
        for name in set(self._known) - set(instant.things):
            del self._known[name]
            self._targets.drop(name)

    def _sight(self, at: Pointer, sights: list[Sight], size: tuple[int, int]) -> Sight:
        ray = self._ray(at, sights, size)
        return next((s for s in sights if ray is not None and s.camera.position is ray.origin), sights[0])

    def _ray(self, at: Pointer | None, sights: list[Sight], size: tuple[int, int]) -> Ray | None:
        """Of the mouse, through the picture of `size` that the windows show."""
        if at is None or not sights:
            return None
        into = self._window.size(at.window)
        if not all(into):
            return None
        part = self._window.parts(size)[at.window]
        x, y = in_picture(at, part, into, self._window.eyes_apart)
        return ray_through(sights, x, size[1] - y, size)

    def _may_drag(self, name: str, instant: Instant) -> bool:
        thing = self._known[name]
        holders = [g.participant for g in instant.world.grasps if g.thing == name]
        if thing.fixed:
            return False
        if holders:
            self.status = replace(self.status, notice=f"the {thing.name} is held by {holders[0]}", warning=True)
        return not holders

    def _drag(self, dragging: Dragging, ray: Ray | None, instant: Instant, sights: list[Sight]) -> None:
        if dragging.thing not in instant.world.poses or not self._dragged or ray is None:
            return
        if dragging.lost(instant.world.poses[dragging.thing][0], instant.now_ns) or not self._may_drag(dragging.thing, instant):
            self.status = replace(self.status, notice=self.status.notice or "somebody else has it", warning=True)
            self._requests.append(dragging.drop())
            self._dragging = None
            return
        camera = next((s.camera for s in sights if s.camera.position is ray.origin), sights[0].camera)
        self._requests.append(dragging.move_to(ray, camera, self._targets, instant.world.poses, instant.now_ns))

    def _drop(self, now_ns: int) -> None:
        if self._dragging is not None and self._dragged:
            free = self._dragging.drop()
            self._requests.append(free)
            self._dropped = _Dropped(free.thing, Pose(free.position, free.rotation), now_ns)
        self._dragging = None

    def _select(self, instant: Instant) -> None:
        chosen = self._selected(instant)
        if self._hit is None or self._known[self._hit.thing].fixed:
            if chosen:
                self._requests.append(CommandRequest(ask.Select(nothing=True)))
        elif chosen != (self._hit.thing,):
            self._requests.append(CommandRequest(ask.Select(Which(self._hit.thing))))
        else:
            self._requests.append(CommandRequest(ask.Select(nothing=True)))

    def _selected(self, instant: Instant) -> tuple[str, ...]:
        return dict(instant.world.selected).get(self._participant, ())

    def _name(self, thing: str) -> str:
        known = self._known.get(thing)
        return "" if known is None else known.name or known.shape or thing


def in_picture(at: Pointer, part: Box, size: tuple[int, int], squeezed: bool) -> tuple[float, float]:
    """Where the mouse at `at` in a window of `size` is in the picture whose `part` the window shows, from its lower left."""
    left, bottom, width, height = fitted(part, size, squeezed)
    u, v = (at.x - left) / width, (size[1] - at.y - bottom) / height
    x, y, w, h = part
    return x + u * w, y + v * h
