"""A room is moved between worlds at different places, each with a disk of its own: by request, under load, through crashes."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import until
from world_site import CONFERENCE, PEOPLE, TICK_NS, WorldSite, ended, killed, scenario

from vistel.space.world import World
from vistel.v1.command_pb2 import Command, CommandResult, MoveThing
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.v1.world_pb2 import WorldMoveReply, WorldMoveRequest
from vistel.wire.bus import Bus
from vistel.wire.clock import SystemClock
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.world.presence import WorldAt, WorldToken, world_token, worlds_of
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_services import world
from vistel_sim.motion.meeting import Meeting
from vistel_sim.motion.source import simulated_people


@dataclass
class Place:
    """A world elsewhere. kill: as SIGKILL would."""

    task: asyncio.Task[None]
    bus: Any
    folder: Path
    dead: bool = field(default=False)

    async def kill(self) -> None:
        kept = {p.name: p.read_bytes() for p in self.folder.iterdir()} if self.folder.exists() else {}
        await self.bus.close()
        await killed(self.task)
        await self.bus.close()  # takes back what it has said since
        for path in self.folder.iterdir() if self.folder.exists() else ():
            path.unlink()
        for name, data in kept.items():
            (self.folder / name).write_bytes(data)
        self.dead = True


@asynccontextmanager
async def place(site: WorldSite, name: str, folder: Path, waits: bool = True) -> AsyncIterator[Place]:
    bus = site.network.bus("demo", "hub", site.clock)
    config = replace(site.config, folder=folder, place=name, waits=waits)
    there = Place(asyncio.create_task(world.run(config, bus, site.clock)), bus, folder)
    try:
        yield there
    finally:
        if not there.dead:
            await there.kill()


async def plays_until(site: WorldSite, true: Any) -> None:
    while not true():
        await site.play(TICK_NS * 1e-9)
        await asyncio.sleep(0.002)  # the worlds' disks and kernels are on threads


async def asked_to(site: WorldSite, where: str, force: bool = False) -> WorldMoveReply:
    while True:
        reply = await site.asking.query(BY_NAME["world_move"], WorldMoveRequest(place=where, force=force))  # type: ignore[union-attr]
        if reply is not None:
            return reply
        await site.play(TICK_NS * 1e-9)
        await asyncio.sleep(0.01)  # the worlds' disks and kernels are on threads


def ask(site: WorldSite, number: int) -> None:
    move = MoveThing(thing="tile", pose=Pose(position=Vec3(x=0.2, y=0.8, z=-0.2)))
    command = Command(id=f"c{number}", participant="aiko", move=move)
    command.header.t_ns = site.clock.now_ns()
    site.buses["aiko"].publish(BY_NAME["command"], participant="aiko").put(command)


def said(site: WorldSite) -> list[tuple[int, int]]:
    """Step and term of all that was said."""
    return [(m.step, m.header.term) for topic, _, m, _ in site.log if topic == "world_inputs"]


def term(site: WorldSite) -> int:
    return said(site)[-1][1]


def done(site: WorldSite) -> set[str]:
    return {r.id for r in site.results() if r.outcome == CommandResult.OUTCOME_DONE}


def remembered(state: bytes) -> set[str]:
    return {a.id for a in World.restore(state)._state.ledger.answers if a.done}


def test_a_world_that_waits_leads_when_asked_to_and_gives_the_room_back_when_that_is_asked(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        async with place(site, "osaka", tmp_path / "osaka"):
            nowhere = await site.asking.query(BY_NAME["world_move"], WorldMoveRequest(place="lima"))  # type: ignore[union-attr]
            assert nowhere is None
            reply = await asked_to(site, "osaka")
            assert reply.outcome == WorldMoveReply.OUTCOME_MOVING
            ask(site, 1)
            await plays_until(site, lambda: term(site) == 1)
            assert (await asked_to(site, "osaka")).outcome == WorldMoveReply.OUTCOME_LEADS
            ask(site, 2)
            assert (await asked_to(site, "hub")).outcome == WorldMoveReply.OUTCOME_MOVING
            await plays_until(site, lambda: term(site) == 2)
            await site.play(0.2)
            assert done(site) == {"c1", "c2"}

    site = scenario(tmp_path, play)
    numbers = [step for step, _ in said(site)]
    assert numbers == sorted(set(numbers))


def test_a_world_that_waits_does_not_go_on_from_old_steps_and_nothing_published_is_lost_when_the_newest_come_back(
    tmp_path: Path,
) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        async with place(site, "osaka", tmp_path / "osaka") as osaka:
            await asked_to(site, "osaka")
            await plays_until(site, lambda: term(site) == 1)
            ask(site, 1)
            await plays_until(site, lambda: "c1" in done(site))
            await osaka.kill()
        count = len(said(site))
        await site.play(0.5)
        await asyncio.sleep(0.05)  # nothing is to come, not from threads either
        assert len(said(site)) == count, "steps that osaka had told of were taken again, otherwise"
        refused = await asked_to(site, "hub")
        assert refused.outcome == WorldMoveReply.OUTCOME_BEHIND and "osaka" in refused.reason
        async with place(site, "osaka", tmp_path / "osaka", waits=False):
            await plays_until(site, lambda: len(said(site)) > count + 10)
            assert (await asked_to(site, "osaka")).outcome == WorldMoveReply.OUTCOME_LEADS
            snapshot = await site.asking.query(BY_NAME["world_save"])  # type: ignore[union-attr]
            assert snapshot is not None
            assert "c1" in remembered(snapshot.private_state)

    scenario(tmp_path, play)


def test_by_force_a_room_goes_on_from_the_newest_state_that_was_heard_here(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        async with place(site, "osaka", tmp_path / "osaka") as osaka:
            await asked_to(site, "osaka")
            await plays_until(site, lambda: term(site) == 1)
            ask(site, 1)
            await plays_until(site, lambda: "c1" in done(site))
            first = said(site)[-1][0]
            await site.play(1.2)  # a world that waits listens once a second
            await osaka.kill()
        assert (await asked_to(site, "hub", force=True)).outcome == WorldMoveReply.OUTCOME_MOVING
        await plays_until(site, lambda: term(site) == 2)
        snapshot = await site.asking.query(BY_NAME["world_save"])  # type: ignore[union-attr]
        assert snapshot is not None
        assert World.restore(snapshot.private_state).step_number > first
        assert "c1" in remembered(snapshot.private_state)

    scenario(tmp_path, play)


def test_who_gave_the_room_away_and_starts_again_alone_remembers_that_it_is_elsewhere(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        async with place(site, "osaka", tmp_path / "osaka") as osaka:
            await asked_to(site, "osaka")
            await plays_until(site, lambda: term(site) == 1)
            await site.kill()
            await site.play(0.2)
            await osaka.kill()
        count = len(said(site))
        bus = site.network.bus("demo", "hub", site.clock)
        task = asyncio.create_task(world.run(site.config, bus, site.clock))
        assert (await asked_to(site, "hub")).outcome == WorldMoveReply.OUTCOME_BEHIND
        assert len(said(site)) == count
        async with place(site, "osaka", tmp_path / "osaka", waits=False):
            await plays_until(site, lambda: term(site) >= 1 and len(said(site)) > count + 5)
        await bus.close()
        await ended(task, site.clock)

    scenario(tmp_path, play)


def test_who_leads_is_seen_from_presence() -> None:
    a, b, c = "0" * 8, "1" * 8, "2" * 8
    said = (0, a, "leads", "hub"), (0, b, "waits", "osaka"), (1, b, "leads", "osaka")
    tokens = [WorldToken(*words).text for words in said]
    assert worlds_of([*tokens, "process-world", "world-x"]) == [WorldAt("osaka", b, 1, True), WorldAt("hub", a, 0, False)]
    assert worlds_of([*tokens, WorldToken(0, c, "waits", "lima").text])[-1].place == "lima"
    assert world_token("world-1-00000000-leads-a/b") is None


# -- in processes of their own, over the real bus --------------------------------------------------------------


@pytest.fixture
def worlds() -> Iterator[tuple[str, Any]]:
    """The endpoint of a router, and how to start a world: place, folder, waits -> its process."""
    router = Router.open()
    program = [sys.executable, str(Path(__file__).with_name("world_place.py")), router.endpoint]
    path = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=path)
    assert parent.stdin is not None and parent.stdout is not None
    assert parent.stdout.readline() == "ready\n"
    pids: list[int] = []

    def start(name: str, folder: Path, waits: bool) -> int:
        assert parent.stdin is not None and parent.stdout is not None
        parent.stdin.write(f"{name} {folder} {'waits' if waits else 'leads'}\n")
        parent.stdin.flush()
        pids.append(int(parent.stdout.readline().split()[1]))
        return pids[-1]

    try:
        yield router.endpoint, start
    finally:
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        parent.kill()
        parent.communicate()
        router.close()


class People:
    """Three who sit there and ask for something all the time; what they were told."""

    def __init__(self, buses: dict[str, Bus], clock: SystemClock, watching: Bus) -> None:
        self._buses, self._clock = buses, clock
        self._meeting = Meeting(list(simulated_people(CONFERENCE).values()), 3, 1)
        self._encoders = {who: MotionEncoder() for _, who in PEOPLE}
        self._results = watching.subscribe(BY_NAME["command_result"], polled=True)
        self.worlds = watching
        self._tokens: set[str] = set()
        watching.watch_presence(self._seen)
        self.asked = 0
        self.told: dict[str, bool] = {}

    def leader(self) -> str:
        found = worlds_of(self._tokens)
        return found[0].place if found and found[0].leads else ""

    async def live(self) -> None:
        """Until cancelled."""
        for number in range(1_000_000):
            for who, bus in self._buses.items():
                p = self._meeting.posture(who, number / 60)
                out = bus.publish(BY_NAME["motion"], participant=who)
                stance = np.array([*p.stance.position, p.stance.heading])
                sample = MotionSample(out.next_seq, self._clock.now_ns(), p.dofs, p.hands, stance, p.gaze)
                out.put(self._encoders[who].encode(sample))
                if number % 6 == 0:
                    self.asked += 1
                    place_ = Pose(position=Vec3(x=0.001 * self.asked % 0.3, y=0.8, z=-0.2))
                    command = Command(id=f"c{self.asked}", participant=who, move=MoveThing(thing="tile", pose=place_))
                    command.header.t_ns = self._clock.now_ns()
                    bus.publish(BY_NAME["command"], participant=who).put(command)
            self.told |= {s.message.id: s.message.outcome == CommandResult.OUTCOME_DONE for s in self._results.take()}
            await asyncio.sleep(0.03)  # as trackers do: the worlds are processes, in real time

    def _seen(self, site: str, token: str, alive: bool) -> None:
        if site == "hub":
            (self._tokens.add if alive else self._tokens.discard)(token)


def test_under_load_a_room_moves_between_processes_with_disks_of_their_own_and_nothing_anybody_received_is_lost(
    worlds: tuple[str, Any], tmp_path: Path
) -> None:
    endpoint, start = worlds

    async def play() -> None:
        clock = SystemClock()

        async def door(site: str) -> ZenohBus:
            return await ZenohBus.open(conference="demo", site=site, clock=clock, endpoints=[endpoint])

        buses: dict[str, Bus] = {who: await door(site) for site, who in PEOPLE}
        for (site, who), bus in zip(PEOPLE, buses.values(), strict=True):
            bus.announce("process-capture")
            about = BY_NAME["participant"].message(participant=who, site=site, display_name=who)
            bus.publish(BY_NAME["participant"], participant=who).put(about)
        people = People(buses, clock, await door("tokyo"))
        life = asyncio.create_task(people.live())

        async def move(to: str) -> None:
            reply = None
            while reply is None:  # a world that has just begun to wait may not have looked at what is led elsewhere
                reply = await people.worlds.query(BY_NAME["world_move"], WorldMoveRequest(place=to), timeout_s=60.0)
            assert reply.outcome == WorldMoveReply.OUTCOME_MOVING
            await until(lambda: people.leader() == to)

        async def nothing_is_lost() -> None:
            told = dict(list(people.told.items())[-60:])
            newest = people.asked  # what was asked while nobody led is not answered
            await until(lambda: any(int(command[1:]) > newest for command in people.told))
            snapshot = await people.worlds.query(BY_NAME["world_save"], timeout_s=60.0)
            assert snapshot is not None
            answers = {a.id: a.done for a in World.restore(snapshot.private_state)._state.ledger.answers}
            assert told.items() <= answers.items()

        async def some_more(count: int = 20) -> None:
            enough = len(people.told) + count
            await until(lambda: len(people.told) >= enough)

        start("osaka", tmp_path / "osaka", False)
        await until(lambda: people.leader() == "osaka")
        await some_more()
        kobe = start("kobe", tmp_path / "kobe", True)
        await until(lambda: len(worlds_of(people._tokens)) == 2)
        for to in ("kobe", "osaka", "kobe"):
            await some_more()
            await move(to)
            await some_more()
            await nothing_is_lost()
        os.kill(kobe, signal.SIGKILL)
        before = dict(list(people.told.items())[-60:])
        await until(lambda: people.leader() != "kobe")
        reply = None
        while reply is None or reply.outcome == WorldMoveReply.OUTCOME_MOVING:  # osaka may not yet have seen that kobe is gone
            reply = await people.worlds.query(BY_NAME["world_move"], WorldMoveRequest(place="osaka"))
        assert reply.outcome == WorldMoveReply.OUTCOME_BEHIND
        start("kobe", tmp_path / "kobe", True)  # by its supervisor; it has the newest steps, and nobody leads
        await until(lambda: people.leader() == "kobe")
        await some_more()
        snapshot = await people.worlds.query(BY_NAME["world_save"], timeout_s=60.0)
        assert snapshot is not None
        answers = {a.id: a.done for a in World.restore(snapshot.private_state)._state.ledger.answers}
        assert before.items() <= answers.items()
        life.cancel()
        await asyncio.gather(life, return_exceptions=True)
        for bus in (*buses.values(), people.worlds):
            await bus.close()

    asyncio.run(play())
