"""Somebody sends too much: long texts, large messages, many of them, times to come. What it needs: a site's own certificate."""

from __future__ import annotations

import asyncio
import time
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
import zenoh
from secured_bus import Secured, secured
from waiting import until
from world_site import CONFERENCE, WorldSite, scenario

from vistel.conference.connect import owners_of
from vistel.v1.audio_pb2 import EquipmentStatus
from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Motion, Participant
from vistel.v1.world_pb2 import AssetRequest, WorldSnapshot
from vistel.wire import inbox
from vistel.wire.assets import MOST_ASKED, AssetShelf
from vistel.wire.bus import Sample
from vistel.wire.clock import SimulatedClock
from vistel.wire.limits import CUT, MOST_LETTERS, MOST_MESSAGE_BYTES, SITE_BYTES, most_bytes, objection_to_texts
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.owners import MOST_AHEAD_NS
from vistel.wire.topics import BY_NAME, TOPICS, Publisher
from vistel.wire.zenoh import config
from vistel.wire.zenoh.access import MOST_QUESTIONS_PER_S
from vistel_services.world.received import MOST_COMMANDS, InputCollector

NOW_NS = 1_000_000_000_000
LONG = "n" * 20_000


def received(topic: str, *messages: Any, **names: str) -> tuple[list[Any], MemoryBus]:
    """What a subscriber gets of messages from aiko's site."""

    async def run() -> tuple[list[Any], MemoryBus]:
        network, clock = MemoryNetwork(), SimulatedClock(NOW_NS)
        bus = network.bus("demo", "paris", clock, owners=owners_of(CONFERENCE))
        subscription = bus.subscribe(BY_NAME[topic], queue_all=True)
        sending = network.bus("demo", "tokyo", clock).publish(BY_NAME[topic], **names)
        for message in messages:
            sending.put(message)
        return [sample.message for sample in subscription.take()], bus

    return asyncio.run(run())


def test_a_name_of_20000_letters_is_cut_before_anybody_draws_it() -> None:
    heard, _ = received("participant", Participant(display_name=LONG), participant="aiko")
    assert len(heard[0].display_name) == CUT["display_name"]
    heard, _ = received("command", Command(move={"which": {"name": LONG}}), participant="aiko")
    assert len(heard[0].move.which.name) == CUT["name"]


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        ("participant", Participant(avatar=LONG)),
        ("command", Command(id=LONG)),
        ("command", Command(move={"thing": LONG})),
        ("command", Command(select={"which": {"shape": LONG}})),
    ],
)
def test_any_other_text_that_is_too_long_is_refused(topic: str, message: Any) -> None:
    heard, bus = received(topic, message, participant="aiko")
    assert (heard, bus.counters.corrupt) == ([], 1)


def test_texts_of_parts_are_looked_at_too() -> None:
    status = EquipmentStatus(values=[{"name": LONG, "unit": "u" * (MOST_LETTERS + 1)}])
    assert "unit" in objection_to_texts(status)


@pytest.mark.parametrize("topic", [t for t in TOPICS if t.publisher is Publisher.SITE], ids=lambda t: t.name)
def test_a_message_of_a_site_has_a_largest_size(topic: Any) -> None:
    assert most_bytes(topic) <= 4 << 20
    assert most_bytes(topic) == SITE_BYTES or topic.name == "device_raw"


def test_a_larger_message_is_dropped_before_it_waits() -> None:
    heard, bus = received("motion", Motion(frame=bytes(SITE_BYTES)), Motion(frame=b"small"), participant="aiko")
    assert [m.frame for m in heard] == [b"small"]
    assert bus.counters.corrupt == 1


def test_what_waits_is_bounded_in_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inbox, "QUEUE_BYTES", 100_000)
    heard, bus = received("motion", *(Motion(frame=bytes(10_000)) for _ in range(50)), participant="aiko")
    assert 8 <= len(heard) <= 10
    assert bus.counters.overflow == 50 - len(heard)


