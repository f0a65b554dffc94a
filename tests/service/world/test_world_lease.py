"""Two worlds of one room, a real etcd, and links that are cut: nobody is ever told of the room by two leaders, and no command that
somebody was answered is lost or done twice.

Time is simulated. So that etcd's own time does not count, a link gives leases to etcd for a day and ends each itself, at the
simulated moment at which etcd would have.
"""

from __future__ import annotations

import asyncio
import logging
import random
from collections import defaultdict
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from aiohttp import web
from lease_stores import answers, etcd
from world_site import PEOPLE, TICK_NS, WorldSite, killed

from vistel.space.world import World
from vistel.v1.command_pb2 import Command, CommandResult, MoveThing
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.v1.world_pb2 import WorldMoveReply, WorldMoveRequest
from vistel.wire.lease.requests import Requests
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME, Topic
from vistel_services import world

LASTS_S = 5


class EtcdLink:
    """From one world to etcd. cut: "" none, "refused": at once, "silent": no answer ever, "deaf": what is asked is done, and the
    answer is lost."""

    def __init__(self, etcd_address: str, site: WorldSite) -> None:
        self._etcd, self._site = f"http://{etcd_address}", site
        self._ends_ns: dict[str, int] = {}
        self._session: Any = None
        self._runner: Any = None
        self.cut = ""
        self.address = ""

    async def open(self) -> EtcdLink:
        app = web.Application()
        app.add_routes([web.post("/{path:.*}", self._handle)])
        self._session, self._runner = aiohttp.ClientSession(), web.AppRunner(app, access_log=None, shutdown_timeout=0.1)
        await self._runner.setup()
        await web.TCPSite(self._runner, "127.0.0.1", 0).start()
        self.address = f"127.0.0.1:{self._runner.addresses[0][1]}"
        return self

    async def end_leases(self) -> None:
        """Those whose time has passed."""
        for lease, ends_ns in list(self._ends_ns.items()):
            if self._site.clock.now_ns() >= ends_ns:
                del self._ends_ns[lease]
                async with self._session.post(self._etcd + "/v3/lease/revoke", json={"ID": lease}) as answer:
                    assert answer.status in (200, 404)

    async def _handle(self, request: web.Request) -> web.Response:
        body, path = await request.json(), request.path
        if self.cut in ("refused", "silent"):
            await self._cut(request)
        if path == "/v3/lease/grant":
            assert body["TTL"] == str(LASTS_S)
            body["TTL"] = "86400"
        async with self._session.post(self._etcd + path, json=body) as answer:
            status, found = answer.status, await answer.json(content_type=None)
        if status == 200 and path in ("/v3/lease/grant", "/v3/lease/keepalive"):
            lease = found.get("ID") or body["ID"]
            if path == "/v3/lease/grant" or lease in self._ends_ns:
                self._ends_ns[lease] = self._site.clock.now_ns() + LASTS_S * 1_000_000_000
        if self.cut:
            await self._cut(request)
        return web.json_response(found, status=status)

    async def _cut(self, request: web.Request) -> None:
        if self.cut == "silent":
            await asyncio.Event().wait()
        assert request.transport is not None
        request.transport.close()
        raise ConnectionResetError

    async def close(self) -> None:
        await self._runner.cleanup()
        await self._session.close()


class BusLink(MemoryNetwork):
    """From one world to the network of all. What the world publishes is kept in `told`, cut off or not."""

    def __init__(self, network: MemoryNetwork, told: list[tuple[int, str, Any]], site: WorldSite, place: str) -> None:
        super().__init__()
        self._outside, self._told, self._site, self._place = network, told, site, place
        self.cut_off = False
        self.inside: MemoryBus = network.bus("demo", "hub", site.clock)
        self.inside._network = self
        self._deliver, self.inside.deliver = self.inside.deliver, self._received  # type: ignore[method-assign]

    def _received(self, topic: Topic, key: str, payload: bytes) -> None:
        if not self.cut_off:
            self._deliver(topic, key, payload)

    def send(self, topic: Topic, key: str, payload: bytes) -> None:
        if topic.name in ("world_inputs", "command_result"):
            self._told.append((self._site.clock.now_ns(), self._place, topic.message.FromString(payload)))
        if not self.cut_off:
            self._outside.send(topic, key, payload)

    def history(self, topic: Topic) -> list[tuple[str, bytes]]:
        return self._outside.history(topic)

    def answer(self, key: str, request: bytes) -> bytes | None:
        return None if self.cut_off else self._outside.answer(key, request)

    def serve(self, bus: MemoryBus, key: str, answer: Callable[[bytes], Any]) -> None:
        self._outside.serve(bus, key, lambda request: None if self.cut_off else answer(request))

    def announce(self, bus: MemoryBus, token: str) -> None:
        if not self.cut_off:
            self._outside.announce(bus, token)
        super().announce(bus, token)

    def present(self, conference: str) -> list[tuple[str, str]]:
        return self._outside.present(conference)

    def leave(self, bus: MemoryBus) -> None:
        self._outside.leave(bus)

    def cut(self, off: bool) -> None:
        """Cut the link, or join it again: then each side sees the other's presence anew."""
        if off == self.cut_off:
            return
        others = [name for name, owner in self._outside._tokens.items() if owner is not self.inside]
        for name in others:
            self.inside.presence_changed(*name, alive=not off)
        for _, _, token in self._tokens:
            if off:
                self._outside._tokens.pop(("demo", "hub", token), None)
                self._outside._tell("demo", "hub", token, alive=False)
            else:
                self._outside.announce(self.inside, token)
        self.cut_off = off


