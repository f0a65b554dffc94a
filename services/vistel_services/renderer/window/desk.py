"""What somebody does at a window with mouse, keyboard and 3D mouse: looks about, walks, points, selects, moves things.

It turns the window's events into wishes, which the service publishes (`window.wire`). The thread that draws
owns it.
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
from vistel.render.stage.stage import Instant
from vistel.render.things.outlines import Outline
from vistel.render.view.camera import Camera, overview
from vistel.render.view.screens import Box, Sight
from vistel.render.view.view import Choices, Mode
from vistel.space import actions as ask
from vistel.space.actions import Action, Which
from vistel.space.files.model import Model
from vistel.space.files.surfaces import pieces_of
from vistel.space.things.things import Thing
from vistel_services.renderer.window.carrying import Carrying
from vistel_services.renderer.window.events import LEFT, RIGHT, Button, Event, Held, Key, Lost, Pointer, Wheel
from vistel_services.renderer.window.facts import Facts
from vistel_services.renderer.window.navigation import LOOK, Puck, Walker, moves, walked
from vistel_services.renderer.window.panel import KEYS, Panel, PanelState, open_panel
from vistel_services.renderer.window.placement import fitted
from vistel_services.renderer.window.pointing import Hit, Ray, Targets, ray_through
from vistel_services.renderer.window.window import Window
from vistel_services.renderer.window.wishes import Ask, Draw, Record, Wish

log = logging.getLogger("vistel.renderer")


CLICK = 4.0
"""A mouse that moved no further than this while its button was down clicked [pixels]."""
HOVER = (235, 235, 235)
"""Colour of the line round what the mouse is on."""
CAME = 0.01
"""A thing that was let go of is shown at that place until the world's own place is as near to it as this [m] ..."""
AFTER_NS = 700_000_000
"""... but no longer than this."""
_DEEDS: Mapping[str, Action] = MappingProxyType(
    {"take": ask.Grip(), "let go": ask.Release(), "undo": ask.Undo(), "redo": ask.Redo()}
)
_KEYS = {"g": "take", "l": "let go", "u": "undo", "y": "redo", "f9": "record"}


@dataclass
class _Led:
    """A thing that was let go of, and where. world: (3,) where the world's own was in the last picture."""

    thing: str
    pose: Pose
    t_ns: int
    world: F64 | None = None

    def over(self, world: F64, now_ns: int) -> bool:
        """Whether the world's own, now at (3,), has come to where it was let go of since the last picture, or never will."""
        before, self.world = world if self.world is None else self.world, world
        along = world - before
        share = float((self.pose[0] - before) @ along) / max(1e-12, float(along @ along))
        nearest = before + min(1.0, max(0.0, share)) * along
        return float(np.linalg.norm(nearest - self.pose[0])) < CAME or now_ns - self.t_ns > AFTER_NS