def test_times_to_come_are_not_believed() -> None:
    soon, late = Motion(), Motion()
    soon.header.t_ns, late.header.t_ns = NOW_NS + MOST_AHEAD_NS, NOW_NS + MOST_AHEAD_NS + 1
    heard, bus = received("motion", soon, late, participant="aiko")
    assert [m.header.t_ns for m in heard] == [soon.header.t_ns]
    assert bus.counters.refused == {"motion": 1}
    command = Command(id="1")
    command.header.t_ns = 2**63
    heard, _ = received("command", command, participant="aiko")
    assert heard[0].header.t_ns == NOW_NS, "a command is not sent again; it counts as given now"


def test_a_flood_of_commands_costs_a_step_no_more_than_its_share() -> None:
    def sample(n: int) -> Sample:
        return Sample(BY_NAME["command"], "", {"participant": "aiko", "site": "tokyo"}, Command(id=str(n)), 1)

    collector = InputCollector()
    for n in range(100_000):
        collector.command(sample(n))
    assert len(collector.take(1).commands) == MOST_COMMANDS
    collector.command(sample(0))
    assert len(collector.take(2).commands) == 1


def test_the_world_goes_on_under_a_flood_of_invented_people(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        bus = site.buses["bruno"]
        for n in range(2000):
            bus.publish(BY_NAME["participant"], participant=f"eve-{n}").put(Participant(height_m=1.7))
        await site.play(0.3)

    assert scenario(tmp_path, play, owners_of(CONFERENCE)).rooms()[-1].participants == ("aiko", "bruno", "chidi")


def test_random_digests_do_not_pile_up() -> None:
    shelf = AssetShelf({}, lambda digest: None)
    shelf._thread = type("Never", (), {"submit": lambda *a: Future(), "shutdown": lambda *a, **k: None})()  # type: ignore[assignment]
    for n in range(10_000):
        shelf.answer(AssetRequest(digest=f"{n:032x}").SerializeToString())
    assert len(shelf._ready) == MOST_ASKED


def test_a_message_too_large_for_the_bus_is_dropped_and_the_sender_stays(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        tokyo = await s.door("tokyo")
        heard: list[int] = []
        subscriber = tokyo._session.declare_subscriber(BY_NAME["motion"].pattern("demo"), lambda m: heard.append(len(m.payload)))
        paris = s.session("paris")
        while 1 not in heard:
            paris.put("vistel/demo/site/paris/participant/ben/motion", b"1")
            await asyncio.sleep(0.05)
        paris.put(
            "vistel/demo/site/paris/participant/ben/motion",
            bytes(MOST_MESSAGE_BYTES + 1),
            congestion_control=zenoh.CongestionControl.BLOCK,
        )
        while 2 not in heard:
            paris.put("vistel/demo/site/paris/participant/ben/motion", b"22")
            await asyncio.sleep(0.05)
        assert set(heard) == {1, 2}
        subscriber.undeclare()

    secured(tmp_path, body)


@pytest.mark.parametrize("limited", [False, True], ids=["before", "now"])
def test_a_flood_of_questions_of_one_site_reaches_the_world_as_a_trickle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limited: bool
) -> None:
    if not limited:
        monkeypatch.setattr(config, "question_limits", list)

    async def body(s: Secured) -> None:
        hub, paris = await s.door("hub"), await s.door("paris")
        asked: list[bytes] = []
        hub.serve(BY_NAME["world_snapshot"], lambda request: asked.append(request) or WorldSnapshot())
        while await paris.query(BY_NAME["world_snapshot"], timeout_s=0.3) is None:
            pass
        asked.clear()
        attacker = s.session("paris")
        key = BY_NAME["world_snapshot"].pattern("demo")
        began_s = time.monotonic()
        answers = [attacker.get(key) for _ in range(300)]
        for a in answers:
            await asyncio.to_thread(list, a)
        if limited:
            took_s = time.monotonic() - began_s
            assert len(asked) <= 1 + MOST_QUESTIONS_PER_S["world_snapshot"] * took_s
        else:
            await until(lambda: len(asked) >= 250)

    secured(tmp_path, body)
