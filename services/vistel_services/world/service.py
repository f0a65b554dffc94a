"""The world as a service: sixty steps a second on the injected clock."""

from __future__ import annotations

import asyncio
import logging
import time
from dataclasses import dataclass
from pathlib import Path

from prometheus_client import Counter, Gauge, Histogram

from vistel.conference.model import Conference, Site
from vistel.conference.model import Room as RoomKeys
from vistel.conference.paths import RunPaths
from vistel.figure.posture import standing
from vistel.space.claims import ClaimEvent
from vistel.space.inputs import MotionInput, Person, StepInputs
from vistel.space.room import Extra, Room, meeting_room
from vistel.space.things import Matter
from vistel.space.view import HandForce, Outcome, WorldView
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldInputs, WorldSnapshot
from vistel.wire import motion
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel.wire.world import Backlog
from vistel_services.world import store
from vistel_services.world.decode import command_input, prop_input
from vistel_services.world.encode import (
    carries_state,
    command_result,
    hand_force,
    input_person,
    ownership,
)
from vistel_services.world.intake import Arrived, Intake
from vistel_services.world.tell import Teller

log = logging.getLogger("vistel.world")

STEP_NS = 16_666_667
CATCH_UP_STEPS = 6
"""A world that is late by no more than this steps faster; what is beyond is left out."""
SAVE_STEPS = 60

_STEPS = Counter("vistel_world_steps_total", "Steps done")
_SKIPPED = Counter("vistel_world_steps_skipped_total", "Steps left out because the process was late")
_STEP_TIME = Histogram(
    "vistel_world_step_time_seconds", "Computing one step",
    buckets=(0.0005, 0.001, 0.002, 0.003, 0.004, 0.006, 0.008, 0.012, 0.016, 0.03, 0.1),
)  # fmt: skip
_PEOPLE = Gauge("vistel_world_participants_count", "People in the room")
_COMMANDS = Counter("vistel_world_commands_total", "Commands answered", ["outcome"])


@dataclass(frozen=True)
class Config:
    """seats: of the room; snapshot: file that the world goes on from after a crash, None to keep none; extras: things
    that were put into the room; room: what the conference file says of it, where files hold some of it."""

    seats: int
    snapshot: Path | None = None
    extras: tuple[Extra, ...] = ()
    room: RoomKeys | None = None


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config:
    """The world of a conference; it belongs to no site."""
    room = conference.room
    return Config(room.seats, paths.run / "world.snapshot", room.extras(), room if room.from_files else None)


