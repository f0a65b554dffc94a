"""What the mouse of a window leads, over the real bus: free at once when it is let go of, and taken back with one undo."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import until
from world_site import CONFERENCE

from vistel.conference.paths import RunPaths
from vistel.render.interaction.requests import CommandRequest, Drag, Drop
from vistel.space import actions as ask
from vistel.space.things import props
from vistel.v1.device_pb2 import TrackerReceiver
from vistel.v1.motion_pb2 import Participant, Prop
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire.bus import Sample
from vistel.wire.clock import SystemClock
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_services import world
from vistel_services.renderer.window.wire import DROP_REPEATS, WindowWire
from vistel_services.world.received import InputCollector

UPRIGHT = np.array((0.0, 0.0, 0.0, 1.0))
STILL = np.zeros(3)
UP = np.array((0.0, 1.0, 0.0))
SILENT_NS = props.SILENT_NS


@pytest.fixture(autouse=True)
def _hours_of_silence_count_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a machine that stands still for half a second the ball would fall, and be taken up anew: two things to undo."""
    monkeypatch.setattr(props, "SILENT_NS", 10**13)


class Site:
    """A window's wire at tokyo, the world at the hub, and somebody in paris who sees the room."""

    def __init__(self, tokyo: ZenohBus, paris: ZenohBus, clock: SystemClock, lost: Callable[[Prop], bool]) -> None:
        self.clock, self.wire = clock, WindowWire(tokyo, clock, "aiko", {"tokyo": ("aiko",)})
        self.told: list[Prop] = []
        publish = self.wire._publish

        def through(message: Prop) -> None:
            self.told.append(message)
            if not lost(message):
                publish(message)

        self.wire._publish = through  # type: ignore[method-assign]
        self.room, self.now = WorldListener(paris, clock), None
        self.coming = deque[Any]()
        self.inputs = paris.subscribe(BY_NAME["world_inputs"], queue_all=True)
        self.steps: list[WorldInputs] = []

    async def until(self, holds: Callable[[], bool], what: str) -> None:
        """Asks after each state of the room: on a busy machine several come at once."""

        def seen() -> bool:
            self.steps += [s.message for s in self.inputs.take()]
            self.coming += [now for now, _ in self.room.take()]
            while self.coming:
                self.now: Any = self.coming.popleft()
                if holds():
                    return True
            return self.now is not None and holds()

        await until(seen, what)

    @property
    def ball(self) -> np.ndarray:
        return self.now.poses["ball"][0]

    async def drawn_up(self) -> np.ndarray:
        """The ball, led half a metre up."""
        await self.until(lambda: "ball" in self.now.poses, "the room")
        start = self.ball.copy()
        for k in range(1, 11):
            self.wire.drag(Drag("ball", start + 0.05 * k * UP, UPRIGHT, STILL))
            await asyncio.sleep(0.02)  # a hand takes time
        top = start + 0.5 * UP

        def there() -> bool:
            self.wire.drag(Drag("ball", top, UPRIGHT, STILL))  # else it would fall where the world comes late
            return bool(np.allclose(self.ball, top, atol=1e-3))

        await self.until(there, "the ball up there, in paris")
        return top

    def action(self, action: ask.Action) -> None:
        self.wire.ask(CommandRequest(action))


async def motions(bus: ZenohBus, clock: SystemClock) -> None:
    """Aiko stands at her place."""
    bus.announce("process-capture")
    about = Participant(participant="aiko", site="tokyo", avatar="builtin:person=carla", height_m=1.7)
    bus.publish(BY_NAME["participant"], participant="aiko").put(about)
    publication, encoder = bus.publish(BY_NAME["motion"], participant="aiko"), MotionEncoder()
    for k in range(1, 1_000_000):
        stance = np.array((0.0, 0.0, -2.0, 0.0))
        publication.put(encoder.encode(MotionSample(k, clock.now_ns(), np.zeros(25), np.zeros((2, 20)), stance)))
        await asyncio.sleep(1 / 60)  # as a tracker does, in real time


def played(folder: Path, play: Callable[[Site], Awaitable[None]], lost: Callable[[Prop], bool] = lambda message: False) -> None:
    async def whole() -> None:
        clock, router = SystemClock(), Router.open()
        places = ("hub", "tokyo", "paris", "tokyo")
        buses = [await ZenohBus.open(conference="demo", site=s, clock=clock, endpoints=[router.endpoint]) for s in places]
        hub, tokyo, paris, capture = buses
        config = replace(world.configure(CONFERENCE, None, RunPaths(folder / "run", folder)), folder=None)
        tasks = [asyncio.create_task(world.run(config, hub, clock)), asyncio.create_task(motions(capture, clock))]
        site = Site(tokyo, paris, clock, lost)
        try:
            await play(site)
        finally:
            site.wire.close()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            for bus in buses:
                await bus.close()
            router.close()

    asyncio.run(whole())


