"""The world as a service: sixty steps a second on the injected clock, as long as it leads its room."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from prometheus_client import Counter, Gauge

from vistel.conference.connect import tls_files
from vistel.conference.model import HUB_PLACE, Conference, Site
from vistel.conference.model import RoomConfig as RoomKeys
from vistel.conference.paths import RunPaths
from vistel.conference.room_things import extras_of
from vistel.figure.posture.posture import standing
from vistel.persistence import store
from vistel.persistence.store import Store
from vistel.session.pictures import Pictures
from vistel.space.dynamics.motion_kernels import nearest_rotation  # pyright: ignore[reportUnknownVariableType]
from vistel.space.inputs import MotionInput, ParticipantBody, PropInput, StepInputs
from vistel.space.joints.joint import Joint, JointKind
from vistel.space.room import Extra, meeting_room
from vistel.space.room import Room as RoomShape
from vistel.space.things.things import PhysicsMaterial
from vistel.space.world import World
from vistel.wire import background, motion
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, on_thread
from vistel.wire.lease.kinds import open_lease
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.config import TlsFiles
from vistel_services.world.authority import Authority, RestartStates, Start
from vistel_services.world.from_files import serve_assets
from vistel_services.world.leadership import Leadership
from vistel_services.world.room import SAVE_STEPS, STEP_NS, Room, RoomSubscriptions

if TYPE_CHECKING:
    from vistel.space.files.interior import Interior

log = logging.getLogger("vistel.world")

CATCH_UP_STEPS = 6
"""A world that is late by no more than this steps faster; what is beyond is left out."""
ALONE_S = 20.0
"""How long a world that is to wait does so when nobody leads: those that are to lead may still be starting."""
SET_BACK_NS = 1_000_000_000
"""A next step that is so far ahead was due by a clock that has been set since."""
LEAVING_S = 1.0
"""How long a world that is told to stop waits for another one to take the room over."""

_SKIPPED = Counter("vistel_world_steps_skipped_total", "Steps left out because the process was late")
_UNSAFE = Gauge("vistel_world_unsaved_count", "Rooms whose disk cannot be written: what is published now would be lost in a crash")


@dataclass(frozen=True)
class Config:
    """seats: of the room; folder: what the world goes on from after a crash, None to keep nothing; extras: things
    that were put into the room; room: what the conference file says of it, where files hold some of it; place: where
    this world is; waits: it leads only when it is asked to, or nobody else does;
    hosts: who alone may put the room back, empty: everybody; lease: what decides who leads; lease_file: of a lease "file", None:
    shared with nobody; lease_tls: certificates for etcd elsewhere; crowd: as in `Conference`; keeps: `folder` is written, too."""

    seats: int
    folder: Path | None = None
    extras: tuple[Extra, ...] = ()
    room: RoomKeys | None = None
    place: str = HUB_PLACE
    waits: bool = False
    hosts: frozenset[str] = frozenset()
    lease: str = "file"
    lease_file: Path | None = None
    lease_tls: TlsFiles | None = None
    crowd: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    keeps: bool = True


@dataclass
class _LedRoom:
    """The room as this world leads it, or led it last; it is asked for by who comes late."""

    room: Room | None = None


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config:
    """The world of a conference. site: on whose machine it is, None at the hub."""
    room = conference.room
    place = site.name if site is not None else HUB_PLACE
    kept = conference.world.folder or paths.run / "room"
    folder = kept / place if site is not None else kept
    files, hosts = room if room.from_files else None, frozenset(conference.hosts)
    tls = tls_files(conference, place) if conference.world.lease_encrypted else None
    shared = paths.run if conference.bus.mode == "embedded" else kept
    lease = conference.world.lease, shared / "lease", tls
    return Config(room.seats, folder, extras_of(room), files, place, place != conference.world.on, hosts, *lease, conference.crowd)


def preload(conference: Conference) -> None:
    """Load what the first step needs, ahead of `run`."""
    warm_up()


def seed(config: Config, state: bytes) -> None:
    """Let the world of `config` begin with a state of a log. Raises OSError, or ValueError for what is none."""
    if config.folder is not None:
        store.seed(config.folder, World.restore(state))


def resume(config: Config, earlier: Path, now_ns: int) -> None:
    """Let the world of `config` begin as an earlier room was left. earlier: its folder, or a snapshot in it. Raises OSError,
    or ValueError, one line, where no room is."""
    if config.folder is not None:
        store.seed(config.folder, store.earlier(earlier).resumed(_begins(config)[0], now_ns))


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Take the room over from whoever leads it, or go on from the disk, or begin; step until cancelled."""
    began = time.perf_counter()
    await on_thread(clock, warm_up)
    begins, interior = await on_thread(clock, lambda: _begins(config))
    shelf, pictures = serve_assets(bus, interior), Pictures(bus)
    keeping = background.start(pictures.follow(), "pictures")
    warm = time.perf_counter()
    kept = Store(config.folder, _UNSAFE.inc) if config.folder else None
    lease = open_lease(config.lease, config.lease_file, bus.conference, config.place, clock, config.lease_tls)
    leadership = Leadership(lease, clock)
    subscriptions, led = RoomSubscriptions(bus, config.crowd), _LedRoom()

    def given() -> None:
        if kept is not None:
            kept.leave()
        if led.room is not None:
            led.room.answer_commands(led.room.unanswered)

    authority = Authority(bus, clock, leadership, config.place, given)
    bus.serve(BY_NAME["world_snapshot"], lambda request: led.room.answer(request) if led.room and authority.leads else None)
    bus.serve(BY_NAME["world_save"], lambda _: led.room.saved() if led.room and authority.leads else None)
    try:
        starts = not config.waits or not (await authority.led_last() or await authority.somebody(ALONE_S))
        if starts and config.waits:
            log.warning("nobody leads the room; not waiting any longer place=%s", config.place)
        log.info("world ready kernels_ms=%.0f", (warm - began) * 1e3)
        while True:
            start = await _follow(authority, subscriptions, kept, begins, clock, starts)
            await _lead(start, config.hosts, authority, subscriptions, kept if config.keeps else None, bus, clock, led)
            subscriptions.close()
            subscriptions, starts = RoomSubscriptions(bus, config.crowd), False
    finally:
        subscriptions.close()
        await leadership.close()
        keeping.cancel()
        pictures.close()
        shelf.close()


