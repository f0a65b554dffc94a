"""What a room lives through: another world takes it over, worlds fail, freeze and leave."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from waiting import until
from world_site import START_NS, TICK_NS, WorldSite, ended, scenario

from vistel.space.inputs import StepInputs
from vistel.space.view import WorldView
from vistel.space.world import World
from vistel.v1.command_pb2 import Command, CommandResult, MoveThing
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.v1.world_pb2 import WorldHandoverRequest
from vistel.wire.clock import SimulatedClock
from vistel.wire.fence import HEARD_NS
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel.wire.world.presence import WAITS, WorldToken
from vistel_services import world
from vistel_services.world import rooms
from vistel_services.world.service import STEP_NS

SEATS = {"one": 3, "two": 4}
TAKE = WorldHandoverRequest.PHASE_TAKE


@asynccontextmanager
async def another_world(site: WorldSite, folder: Path) -> AsyncIterator[asyncio.Task[None]]:
    """A second world of the same conference, on another machine: with a disk of its own."""
    bus = site.network.bus("demo", "hub", site.clock)
    task = asyncio.create_task(world.run(replace(site.config, folder=folder), bus, site.clock))
    try:
        while not bus.fence.own:  # it listens until it can read everybody's motion
            await site.play(TICK_NS * 1e-9)
            await asyncio.sleep(0.002)  # its kernels are made on a thread
        yield task
    finally:
        await ended(task, site.clock)
        await bus.close()


def ask(site: WorldSite, number: int, thing: str = "tile") -> None:
    place = MoveThing(thing=thing, pose=Pose(position=Vec3(x=0.2, y=0.8, z=-0.2)))
    command = Command(id=f"c{number}", participant="aiko", move=place)
    command.header.t_ns = site.clock.now_ns()
    site.buses["aiko"].publish(BY_NAME["command"], participant="aiko").put(command)


def steps(site: WorldSite) -> list[tuple[int, int]]:
    """Step and term of all that was said."""
    return [(m.step, m.header.term) for topic, _, m, _ in site.log if topic == "world_inputs"]


def test_a_room_goes_to_another_world_without_a_step_missed_or_published_twice_and_no_command_lost(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.5)
        for n in range(5):
            ask(site, n)
            await site.play(TICK_NS * 1e-9)
        ask(site, 5)  # on its way while the room moves
        async with another_world(site, tmp_path / "elsewhere"):
            await site.play(TICK_NS * 1e-9)
            ask(site, 6)
            await site.play(0.5)

    site = scenario(tmp_path, play)
    said = steps(site)
    numbers = [step for step, _ in said]
    assert {term for _, term in said} == {0, 1}
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "a step is missing, or was taken twice"
    done = {r.id for r in site.results() if r.outcome == CommandResult.OUTCOME_DONE}
    assert done == {f"c{n}" for n in range(7)}


def test_a_room_that_moved_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    def states(folder: Path, move: bool) -> dict[int, bytes]:
        async def play(site: WorldSite) -> None:
            await site.play(1.5, from_s=2.4)
            if move:
                async with another_world(site, folder / "elsewhere"):
                    await site.play(2.0)
            else:
                await site.play(2.0)

        site = scenario(folder, play)
        told = [m for topic, _, m, _ in site.log if topic == "world_inputs"]
        return {m.step: m.private_state for m in told if m.step % 60 == 0}

    stayed, moved = states(tmp_path / "a", False), states(tmp_path / "b", True)
    assert len(stayed) >= 3 and all(stayed.values())
    assert stayed == moved


def test_who_takes_a_room_and_is_never_heard_of_loses_it_again(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        stranger = site.network.bus("demo", "hub", site.clock)
        stranger.announce(WorldToken(0, "5742a46e", WAITS, "osaka").text)
        request = WorldHandoverRequest(phase=TAKE, term=0, place="osaka")
        reply = await stranger.query(BY_NAME["world_handover"], request)
        assert reply is not None and reply.private_state and reply.due_ns - site.clock.now_ns() <= STEP_NS
        other = await stranger.query(BY_NAME["world_handover"], WorldHandoverRequest(phase=TAKE, term=1, place="osaka"))
        assert other is None, "nobody has steps of that term"
        count = len(steps(site))
        await site.clock.advance_to_ns(site.clock.now_ns() + TICK_NS)
        site.record()
        assert len(steps(site)) == count
        for _ in range(300):
            if site._bus is not None and site._bus.fence.own == 1:
                break
            await site.play(TICK_NS * 1e-9)
        await site.play(0.3)
        assert steps(site)[-1][1] == 1

    scenario(tmp_path, play)


def test_a_room_goes_back_to_who_waits_when_its_world_is_asked_to_stop(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        async with another_world(site, tmp_path / "elsewhere") as task:
            await site.play(0.3)
            ask(site, 1)
            await site.play(0.1)
            task.cancel()
            while not task.done():
                await site.play(TICK_NS * 1e-9)
        await site.play(0.3)

    site = scenario(tmp_path, play)
    said = steps(site)
    assert [t for i, (_, t) in enumerate(said) if i == 0 or said[i - 1][1] != t] == [0, 1, 2]
    assert len({step for step, _ in said}) == len(said)
    assert site.rooms()[-1].poses["tile"][0][0] == pytest.approx(0.2, abs=0.03)


def test_what_a_world_publishes_that_no_longer_leads_is_dropped(tmp_path: Path) -> None:
    async def play() -> None:
        clock = SimulatedClock(START_NS)
        network = MemoryNetwork()
        old, new, reader = (network.bus("demo", "hub", clock) for _ in range(3))
        heard = reader.subscribe(BY_NAME["world_inputs"])

        def say(bus: MemoryBus, term: int, step: int) -> None:
            bus.fence.own = term
            bus.publish(BY_NAME["world_inputs"]).put(BY_NAME["world_inputs"].message(step=step))

        say(old, 0, 1)
        say(new, 1, 2)
        say(old, 0, 3)
        say(new, 1, 4)
        assert [s.message.step for s in heard.take()] == [1, 2, 4]
        assert reader.counters.fenced == 1
        await clock.advance_to_ns(START_NS + HEARD_NS + 1)
        say(old, 0, 5)  # nobody of a higher term has spoken for so long
        assert [s.message.step for s in heard.take()] == [5]

    asyncio.run(play())


def test_an_error_in_one_room_stops_no_other_and_that_one_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play() -> None:
        clock = SimulatedClock(START_NS)
        network = MemoryNetwork()
        readers = {name: network.bus(name, "hub", clock).subscribe(BY_NAME["world_inputs"]) for name in ("one", "two")}

        def served(name: str) -> rooms.Served:
            async def door() -> MemoryBus:
                return network.bus(name, "hub", clock)

            return rooms.Served(name, world.Config(SEATS[name], tmp_path / name), clock, door)

        async def ticks(count: int) -> dict[str, list[int]]:
            for _ in range(count):
                await clock.advance_to_ns(clock.now_ns() + TICK_NS)
            return {name: [s.message.step for s in reader.take()] for name, reader in readers.items()}

        task = asyncio.create_task(rooms.serve([served("one"), served("two")]))
        await until(lambda: len(clock._sleepers) == 4)  # steps and leases
        before = await ticks(30)
        assert all(len(steps) >= 29 for steps in before.values())
        broken = {"yes": True}
        step = World.step

        def failing(self: World, inputs: StepInputs) -> WorldView:
            if broken["yes"] and self.source == "" and self.seats == 3:
                broken["yes"] = False
                raise ArithmeticError("a room that cannot go on")
            return step(self, inputs)

        monkeypatch.setattr(World, "step", failing)
        during = await ticks(30)
        assert len(during["two"]) == 30, "the other room stood still as well"
        await until(lambda: len(clock._sleepers) == 4)  # steps and leases
        after = await ticks(30)
        assert len(after["two"]) == 30 and len(after["one"]) >= 28
        assert after["one"][0] > before["one"][-1], "it began anew"
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(play())