def test_it_falls_at_once_when_it_is_let_go_of_and_one_undo_brings_it_back_and_one_redo_up_again(tmp_path: Path) -> None:
    async def play(site: Site) -> None:
        await site.until(lambda: "ball" in site.now.poses, "the room")
        start = site.ball.copy()
        top = await site.drawn_up()
        site.wire.drop(Drop("ball", top, UPRIGHT, STILL))
        await site.until(lambda: site.ball[1] < top[1] - 0.02, "the ball falling: by its last word, for silence frees nothing here")
        await site.until(lambda: any(p.let_go for s in site.steps for p in s.props), "its last word, which comes by another way")
        words = [s for s in site.steps if any(p.let_go for p in s.props)]
        assert words[0].props[0].led_by == "aiko"
        await site.until(lambda: site.ball[1] < start[1] + 0.1, "the ball down")
        site.action(ask.Undo())
        await site.until(lambda: bool(np.allclose(site.ball, start, atol=5e-3)), "the ball where it was before")
        site.action(ask.Redo())
        await site.until(lambda: site.ball[1] > top[1] - 0.1, "the ball up again")
        site.action(ask.Undo())
        await site.until(lambda: bool(np.allclose(site.ball, start, atol=5e-3)), "the ball back once more")
        await site.until(lambda: sum(m.let_go for m in site.told) == DROP_REPEATS, "all its last words")
        assert len({m.header.t_ns for m in site.told if m.let_go}) == 1

    played(tmp_path, play)


@pytest.mark.parametrize("lost_words", [1, DROP_REPEATS])
def test_when_its_last_word_is_lost_the_next_one_frees_it_and_without_any_silence_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lost_words: int
) -> None:
    gone: list[Prop] = []

    def lost(message: Prop) -> bool:
        if message.let_go:
            gone.append(message)
        return message.let_go and len(gone) <= lost_words

    async def play(site: Site) -> None:
        top = await site.drawn_up()
        start = top - 0.5 * UP
        if lost_words == DROP_REPEATS:
            monkeypatch.setattr(props, "SILENT_NS", SILENT_NS)
        site.wire.drop(Drop("ball", top, UPRIGHT, STILL))
        await site.until(lambda: site.ball[1] < top[1] - 0.02, "the ball falling")
        if lost_words < DROP_REPEATS:
            await site.until(lambda: any(p.let_go for s in site.steps for p in s.props), "one of its last words")
        else:
            assert not any(p.let_go for s in site.steps for p in s.props)
        site.action(ask.Undo())
        await site.until(lambda: bool(np.allclose(site.ball, start, atol=5e-3)), "the ball where it was before")

    played(tmp_path, play, lost)


def test_a_window_that_is_closed_in_the_middle_of_a_drag_lets_go(tmp_path: Path) -> None:
    async def play(site: Site) -> None:
        top = await site.drawn_up()
        site.wire.close()
        await site.until(lambda: any(p.let_go for s in site.steps for p in s.props), "its last word")
        await site.until(lambda: site.ball[1] < top[1] - 0.02, "the ball falling")

    played(tmp_path, play)


# -- what the world takes in -----------------------------------------------------------------------------------------


def prop(site: str, t_ns: int, who: str, let_go: bool = False) -> Sample:
    message = Prop(thing="ball", health=TrackerReceiver.HEALTH_GOOD, led_by=who, let_go=let_go)
    message.header.t_ns = t_ns
    return Sample(BY_NAME["prop"], "", {"site": site, "thing": "ball"}, message, t_ns)


def taken(intake: InputCollector, *samples: Sample) -> list[tuple[str, bool]]:
    for sample in samples:
        intake.prop(sample)
    return [(p.led_by, p.let_go) for p in intake.take(0).props]


def test_another_site_may_lead_a_thing_as_soon_as_the_first_has_let_go_of_it() -> None:
    intake = InputCollector()
    assert taken(intake, prop("tokyo", 10, "aiko"), prop("paris", 11, "bruno")) == [("aiko", False)]
    assert taken(intake, prop("paris", 12, "bruno", let_go=True)) == []
    # Both in one step: who lets go comes first.
    assert taken(intake, prop("tokyo", 13, "aiko", let_go=True), prop("paris", 14, "bruno")) == [("aiko", True), ("bruno", False)]
    assert taken(intake, prop("tokyo", 13, "aiko", let_go=True), prop("tokyo", 15, "aiko")) == []


def test_what_was_said_before_the_last_word_and_comes_after_it_is_not_heard() -> None:
    intake = InputCollector()
    assert taken(intake, prop("tokyo", 10, "aiko"), prop("tokyo", 30, "aiko", let_go=True)) == [("aiko", True)]
    assert taken(intake, prop("tokyo", 20, "aiko"), prop("tokyo", 30, "aiko", let_go=True)) == []
    assert taken(intake, prop("tokyo", 40, "aiko")) == [("aiko", False)]