async def _follow(
    authority: Authority, subscriptions: RoomSubscriptions, kept: Store | None, begins: RoomShape, clock: Clock, starts: bool
) -> Start:
    """Wait, listening, until this world is to lead."""
    new = World(begins)

    def on_disk() -> Start:
        found = kept.load(begins, clock.now_ns()) if kept is not None else None
        if found is not None:
            return Start(found.world, found.term)
        return Start(new, kept.newest_term if kept is not None else -1)

    def received() -> World | None:
        try:
            return World.restore(subscriptions.newest_state) if subscriptions.newest_state else None
        except ValueError as e:
            log.error("state heard of is not used reason=%s", e)
            return None

    listening = background.start(subscriptions.listen(clock), "listen")
    try:
        states = RestartStates(on_disk, received)
        start = await authority.follow(states, begins, lambda people: subscriptions.follow_motion(people, clock), starts)
    finally:
        listening.cancel()
    if start.world is new and kept is not None:
        kept.set_aside(clock.now_ns())
    return start


async def _lead(
    start: Start,
    hosts: frozenset[str],
    authority: Authority,
    subscriptions: RoomSubscriptions,
    kept: Store | None,
    bus: Bus,
    clock: Clock,
    led: _LedRoom,
) -> None:
    """Step as long as this world leads. Cancelled, it gives the room to one that waits, or keeps it on disk."""
    room = Room(start.world, bus, subscriptions, kept, clock.now_ns(), hosts)
    authority.listen(lambda site, token, alive: subscriptions.collector.presence(site, token, alive, clock.now_ns()))
    led.room = room
    if kept is not None:
        kept.begin(room.world, start.term)
    saving: asyncio.Task[None] | None = None
    answering: asyncio.Task[None] | None = None
    due_ns = start.due_ns - STEP_NS if start.due_ns else clock.now_ns()
    leaving: asyncio.CancelledError | None = None
    try:
        await authority.lead(start)
        while True:
            if due_ns - clock.now_ns() > SET_BACK_NS:
                log.warning("clock set back by_s=%.1f", (due_ns - clock.now_ns()) * 1e-9)
                due_ns = clock.now_ns()
            due_ns = _next_due(due_ns, clock.now_ns())
            authority.next_step(due_ns)
            try:
                await (clock.sleep_until_ns(due_ns) if leaving is None else authority.until_over(clock.sleep_until_ns(due_ns)))
            except asyncio.CancelledError as e:
                if leaving is not None or not authority.followed:
                    raise
                leaving = e
                authority.leave(LEAVING_S)
                continue
            if leaving is not None and (authority.late or not authority.leads):
                raise leaving
            if not authority.leads:
                return
            room.step(due_ns)
            if room.unanswered and (answering is None or answering.done()):
                answering = background.start(_answer(room, kept, clock), "answers")
            if kept is not None and room.world.step_number % SAVE_STEPS == 0 and (saving is None or saving.done()):
                data = kept.rotate(room.world)
                if data is not None:
                    saving = background.start(on_thread(clock, partial(kept.save, data, room.world.step_number)), "save")
    finally:
        try:
            await asyncio.gather(*(task for task in (saving, answering) if task is not None), return_exceptions=True)
        finally:
            if kept is not None:
                if authority.leads:
                    kept.end(room.world)
                else:
                    kept.leave()
            await authority.retire()
        log.info("world stopped step=%d", room.world.step_number)


