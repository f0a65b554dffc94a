"""Faults are struck on real processes, a real router and real links, and mended when their time is over."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from waiting import until

from vistel.v1.service_pb2 import FaultReply, FaultRequest
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.world.presence import LEADS, WAITS, WorldToken
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_cli.faults.effects import Struck
from vistel_cli.faults.links import endpoint_of, simulated_links
from vistel_cli.faults.striker import Striker
from vistel_services.process.supervisor import ProcessSpec, Supervisor

WRITES = """
import sys, time
print("up", flush=True)
while True:
    try:
        with open(sys.argv[1], "w") as f:
            f.write("x" * 100)
    except OSError as e:
        open(sys.argv[1] + ".refused", "w").close()
    time.sleep(0.01)
"""
NODES = ("hub/world", "hub/world-tokyo", "tokyo/renderer")


@dataclass
class Scene:
    """A conference of processes that do nothing but write, asked by `host`."""

    struck: Struck
    striker: Striker
    host: ZenohBus
    told: list[str]
    folder: Path

    def pid(self, node: str) -> int:
        pid = self.struck.supervisor.children[node].pid
        assert pid is not None
        return pid

    async def ask(self, name: str, target: str = "", seconds: float | None = None, amount: float | None = None) -> FaultReply:
        """Asked once more only where nobody was there to be asked: what is answered late is struck all the same."""
        request = FaultRequest(name=name, target=target, seconds=seconds, amount=amount)
        while (reply := await self.host.query(BY_NAME["fault"], request, 60.0)) is None:
            pass
        return reply

    def over(self) -> bool:
        return not self.striker.active


def scene(folder: Path, play: Callable[[Scene], Awaitable[None]]) -> None:
    """Run `play`, with simulated links of tokyo and paris."""

    @asynccontextmanager
    async def opened() -> AsyncIterator[Scene]:
        router, clock, told = Router.open(), SystemClock(), list[str]()
        specs = [ProcessSpec(n, (sys.executable, "-c", WRITES, str(folder / n.replace("/", "-")))) for n in NODES]
        supervisor = Supervisor(specs, folder / "logs")
        async with background.service("supervisor"), simulated_links(router.endpoint, ["tokyo", "paris"], 1) as links:
            await supervisor.start()
            buses = [await ZenohBus.open(conference="demo", site="hub", clock=clock, endpoints=[router.endpoint]) for _ in range(2)]
            struck = Struck(supervisor, router, links, clock, folder, told.append)
            striker = Striker(struck, buses[0])
            try:
                yield Scene(struck, striker, buses[1], told, folder)
            finally:
                await striker.mend()
                await supervisor.stop()
                for bus in buses:
                    await bus.close()
                assert struck.router is not None
                struck.router.close()

    async def run() -> None:
        async with opened() as s:
            await play(s)

    asyncio.run(run())


def test_processes_are_killed_and_made_to_hang(tmp_path: Path) -> None:
    async def play(s: Scene) -> None:
        first = s.pid("tokyo/renderer")
        assert (await s.ask("kill", "tokyo/renderer")).struck == "kill tokyo/renderer"
        await until(lambda: s.struck.supervisor.children["tokyo/renderer"].pid not in (None, first))
        assert s.told == ["fault: kill tokyo/renderer"]
        assert (await s.ask("hang", "hub/world", 600.0)).struck == "hang hub/world for 600 s"
        world = psutil.Process(s.pid("hub/world"))
        await until(lambda: world.status() == psutil.STATUS_STOPPED)
        assert "hang hub/world: goes on already" in (await s.ask("hang", "hub/world")).refused
        await s.striker.mend()
        await until(lambda: world.status() != psutil.STATUS_STOPPED)

    scene(tmp_path, play)


def test_the_world_that_leads_is_found_and_fails(tmp_path: Path) -> None:
    async def play(s: Scene) -> None:
        assert (await s.ask("world-failure")).refused == "world-failure: no world of this machine leads now"
        s.host.announce(WorldToken(1, "0000000a", WAITS, "hub").text)
        s.host.announce(WorldToken(2, "0000000b", LEADS, "tokyo").text)
        before = s.pid("hub/world-tokyo")
        while not (reply := await s.ask("world-failure")).struck:
            pass
        assert reply.struck == "world-failure hub/world-tokyo"
        await until(lambda: s.struck.supervisor.children["hub/world-tokyo"].pid not in (None, before))

    scene(tmp_path, play)


@pytest.mark.skipif(sys.platform != "linux", reason="the limit of another process is set as Linux does")
def test_a_process_without_disk_is_refused_its_writes_and_gets_the_disk_back(tmp_path: Path) -> None:
    async def play(s: Scene) -> None:
        written, refused = tmp_path / "hub-world", tmp_path / "hub-world.refused"
        await until(written.exists)
        await s.ask("disk-full", "hub/world", 600.0)
        await until(refused.exists)
        await s.striker.mend()
        await until(lambda: written.stat().st_size == 100)

    scene(tmp_path, play)


def test_the_router_closes_and_opens_again_and_the_host_is_answered_afterwards(tmp_path: Path) -> None:
    async def play(s: Scene) -> None:
        assert (await s.ask("router-failure", seconds=0.2)).struck == "router-failure for 0.2 s"
        await until(s.over)
        assert s.told == ["fault: router-failure for 0.2 s", "over: router-failure"]
        assert (await s.ask("signal-reconnect", "paris")).struck == "signal-reconnect paris"

    scene(tmp_path, play)


def test_links_are_cut_thinned_and_closed_and_come_back(tmp_path: Path) -> None:
    async def play(s: Scene) -> None:
        link = s.struck.links["tokyo"]
        site = await ZenohBus.open(conference="demo", site="tokyo", clock=SystemClock(), endpoints=[endpoint_of(link)])
        await s.ask("link-cut", "tokyo", 600.0)
        await until(lambda: link.up.is_cut and link.down.is_cut)
        await s.ask("bandwidth", "paris", 600.0, 64.0)
        await until(lambda: s.struck.links["paris"].up.conditions.bits_per_s == 64_000.0)
        await s.striker.mend()
        assert not link.up.is_cut and s.struck.links["paris"].up.conditions.bits_per_s == float("inf")
        await s.ask("signal-reconnect", "tokyo")
        s.host.serve(BY_NAME["clock"], lambda _: BY_NAME["clock"].message())
        while await site.query(BY_NAME["clock"]) is None:  # until it has connected again
            pass
        await site.close()

    scene(tmp_path, play)


def test_the_clock_of_all_is_set_and_set_back_and_the_disk_kept_busy(tmp_path: Path) -> None:
    async def play(s: Scene) -> None:
        before = s.struck.clock.machine_off_ns
        await s.ask("clock-step", seconds=600.0, amount=-2.0)
        await until(lambda: s.struck.clock.machine_off_ns - before > 1_900_000_000)
        await s.ask("slow-disk", seconds=600.0)
        await s.striker.mend()
        assert abs(s.struck.clock.machine_off_ns - before) < 100_000_000

    scene(tmp_path, play)


@pytest.mark.parametrize(
    ("asked", "refused"),
    [
        (FaultRequest(name="meteor"), "no fault is called 'meteor'; there are kill, hang,"),
        (FaultRequest(name="kill"), "kill: expected a process; there are hub/world,"),
        (FaultRequest(name="kill", target="lima/renderer"), "kill: expected a process, got 'lima/renderer'; there are"),
        (FaultRequest(name="link-cut", target="lima"), "link-cut: expected a site, got 'lima'; there are tokyo, paris"),
        (FaultRequest(name="slow-disk", target="tokyo"), "slow-disk: expected no target, got 'tokyo'"),
        (FaultRequest(name="kill", target="hub/world", seconds=3.0), "kill: happens in a moment, and lasts no 3 s"),
        (FaultRequest(name="hang", target="hub/world", seconds=-1.0), "hang: expected 0 to 3600 seconds, got -1"),
        (FaultRequest(name="hang", target="hub/world", seconds=float("nan")), "hang: expected 0 to 3600 seconds, got nan"),
        (FaultRequest(name="hang", target="hub/world", amount=1.0), "hang: has no amount"),
        (FaultRequest(name="bandwidth", target="tokyo", amount=0.0), "bandwidth: expected an amount in kbit/s, got 0"),
        (FaultRequest(name="clock-step", amount=float("inf")), "clock-step: expected an amount in s, got inf"),
    ],
)
def test_what_cannot_be_struck_is_refused_in_one_line(tmp_path: Path, asked: FaultRequest, refused: str) -> None:
    async def play(s: Scene) -> None:
        assert s.striker.answer(asked.SerializeToString()).refused.startswith(refused)
        assert s.striker.answer(b"\xff").refused == "no request for a fault"
        assert s.told == []

    scene(tmp_path, play)
