"""Somebody takes the room from its world, or what is private of it. What it needs: any certificate that may listen."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path
from typing import Any

import pytest
from secured_bus import Secured, secured

from vistel.persistence.store import Store
from vistel.space.room import meeting_room
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldHandoverRequest, WorldInputs, WorldMoveRequest, WorldSnapshot
from vistel.wire.clock import SimulatedClock, SystemClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME, TOPICS, Audience, Delivery
from vistel.wire.world.presence import MOST_TERM, WAITS, WorldToken
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import ZenohBus
from vistel_services.world.authority import Authority, Start

PREPARE, TAKE = WorldHandoverRequest.PHASE_PREPARE, WorldHandoverRequest.PHASE_TAKE
PRIVATE = {"world_save": None, "world_handover": WorldHandoverRequest(phase=PREPARE), "world_move": WorldMoveRequest(place="hub")}


def leading(bus: ZenohBus | MemoryBus, clock: Any, term: int = 0) -> Authority:
    """A world of the room that leads."""
    authority = Authority(bus, clock)
    authority.lead(Start(World(meeting_room(2)), term))
    return authority


@pytest.mark.parametrize("all_may_ask", [True, False], ids=["before", "now"])
@pytest.mark.parametrize("name", ["guest", "paris"])
def test_only_worlds_and_hosts_are_answered_with_the_private_state_or_may_move_the_room(
    tmp_path: Path, name: str, all_may_ask: bool
) -> None:
    async def body(s: Secured) -> None:
        hub, attacker = await s.door("hub"), await s.door(name)
        authority = leading(hub, SystemClock())
        hub.serve(BY_NAME["world_save"], lambda _: WorldSnapshot(private_state=b"private"))
        while await attacker.query(BY_NAME["world_snapshot"]) is None:  # what everybody may ask for comes through
            hub.serve(BY_NAME["world_snapshot"], lambda _: WorldSnapshot())
        answers = {topic: await attacker.query(BY_NAME[topic], request) for topic, request in PRIVATE.items()}
        assert {t for t, a in answers.items() if a is not None} == (PRIVATE.keys() if all_may_ask else set())
        hub.publish(BY_NAME["world_inputs"]).put(WorldInputs(private_state=b"private"))
        told = await asyncio.to_thread(lambda: list(s.session(name).get(BY_NAME["world_inputs"].pattern("demo"))))
        assert bool(told) == all_may_ask, "who may not subscribe gets no history either"
        await attacker.query(BY_NAME["world_handover"], WorldHandoverRequest(phase=TAKE, term=1_000_000))
        assert authority.leads
        worlds_own = await s.door("world")
        assert await worlds_own.query(BY_NAME["world_handover"], PRIVATE["world_handover"]) is not None

    secured(tmp_path, body, all_may_ask=all_may_ask)


def test_the_access_table_gives_every_topic_to_those_who_may_hear_it_and_to_no_other() -> None:
    rules = access_rules("demo", ["paris", "tokyo", "osaka"], observers=["guest"], worlds=["osaka"], hosts=["tokyo"])
    keys = {r["id"]: set(r["key_exprs"]) for r in rules["rules"] if r["flows"] == ["ingress"] and "query" in r["messages"]}
    hears = {p["subjects"][0]: set().union(*(keys[r] for r in p["rules"] if r in keys)) for p in rules["policies"]}
    may = {
        Audience.EVERYBODY: {"paris", "tokyo", "osaka", "guest", "world", "hub", "router"},
        Audience.HOSTS: {"tokyo", "osaka", "world", "hub", "router"},
        Audience.WORLDS: {"osaka", "world", "hub", "router"},
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
    [
        (1_000_000, "osaka", "term 1 comes next"),
        (2**32 - 1, "osaka", "term 1 comes next"),
        (0, "osaka", "term 1 comes next"),
        (1, "nowhere", "no world waits at that place"),
        (1, "osaka", ""),
    ],
)
def test_a_room_is_given_only_to_a_world_that_waits_and_under_the_next_term(
    caplog: pytest.LogCaptureFixture, term: int, place: str, refused: str
) -> None:
    async def run() -> tuple[Any, bool]:
        network, clock = MemoryNetwork(), SimulatedClock(1)
        authority = leading(network.bus("demo", "hub", clock), clock)
        other = network.bus("demo", "hub", clock)
        other.announce(WorldToken(0, "5742a46e", WAITS, "osaka").text)
        await asyncio.sleep(0)
        request = WorldHandoverRequest(phase=TAKE, term=term, place=place)
        return await other.query(BY_NAME["world_handover"], request), authority.leads

    with caplog.at_level(logging.WARNING):
        answer, leads = asyncio.run(run())
    assert (answer is None, leads) == (bool(refused), bool(refused))
    assert refused in caplog.text


def test_the_last_term_is_reported_in_a_line_and_gives_the_room_to_nobody(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> bool:
        network, clock = MemoryNetwork(), SimulatedClock(1)
        authority = leading(network.bus("demo", "hub", clock), clock, MOST_TERM)
        other = network.bus("demo", "hub", clock)
        other.announce(WorldToken(0, "5742a46e", WAITS, "osaka").text)
        await asyncio.sleep(0)
        request = WorldHandoverRequest(phase=TAKE, term=MOST_TERM + 1, place="osaka")
        return await other.query(BY_NAME["world_handover"], request) is None and authority.leads

    assert asyncio.run(run())
    assert f"{MOST_TERM} is the last term" in caplog.text


@pytest.mark.parametrize("term", [5, 999_999, 1_000_000, MOST_TERM, 2**32 - 1])
def test_what_was_kept_under_any_term_is_found_again(tmp_path: Path, term: int) -> None:
    room = meeting_room(2)
    kept = Store(tmp_path)
    kept.begin(World(room), 4)
    kept.leave()
    kept.begin(World(room), term)
    kept.gave(min(term + 1, 2**32 - 1), "osaka", 0)
    found = Store(tmp_path).load(room, 1)
    assert found is not None and found.term == term
    assert Store(tmp_path).away(1) == (min(term + 1, 2**32 - 1), "osaka")