async def _answer(room: Room, kept: Store | None, clock: Clock) -> None:
    """Answer commands once the disk has the steps that did them. What is done meanwhile waits for the next time, together."""
    while count := room.unanswered:
        if kept is not None:
            await on_thread(clock, kept.sync)
        room.answer_commands(count)


def _begins(config: Config) -> tuple[RoomShape, Interior | None]:
    """The room as it begins, and what files hold of it."""
    interior = _from_files(config)
    return (meeting_room(config.seats, config.extras) if interior is None else interior.room), interior


def _from_files(config: Config) -> Interior | None:
    """The room as it begins, where files hold some of it. One that cannot be used is told, and the built-in room takes its
    place."""
    if config.room is None:
        return None
    from vistel.conference.rooms import RoomFileError, interior_of  # noqa: PLC0415  only for who has files

    try:
        interior = interior_of(config.room)
    except RoomFileError as e:
        log.error("room file not used reason=%r instead=built-in", str(e))
        return None
    for note in interior.notes:
        log.info("room file note=%r", note)
    return interior


def _next_due(due_ns: int, now_ns: int) -> int:
    """When the next step is about; steps that are too late to be worth computing are left out."""
    late = (now_ns - due_ns) // STEP_NS
    if late > CATCH_UP_STEPS:
        _SKIPPED.inc(late)
        if late > 60:
            log.warning("world late steps_left_out=%d", late)
        return due_ns + (late + 1) * STEP_NS
    return due_ns + STEP_NS


@cache
def warm_up() -> None:
    """Make the kernels (the first time this takes half a minute), so that no step waits for them."""
    motion.warm_up()
    soft = Extra("clay", "clay", "ball", 0.04, 1.0, 0.3, 0, 0.0, 0.0, PhysicsMaterial("plastic", sticky=0.02))
    room = replace(meeting_room(2, [soft]), joints=(Joint("rail", JointKind.SLIDER, "ball", "box"),))
    world, ball = World(room), room.thing("ball")
    people = (ParticipantBody("a"), ParticipantBody("b"))  # in one place, so that their hands meet
    for step in range(1, 4):
        motions = tuple(MotionInput(p.participant, standing(), step, step * STEP_NS) for p in people)
        led = PropInput("ball", ball.position, ball.rotation, step * STEP_NS, led_by="a")
        world.step(StepInputs(step, step * STEP_NS, people if step == 1 else (), motions, props=(led,) if step == 2 else ()))
    nearest_rotation(np.eye(3))  # for what several hold