def preload(conference: Conference) -> None:
    """Load what the first step needs, ahead of `run`."""
    warm_up()


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Step until cancelled."""
    began = time.perf_counter()
    await asyncio.to_thread(warm_up)
    warm = time.perf_counter()
    now_ns = clock.now_ns()
    begins = await asyncio.to_thread(_begins, config)
    world = store.load(config.snapshot, begins, now_ns) if config.snapshot else None
    log.info("world ready kernels_ms=%.0f restore_ms=%.0f", (warm - began) * 1e3, (time.perf_counter() - warm) * 1e3)
    room = _Room(world or World(begins), bus, now_ns)
    topics = ("participant", "motion", "prop", "command")
    about, motion, prop, command = (bus.subscribe(BY_NAME[name], queue_all=True, polled=True) for name in topics)
    bus.watch_presence(lambda site, token, alive: room.intake.presence(site, token, alive, clock.now_ns()))
    bus.serve(BY_NAME["world_snapshot"], room.answer)
    bus.announce("world")
    saving: asyncio.Task[bool] | None = None
    due_ns = clock.now_ns()
    try:
        while True:
            due_ns = _next_due(due_ns, clock.now_ns())
            await clock.sleep_until_ns(due_ns)
            for sample in about.take():
                room.intake.participant(sample)
            for sample in motion.take():
                room.intake.motion(sample)
            for sample in prop.take():
                room.intake.prop(sample)
            for sample in command.take():
                room.intake.command(sample)
            room.step(due_ns)
            if config.snapshot and room.world.step_number % SAVE_STEPS == 0 and (saving is None or saving.done()):
                saving = asyncio.create_task(asyncio.to_thread(store.save, config.snapshot, room.world.snapshot()))
    finally:
        for subscription in (about, motion, prop, command):
            subscription.close()
        if config.snapshot:
            store.save(config.snapshot, room.world.snapshot())
        log.info("world stopped step=%d", room.world.step_number)


def _begins(config: Config) -> Room:
    """The room as it begins. A file that cannot be used is told, and the built-in room takes its place."""
    if config.room is not None:
        from vistel.conference.rooms import RoomFileError, interior_of  # noqa: PLC0415  only for who has files

        try:
            interior = interior_of(config.room)
        except RoomFileError as e:
            log.error("room file not used reason=%r instead=built-in", str(e))
        else:
            for note in interior.notes:
                log.info("room file note=%r", note)
            return interior.room
    return meeting_room(config.seats, config.extras)


def _next_due(due_ns: int, now_ns: int) -> int:
    """When the next step is about; steps that are too late to be worth computing are left out."""
    late = (now_ns - due_ns) // STEP_NS
    if late > CATCH_UP_STEPS:
        _SKIPPED.inc(late)
        if late > 60:
            log.warning("world late steps_left_out=%d", late)
        return due_ns + (late + 1) * STEP_NS
    return due_ns + STEP_NS


class _Room:
    """The world and its voice on the bus."""

    def __init__(self, world: World, bus: Bus, now_ns: int) -> None:
        self.world = world
        self.intake = Intake(world.participants, now_ns)
        self._bus = bus
        self._states, self._wholes = bus.publish(BY_NAME["world_state"]), bus.publish(BY_NAME["world_key"])
        self._teller, self._backlog = Teller(), Backlog()
        self._inputs = bus.publish(BY_NAME["world_inputs"])
        self._results: dict[str, Publication] = {}
        self._claims: dict[str, Publication] = {}
        self._forces: dict[tuple[str, bool], Publication] = {}
        self._begins = True
        self._last_ns = world.t_ns or now_ns
        self._held: dict[str, tuple[str, ...]] = {}

    def step(self, t_ns: int) -> None:
        """One step, about conference time `t_ns`."""
        started = time.perf_counter()
        passed = max(1, round((t_ns - self._last_ns) / STEP_NS))
        number = self.world.step_number + passed
        arrived = self.intake.take(t_ns)
        before = self.world.snapshot() if carries_state(number, self._begins) else b""
        inputs = StepInputs(
            number, t_ns, tuple(arrived.people), tuple(arrived.motions), tuple(arrived.left),
            tuple(command_input(who, message) for who, message in arrived.commands),
            tuple(prop_input(message) for message in arrived.props),
        )  # fmt: skip
        view = self.world.step(inputs)
        self._inputs.put(_inputs_message(inputs, arrived, before))
        self._say(view)
        for felt in view.hands:
            self._push_back(felt, view)
        for outcome in view.outcomes:
            self._answer(outcome, t_ns)
        for event in view.claims:
            self._tell_owner(event, view)
        self._tell_of_grasps(view)
        self._begins, self._last_ns = False, t_ns
        _STEPS.inc()
        _PEOPLE.set(len(view.participants))
        _STEP_TIME.observe(time.perf_counter() - started)

    def answer(self, request: bytes) -> WorldSnapshot:
        """The whole room, for who has just come."""
        out = self._backlog.snapshot()
        out.private_state = self.world.snapshot()
        out.header.t_ns = self._last_ns
        return out

    def _say(self, view: WorldView) -> None:
        told = self._teller.tell(view)
        if told.whole is not None:
            self._wholes.put(told.whole)
            self._backlog.key(told.whole)
        if told.state is not None:
            self._states.put(told.state)
            self._backlog.add(told.state)

    def _answer(self, outcome: Outcome, t_ns: int) -> None:
        _COMMANDS.labels("done" if outcome.done else "refused").inc()
        log.info(
            "command id=%s participant=%s outcome=%s reason=%r", outcome.id, outcome.participant,
            "done" if outcome.done else "refused", outcome.reason,
        )  # fmt: skip
        who = outcome.participant
        if who not in self._results:
            self._results[who] = self._bus.publish(BY_NAME["command_result"], participant=who)
        self._results[who].put(command_result(outcome, t_ns))

    def _tell_owner(self, event: ClaimEvent, view: WorldView) -> None:
        who = event.participant
        log.info("claim %s participant=%s thing=%s owner=%s", event.what.value, who, event.thing, event.owner or "nobody")
        if who not in self._claims:
            self._claims[who] = self._bus.publish(BY_NAME["ownership"], participant=who)
        self._claims[who].put(ownership(event, view.step, view.t_ns))

    def _push_back(self, felt: HandForce, view: WorldView) -> None:
        hand = felt.participant, felt.right
        if hand not in self._forces:
            side = "right" if felt.right else "left"
            self._forces[hand] = self._bus.publish(BY_NAME["hand_force"], participant=felt.participant, hand=side)
        self._forces[hand].put(hand_force(felt, view.step, view.t_ns))

    def _tell_of_grasps(self, view: WorldView) -> None:
        held = {s.id: s.holders for s in view.states if s.holders}
        for thing in sorted(held.keys() | self._held.keys()):
            if held.get(thing) != self._held.get(thing):
                log.info("thing=%s held_by=%s", thing, ",".join(held.get(thing, ())) or "nobody")
        self._held = held


def _inputs_message(inputs: StepInputs, arrived: Arrived, before: bytes) -> WorldInputs:
    out = WorldInputs(step=inputs.step, private_state=before)
    out.header.t_ns = inputs.t_ns
    for m in inputs.motions:
        out.motions.add(participant=m.participant, motion_seq=m.seq, epoch=m.t_ns)
    for name in inputs.left:
        out.motions.add(participant=name, left=True)
    out.people.extend(input_person(p) for p in inputs.people)
    out.props.extend(arrived.props)
    for who, message in arrived.commands:
        kept = out.commands.add()
        kept.CopyFrom(message)
        # The key says who asks; a message that says otherwise stays refused when it is re-run.
        if message.participant not in ("", who):
            kept.ClearField("action")
        kept.participant = who
        out.command_ids.append(message.id)
    return out


def warm_up() -> None:
    """Make the kernels (the first time this takes half a minute), so that no step waits for them."""
    motion.warm_up()
    soft = Extra("clay", "clay", "ball", 0.04, 1.0, 0.3, 0, 0.0, 0.0, Matter("plastic", sticky=0.02))
    world = World(meeting_room(2, [soft]))
    people = (Person("a"), Person("b"))  # in one place, so that their hands meet
    for step in range(1, 4):
        motions = tuple(MotionInput(p.participant, standing(), step, step * STEP_NS) for p in people)
        world.step(StepInputs(step, step * STEP_NS, people if step == 1 else (), motions))