class Desk:
    """participant: in whose name; choices: as the picture begins; walled: it is drawn for a tracked head, nobody walks in it;
    stereo: both eyes' pictures are in it; models: what things look like."""

    def __init__(
        self,
        ctx: moderngl.Context,
        window: Window,
        participant: str,
        choices: Choices,
        title: str,
        models: Mapping[str, Model],
        *,
        walled: bool = False,
        stereo: bool = False,
        panel: Callable[[moderngl.Context], Panel | None] = open_panel,
    ) -> None:
        self._window, self._participant, self._title, self._models = window, participant, title, models
        self.choices = choices
        self.facts = Facts()
        self.puck = Puck()
        self._walled, self._stereo = walled, stereo
        self._panel = panel(ctx)
        self._help = False
        self._held = Held()
        self._targets, self._known = Targets(), dict[str, Thing]()
        self._walker: Walker | None = None
        self._base: Camera | None = None
        self._carrying: Carrying | None = None
        self._led: _Led | None = None
        self._pressed: Pointer | None = None
        self._dragged = False
        self._hit: Hit | None = None
        self._wishes: list[Wish] = []
        self._ignored: set[int] = set()
        self._before_ns = 0

    # -- between two pictures -------------------------------------------------------------------------------------

    def take(self, instant: Instant, sights: list[Sight], size: tuple[int, int]) -> None:
        """What was done since the last picture, whose `sights` and `size` were these."""
        seconds = (instant.now_ns - self._before_ns) * 1e-9 if self._before_ns else 0.0
        self._before_ns = instant.now_ns
        self._learn(instant)
        for event in self._window.events():
            self._event(event, instant, sights, size)
        if not self._walled and moves(self._held.keys, self.puck):
            self._walk(walked(self._walker_now(), self._held.keys, self.puck, seconds))
        ray = self._ray(self._held.at, sights, size)
        self._hit = self._targets.met(ray, instant.world.poses) if ray is not None else None
        if self._carrying is not None:
            self._lead(self._carrying, ray, instant, sights)

    def wishes(self) -> list[Wish]:
        """What is wanted since the last call."""
        out, self._wishes = self._wishes, []
        return out

    def camera(self, base: Camera) -> Camera:
        """Where the picture is taken from; base: where it would be if nobody had walked."""
        if self.choices.mode is Mode.FREE and self._walker is not None:
            return self._walker.camera
        self._base = base
        return base

    def predicted(self, instant: Instant) -> Instant:
        """The instant with the thing that is led already where the world will have it in a moment."""
        led = self._carrying if self._carrying is not None and self._dragged else self._led
        if led is None:
            return instant
        if led.thing not in instant.world.poses:
            return instant
        if isinstance(led, _Led) and led.over(instant.world.poses[led.thing][0], instant.now_ns):
            self._led = None
            return instant
        pose = led.pose if isinstance(led, _Led) else Pose(led.position, led.rotation)
        return replace(instant, world=replace(instant.world, poses={**instant.world.poses, led.thing: pose}))

    def outlines(self, outlines: list[Outline]) -> list[Outline]:
        """With a line round what the mouse is on."""
        thing = self._carrying.thing if self._carrying else self._hit.thing if self._hit else ""
        if not thing or self._known[thing].fixed:
            return outlines
        others = [o for o in outlines if o.thing != thing]
        own = [o.colours for o in outlines if o.thing == thing]
        return [*others, Outline(thing, (*own[0], HOVER) if own else (HOVER,))]

    def rows(self) -> tuple[tuple[str, bool], ...]:
        """What is written over the picture where there is no panel."""
        if self._panel is not None:
            return ()
        notices = ((self.facts.notice, self.facts.amiss),) if self.facts.notice else ()
        keys = tuple((f"{key:<20} {does}", False) for key, does in KEYS) if self._help else ()
        return (*notices, *keys)

    def draw(self, instant: Instant, hertz: float, drawn: float) -> None:
        """The panel, into the window's framebuffer, which is bound."""
        size = self._window.size()
        if self._panel is None or not all(size):
            return
        shown = PanelState(
            self.facts,
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
        for deed in self._panel.deeds:
            self._do(deed)

    def go_on(self, before: Desk) -> None:
        """With what was set at another one, except its light."""
        self.choices = replace(before.choices, light=self.choices.light)
        self._walker, self._base, self._help = before._walker, before._base, before._help

    def leave(self) -> None:
        """Nobody is at it any more: what is on the mouse is let go of."""
        self._let_go(self._before_ns)

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
        elif isinstance(event, Wheel):
            if self._carrying is not None:
                self._carrying.nearer(event.notches)
            elif not self._walled:
                self._walk(self._walker_now().zoomed(event.notches))
        elif isinstance(event, Key) and event.down:
            self._key(event.name, instant)
        elif isinstance(event, Lost):
            self._let_go(instant.now_ns)

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
            self._hit = self._targets.met(ray, instant.world.poses) if ray is not None else None
            if self._hit is not None and self._may_carry(self._hit.thing, instant):
                camera = self._sight(at, sights, size).camera
                pose = instant.world.poses[self._hit.thing]
                self._carrying = Carrying.begin(self._hit, camera, pose, instant.now_ns)
            return
        if self._pressed is not None and not self._dragged:
            self._select(instant)
        if self._carrying is not None:
            self._lead(self._carrying, self._ray(at, sights, size), instant, sights)
        self._pressed = None
        self._let_go(instant.now_ns)

    def _moved(self, event: Pointer, before: Pointer | None) -> None:
        if before is None or before.window != event.window:
            return
        across, down = event.x - before.x, event.y - before.y
        if self._pressed is not None and max(abs(event.x - self._pressed.x), abs(event.y - self._pressed.y)) > CLICK:
            if not self._dragged and self._carrying is not None:
                self._wishes.append(Ask(ask.Select(Which(self._carrying.thing))))
            self._dragged = True
        if self._carrying is not None and "r" in self._held.keys:
            self._carrying.turn(across, down, self._walker_now().camera)
        elif RIGHT in self._held.buttons and RIGHT not in self._ignored and not self._walled:
            turn = LOOK / max(1, self._window.size()[1])
            self._walk(self._walker_now().turned(turn * across, turn * down))

    def _key(self, key: str, instant: Instant) -> None:
        if key in _KEYS:
            self._do(_KEYS[key])
        elif key == "f1":
            self._help = not self._help
            if self._panel is not None:
                self._panel.open = not self._panel.open
        elif key == "escape":
            self._let_go(instant.now_ns)
        elif not self._walled and key in ("1", "2", "3"):
            self._chosen(replace(self.choices, mode=(Mode.SEAT, Mode.FREE, Mode.ROOM)[int(key) - 1]))
        elif not self._walled and key == "f" and instant.people:
            names = sorted(p.about.name for p in instant.people)
            now = names.index(self.choices.who) if self.choices.mode is Mode.FOLLOW and self.choices.who in names else -1
            self._chosen(replace(self.choices, mode=Mode.FOLLOW, who=names[(now + 1) % len(names)]))

    def _do(self, deed: str) -> None:
        """What a button of the panel, or its key, stands for."""
        self._wishes.append(Record(not self.facts.film) if deed == "record" else Ask(_DEEDS[deed]))

    def _chosen(self, now: Choices) -> None:
        """What was set, by key or in the panel."""
        before, self.choices = self.choices, now
        if now.mode is Mode.FREE and before.mode is not Mode.FREE:
            self._walker = Walker.at(self._base or overview())
        if now.light != before.light or now.scale != before.scale:
            light, scale = (now.light if now.light != before.light else None), (now.scale if now.scale != before.scale else None)
            self._wishes.append(Draw(light, scale))

    # -- looking and walking -----------------------------------------------------------------------------------------

    def _walker_now(self) -> Walker:
        if self.choices.mode is Mode.FREE and self._walker is not None:
            return self._walker
        return Walker.at(self._base or overview())

    def _walk(self, walker: Walker) -> None:
        self._walker = walker
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

    def _may_carry(self, name: str, instant: Instant) -> bool:
        thing = self._known[name]
        holders = [g.participant for g in instant.world.grasps if g.thing == name]
        if thing.fixed:
            return False
        if holders:
            self.facts = replace(self.facts, notice=f"the {thing.name} is held by {holders[0]}", amiss=True)
        return not holders

    def _lead(self, carrying: Carrying, ray: Ray | None, instant: Instant, sights: list[Sight]) -> None:
        if carrying.thing not in instant.world.poses or not self._dragged or ray is None:
            return
        if carrying.lost(instant.world.poses[carrying.thing][0], instant.now_ns) or not self._may_carry(carrying.thing, instant):
            self.facts = replace(self.facts, notice=self.facts.notice or "somebody else has it", amiss=True)
            self._wishes.append(carrying.let_go())
            self._carrying = None
            return
        camera = next((s.camera for s in sights if s.camera.position is ray.origin), sights[0].camera)
        self._wishes.append(carrying.lead(ray, camera, self._targets, instant.world.poses, instant.now_ns))

    def _let_go(self, now_ns: int) -> None:
        if self._carrying is not None and self._dragged:
            free = self._carrying.let_go()
            self._wishes.append(free)
            self._led = _Led(free.thing, Pose(free.position, free.rotation), now_ns)
        self._carrying = None

    def _select(self, instant: Instant) -> None:
        chosen = self._selected(instant)
        if self._hit is None or self._known[self._hit.thing].fixed:
            if chosen:
                self._wishes.append(Ask(ask.Select(nothing=True)))
        elif chosen != (self._hit.thing,):
            self._wishes.append(Ask(ask.Select(Which(self._hit.thing))))
        else:
            self._wishes.append(Ask(ask.Select(nothing=True)))

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