@dataclass
class TwoWorlds:
    """At the hub and at osaka, each with a disk of its own."""

    folder: Path
    site: WorldSite
    store: dict[str, EtcdLink]
    bus: dict[str, BusLink]
    tasks: dict[str, asyncio.Task[None]]
    told: list[tuple[int, str, Any]]
    sent: dict[str, Command]
    busy: list[EtcdLink]

    def start(self, place: str) -> None:
        """Start the world of a place."""
        self.bus[place] = BusLink(self.site.network, self.told, self.site, place)
        lease = f"etcd://{self.store[place].address}"
        config = replace(self.site.config, folder=self.folder / place, place=place, waits=place == "osaka", lease=lease)
        self.tasks[place] = asyncio.create_task(world.run(config, self.bus[place].inside, self.site.clock))

    async def kill(self, place: str) -> None:
        """End it at once."""
        await killed(self.tasks[place])
        await self.bus[place].inside.close()

    async def play(self, seconds: float) -> None:
        """Somebody asks for something three times a second, and again each second until they are answered."""
        for _ in range(round(seconds * 60)):
            tick = self.site._tick
            answered = {r.id for r in self.site.results()}
            if tick % 20 == 0:
                number = len(self.sent)
                place = Pose(position=Vec3(x=0.001 * number % 0.3, y=0.8, z=-0.2))
                self.sent[f"c{number}"] = Command(id=f"c{number}", participant="aiko", move=MoveThing(thing="tile", pose=place))
            for id_, command in self.sent.items():
                if id_ not in answered and (tick % 60 == 0 or (id_ == f"c{len(self.sent) - 1}" and tick % 20 == 0)):
                    command.header.t_ns = self.site.clock.now_ns()
                    self.site.buses["aiko"].publish(BY_NAME["command"], participant="aiko").put(command)
            await self.site.play(TICK_NS * 1e-9)
            for link in self.store.values():
                await link.end_leases()
            while self.busy:
                await asyncio.sleep(0.001)  # etcd answers in real time

    async def until(self, holds: Callable[[], object]) -> None:
        while not holds():
            await self.play(TICK_NS * 1e-9)
            await asyncio.sleep(0.001)  # disks and kernels are on threads

    def leader(self) -> str:
        """Who told of a step within the last tenth of a second."""
        recent = [place for t, place, m in self.told[-20:] if hasattr(m, "step") and self.site.clock.now_ns() - t < 100_000_000]
        return recent[-1] if recent else ""


