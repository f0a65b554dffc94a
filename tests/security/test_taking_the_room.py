"""Somebody takes the room from its world, or what is private of it. What it needs: any certificate that may listen."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from secured_bus import Secured, secured

from vistel.persistence.store import Store
from vistel.space.room import meeting_room
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldHandoverRequest, WorldInputs, WorldMoveRequest, WorldSnapshot
from vistel.wire.clock import SimulatedClock, SystemClock
from vistel.wire.lease.file import FileLease
from vistel.wire.lease.lease import Holder
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME, TOPICS, Audience, Delivery
from vistel.wire.world.presence import LEADS, MOST_TERM, WAITS, WorldToken
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import ZenohBus
from vistel_services import world
from vistel_services.world import Config
from vistel_services.world.authority import Authority, Start
from vistel_services.world.leadership import Leadership

PREPARE, TAKE = WorldHandoverRequest.PHASE_PREPARE, WorldHandoverRequest.PHASE_TAKE
PRIVATE = {"world_save": None, "world_handover": WorldHandoverRequest(phase=PREPARE), "world_move": WorldMoveRequest(place="hub")}


async def leading(bus: ZenohBus | MemoryBus, clock: Any) -> Authority:
    """A world of the room that leads."""
    leadership = Leadership(FileLease(None, "hub"), clock)
    authority = Authority(bus, clock, leadership)
    await authority.lead(Start(World(meeting_room(2)), await leadership.acquire(Holder(), -1)))
    return authority


@pytest.mark.parametrize("all_may_ask", [True, False], ids=["before", "now"])
@pytest.mark.parametrize("name", ["guest", "paris"])
def test_only_worlds_and_hosts_are_answered_with_the_private_state_or_may_move_the_room(
    tmp_path: Path, name: str, all_may_ask: bool
) -> None:
    async def body(s: Secured) -> None:
        hub, attacker = await s.door("hub"), await s.door(name)
        authority = await leading(hub, SystemClock())
        hub.serve(BY_NAME["world_save"], lambda _: WorldSnapshot(private_state=b"private"))
        while await attacker.query(BY_NAME["world_snapshot"]) is None:  # what everybody may ask for comes through
            hub.serve(BY_NAME["world_snapshot"], lambda _: WorldSnapshot())
        patience_s = 60.0 if all_may_ask else 1.0  # who is refused hears nothing
        answers = {topic: await attacker.query(BY_NAME[topic], request, patience_s) for topic, request in PRIVATE.items()}
        assert {t for t, a in answers.items() if a is not None} == (PRIVATE.keys() if all_may_ask else set())
        hub.publish(BY_NAME["world_inputs"]).put(WorldInputs(private_state=b"private"))
        told = await asyncio.to_thread(lambda: list(s.session(name).get(BY_NAME["world_inputs"].pattern("demo"))))
        assert bool(told) == all_may_ask, "who may not subscribe gets no history either"
        await attacker.query(BY_NAME["world_handover"], WorldHandoverRequest(phase=TAKE, term=1_000_000))
        assert authority.leads
        worlds_own = await s.door("world")
        assert await worlds_own.query(BY_NAME["world_handover"], PRIVATE["world_handover"], timeout_s=60.0) is not None

    secured(tmp_path, body, all_may_ask=all_may_ask)


def test_the_access_table_gives_every_topic_to_those_who_may_hear_it_and_to_no_other() -> None:
    rules = access_rules("demo", ["paris", "tokyo", "osaka"], observers=["guest"], worlds=["osaka"], hosts=["tokyo"])
    keys = {r["id"]: set(r["key_exprs"]) for r in rules["rules"] if r["flows"] == ["ingress"] and "query" in r["messages"]}
    hears = {p["subjects"][0]: set().union(*(keys[r] for r in p["rules"] if r in keys)) for p in rules["policies"]}
    may = {
        Audience.EVERYBODY: {"paris", "tokyo", "osaka", "guest", "world", "hub", "router"},
        Audience.HOSTS: {"tokyo", "osaka", "world", "hub", "router"},
        Audience.WORLDS: {"osaka", "world", "hub", "router"},
        Audience.HUB: {"hub", "router"},
        Audience.HOLDER: {"router"},  # which passes on what each asks under its own name
        Audience.READER: {"hub", "router"},  # and of its own lines each site
    }
    for topic in TOPICS:
        assert {name for name, k in hears.items() if topic.pattern("demo") in k} == may[topic.audience], topic.name


def test_an_observer_is_heard_on_no_topic(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        hub, tokyo = await s.door("hub"), await s.door("tokyo")
        heard: list[Any] = [hub.subscribe(t, queue_all=True) for t in TOPICS if t.delivery is not Delivery.QUERY]
        guest = s.session("guest")
        for topic in TOPICS:
            key = topic.format(**dict.fromkeys(topic.fields, "x") | {"conference": "demo", "site": "guest"})
            guest.put(key, b"")
            guest.put(key.replace("guest", "tokyo"), b"")
        marker = hub.subscribe(BY_NAME["participant"])
        tokyo.publish(BY_NAME["participant"], participant="ann").put(BY_NAME["participant"].message())
        async for _ in marker:
            break
        assert [sample.key for inbox in heard for sample in inbox.take() if "ann" not in sample.key] == []
        assert hub.counters.corrupt == 0, "nothing of it came as far as the bus"

    secured(tmp_path, body)


@pytest.mark.parametrize(
    ("term", "place", "refused"),
    [(1_000_000, "osaka", True), (2**32 - 1, "osaka", True), (1, "osaka", True), (0, "nowhere", True), (0, "osaka", False)],
)
def test_a_room_is_given_only_to_a_world_that_waits_and_names_the_term_that_is_led(term: int, place: str, refused: bool) -> None:
    async def run() -> tuple[Any, bool]:
        network, clock = MemoryNetwork(), SimulatedClock(1)
        authority = await leading(network.bus("demo", "hub", clock), clock)
        other = network.bus("demo", "hub", clock)
        other.announce(WorldToken(0, "5742a46e", WAITS, "osaka").text)
        await asyncio.sleep(0)
        request = WorldHandoverRequest(phase=TAKE, term=term, place=place)
        return await other.query(BY_NAME["world_handover"], request), authority.leads

    answer, leads = asyncio.run(run())
    assert (answer is None, leads) == (refused, refused)


def test_a_handover_from_nobody_and_a_presence_with_any_term_give_nobody_the_lease(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Who may ask as a world says that it leads under the last term, and takes the room: the room goes on under the next term."""

    async def run() -> None:
        clock, network = SimulatedClock(10**18), MemoryNetwork()
        config = Config(2, tmp_path, lease_file=tmp_path / "lease")
        told = network.bus("demo", "hub", clock).subscribe(BY_NAME["world_inputs"], queue_all=True)
        attacker = network.bus("demo", "hub", clock)
        task = asyncio.create_task(world.run(config, network.bus("demo", "hub", clock), clock))
        terms: set[int] = set()

        async def until_term(term: int) -> None:
            while term not in terms:
                await clock.advance_to_ns(clock.now_ns() + 16_666_667)
                await asyncio.sleep(0.001)  # its kernels are made on a thread
                terms.update(s.message.header.term for s in told.take())

        await until_term(0)
        attacker.announce(WorldToken(0, "5742a46e", WAITS, "osaka").text)
        attacker.announce(WorldToken(MOST_TERM, "5742a46e", LEADS, "osaka").text)
        await asyncio.sleep(0)
        request = WorldHandoverRequest(phase=TAKE, term=0, place="osaka")
        assert await attacker.query(BY_NAME["world_handover"], request) is not None
        await clock.advance_to_ns(clock.now_ns() + 4_000_000_000)
        assert "osaka has led under term 999999999, of which the lease here does not know" in caplog.text
        await attacker.close()
        await until_term(1)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        assert terms == {0, 1}

    asyncio.run(run())


@pytest.mark.parametrize("term", [5, 999_999, 1_000_000, MOST_TERM, 2**32 - 1])
def test_what_was_kept_under_any_term_is_found_again(tmp_path: Path, term: int) -> None:
    room = meeting_room(2)
    kept = Store(tmp_path)
    kept.begin(World(room), 4)
    kept.leave()
    kept.begin(World(room), term)
    found = Store(tmp_path).load(room, 1)
    assert found is not None and found.term == term