@asynccontextmanager
async def two_worlds(folder: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[TwoWorlds]:
    busy: list[EtcdLink] = []
    by_address: dict[str, EtcdLink] = {}
    ask = Requests.ask

    async def counted(self: Requests, *args: Any, **named: Any) -> Any:
        link = by_address[self._addresses[0]]
        if link.cut == "silent":
            return await ask(self, *args, **named)
        busy.append(link)
        try:
            return await ask(self, *args, **named)
        finally:
            busy.remove(link)

    monkeypatch.setattr(Requests, "ask", counted)
    monkeypatch.setattr(WorldSite, "start", _nothing)
    site = WorldSite(folder)
    site.away = {who for _, who in PEOPLE[1:]}
    with etcd(folder) as address:
        await answers(address)
        async with site.open():
            links = {place: await EtcdLink(address, site).open() for place in ("hub", "osaka")}
            by_address |= {f"http://{link.address}": link for link in links.values()}
            room = TwoWorlds(folder, site, links, {}, {}, [], {}, busy)
            for place in links:
                room.start(place)
                await room.until(lambda: room.leader() == "hub")
            try:
                yield room
            finally:
                for link in links.values():
                    link.cut = ""
                for task in room.tasks.values():
                    await killed(task)
                for link in links.values():
                    await link.close()


async def _nothing(_site: WorldSite) -> None:
    pass


def check(room: TwoWorlds, final: World) -> None:
    """One leader at a time, steps that only grow, and each answered command done once."""
    spans: dict[int, tuple[str, int, int]] = {}
    last_step = last_term = -1
    for t_ns, place, m in room.told:
        if not hasattr(m, "step") or isinstance(m, CommandResult):
            continue
        term = m.header.term
        where, first_ns, _ = spans.get(term, (place, t_ns, t_ns))
        assert where == place, f"{where} and {place} both led under term {term}"
        assert term >= last_term, f"{place} told of a step under term {term} after term {last_term} had begun"
        assert m.step > last_step, f"step {m.step} of term {term} was told of after step {last_step}"
        spans[term], last_term, last_step = (place, first_ns, t_ns), term, m.step
    told = sorted(spans.values(), key=lambda s: s[1])
    assert all(a[2] < b[1] for a, b in pairwise(told)), f"two led at one time: {told}"
    done: dict[str, set[int]] = defaultdict(set)
    for r in room.site.results():
        if r.outcome == CommandResult.OUTCOME_DONE:
            done[r.id].add(r.step)
    assert done and all(len(steps) == 1 for steps in done.values()), "a command was done twice"
    remembered = {a.id for a in final._state.ledger.answers if a.done}
    newest = sorted(done, key=lambda id_: int(id_[1:]))[-40:]
    assert set(newest) <= remembered, "a command that was answered is lost"


def played(folder: Path, monkeypatch: pytest.MonkeyPatch, play: Callable[[TwoWorlds], Awaitable[None]]) -> TwoWorlds:
    async def whole() -> TwoWorlds:
        async with two_worlds(folder, monkeypatch) as room:
            await play(room)
            for link in room.store.values():
                link.cut = ""
            for bus in room.bus.values():
                bus.cut(False)
            await room.until(room.leader)
            await room.play(2.5)
            snapshot = await room.site.asking.query(BY_NAME["world_save"])  # type: ignore[union-attr]
            assert snapshot is not None
            check(room, World.restore(snapshot.private_state))
        return room

    return asyncio.run(whole())


@pytest.mark.parametrize("how", ["refused", "silent"])
def test_a_room_whose_lease_store_is_gone_goes_on_until_the_lease_ends_and_nobody_leads_until_it_is_back(
    how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def play(room: TwoWorlds) -> None:
        await room.play(1.0)
        for link in room.store.values():
            link.cut = how
        await room.play(2.5)
        assert room.leader() == "hub"
        assert "this world goes on leading until its lease ends" in caplog.text
        await room.play(5.0)
        assert room.leader() == "" and "this world stops leading" in caplog.text
        count = len(room.told)
        await room.play(3.0)
        assert len(room.told) == count, "a second one leads"
        for link in room.store.values():
            link.cut = ""
        await room.until(room.leader)
        assert room.leader() == "hub", "its newest steps are there"

    with caplog.at_level(logging.INFO):
        played(tmp_path, monkeypatch, play)


def test_a_leader_that_is_cut_off_from_the_store_gives_its_steps_to_one_that_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: TwoWorlds) -> None:
        await room.play(1.0)
        room.store["hub"].cut = "refused"
        await room.until(lambda: room.leader() == "osaka")
        await room.play(1.0)
        room.store["hub"].cut = ""
        await room.play(2.0)
        assert room.leader() == "osaka"

    played(tmp_path, monkeypatch, play)


def test_a_room_moves_under_a_lease_in_etcd_and_nothing_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(room: TwoWorlds) -> None:
        for to in ("osaka", "hub"):
            await room.play(0.5)
            reply = await room.site.asking.query(BY_NAME["world_move"], WorldMoveRequest(place=to))  # type: ignore[union-attr]
            assert reply is not None and reply.outcome == WorldMoveReply.OUTCOME_MOVING
            await room.until(lambda to=to: room.leader() == to)

    room = played(tmp_path, monkeypatch, play)
    steps = [m.step for _, _, m in room.told if not isinstance(m, CommandResult)]
    assert max(b - a for a, b in pairwise(steps)) < 30


def test_a_world_that_led_last_and_is_started_again_to_wait_leads_again_as_soon_as_its_lease_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: TwoWorlds) -> None:
        await room.play(0.5)
        await room.site.asking.query(BY_NAME["world_move"], WorldMoveRequest(place="osaka"))  # type: ignore[union-attr]
        await room.until(lambda: room.leader() == "osaka")
        await room.play(1.0)
        await room.kill("osaka")
        room.start("osaka")
        began_ns = room.site.clock.now_ns()
        await room.until(lambda: room.leader() == "osaka")
        assert room.site.clock.now_ns() - began_ns < (LASTS_S + 5) * 1e9

    played(tmp_path, monkeypatch, play)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_through_any_cuts_no_two_worlds_lead_and_no_answered_command_is_lost_or_done_twice(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: TwoWorlds) -> None:
        chance = random.Random(seed)
        for _ in range(5):
            for place in ("hub", "osaka"):
                room.store[place].cut = chance.choice(["", "", "refused", "silent", "deaf"])
                room.bus[place].cut(chance.random() < 0.3)
            if chance.random() < 0.5:
                await room.site.asking.query(  # type: ignore[union-attr]
                    BY_NAME["world_move"], WorldMoveRequest(place=chance.choice(["hub", "osaka"]))
                )
            await room.play(chance.uniform(0.5, 7.0))

    played(tmp_path, monkeypatch, play)
