"""A site acts as somebody of another site. What it needs: a site's own certificate, with which the router's access rules let it
publish under its own name, whatever else the key and the message say."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from secured_bus import Secured, secured
from waiting import until
from world_site import CONFERENCE as MEETING
from world_site import WorldSite, scenario

from vistel.conference.connect import owners_of
from vistel.conference.model import Conference
from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Participant, Prop
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.owners import MOST_NAMES, Admission, Owners
from vistel.wire.topics import BY_NAME, TOPICS, Delivery, Publisher, Topic

CONFERENCE = Conference.model_validate(
    {
        "sites": [
            {
                "name": "tokyo",
                "participants": [{"name": "ann"}],
                "props": [{"thing": "baton"}],
                "audio": {"equipment": [{"name": "delay", "role": "delay"}]},
            },
            {"name": "paris", "participants": [{"name": "ben"}]},
        ]
    }
)
OWNERS = owners_of(CONFERENCE)
TOKYOS = {"participant": "ann", "device": "ann-tracker", "equipment": "delay", "thing": "baton"}
"""What the file gives to tokyo."""
OTHERS = {"node": "capture", "digest": "0" * 32, "part": "0000", "reader_site": "paris", "reader": "ben"}
NAMED = [t for t in TOPICS if t.publisher is Publisher.SITE and TOKYOS.keys() & set(t.fields)]


def message_of(topic: Topic, site: str) -> Any:
    """A message of `topic` that is right for `site` in all but its owner."""
    message: Any = topic.message()
    message.header.version, message.header.seq = 1, 1
    for field in ("site", *TOKYOS):
        if field in topic.message.DESCRIPTOR.fields_by_name and field in topic.fields:
            setattr(message, field, {"site": site, **TOKYOS}[field])
    return message


def names_of(topic: Topic) -> dict[str, str]:
    return {f: (TOKYOS | OTHERS)[f] for f in topic.fields if f not in ("conference", "site")}


@pytest.mark.parametrize("owners", [None, OWNERS], ids=["without-the-rule", "with-the-rule"])
def test_no_subscriber_of_any_topic_hears_paris_as_somebody_of_tokyo(tmp_path: Path, owners: Owners | None) -> None:
    """Without the rule, every single one of these topics is heard from paris: the attack is real."""

    async def body(s: Secured) -> None:
        paris, tokyo = await s.door("paris"), await s.door("tokyo")
        victim = await s.door("hub", owners=owners)
        heard: dict[str, set[str]] = {t.name: set() for t in NAMED}
        listening: list[asyncio.Task[None]] = []
        for topic in NAMED:
            subscription = victim.subscribe(topic, queue_all=True)

            async def listen(subscription: Any = subscription) -> None:
                async for sample in subscription:
                    heard[sample.topic.name].add(sample.names["site"])

            listening.append(asyncio.create_task(listen()))
        for bus in (paris, tokyo):
            for topic in NAMED:
                bus.publish(topic, **names_of(topic)).put(message_of(topic, bus.site))

        def again() -> bool:
            """Motion may be lost on the way; it is sent until it has come."""
            for bus in (paris, tokyo):
                for topic in NAMED:
                    if topic.delivery is Delivery.NEWEST:
                        bus.publish(topic, **names_of(topic)).put(message_of(topic, bus.site))
            return all("tokyo" in sites for sites in heard.values()) and (
                victim.counters.refused.keys() == heard.keys() if owners else all("paris" in sites for sites in heard.values())
            )

        await until(again)
        assert all(sites == ({"tokyo"} if owners else {"paris", "tokyo"}) for sites in heard.values())
        for task in listening:
            task.cancel()

    secured(tmp_path, body)


def delivered(topic: str, site: str, message: Any, **names: str) -> tuple[list[Any], Admission]:
    """What a subscriber gets of one message that `site` sends."""

    async def run() -> tuple[list[Any], Admission]:
        network, clock = MemoryNetwork(), SimulatedClock(1)
        victim = network.bus("demo", "hub", clock, owners=OWNERS)
        subscription = victim.subscribe(BY_NAME[topic], queue_all=True)
        network.bus("demo", site, clock).publish(BY_NAME[topic], **names).put(message)
        return [sample.message for sample in subscription.take()], victim._admission

    return asyncio.run(run())


@pytest.mark.parametrize(
    ("topic", "site", "message", "names"),
    [
        ("participant", "paris", Participant(participant="ann", display_name="Ann"), {"participant": "ben"}),
        ("participant", "paris", Participant(participant="ben", site="tokyo"), {"participant": "ben"}),
        ("command", "paris", Command(id="1", participant="ann"), {"participant": "ben"}),
        ("prop", "paris", Prop(thing="baton"), {"thing": "ball"}),
        ("prop", "paris", Prop(thing="ball", led_by="ann"), {"thing": "ball"}),
        ("prop", "paris", Prop(thing="ball"), {"thing": "ball"}),
        ("motion", "lagos", BY_NAME["motion"].message(), {"participant": "ann"}),
        ("heartbeat", "lagos", BY_NAME["heartbeat"].message(), {"node": "capture"}),
        ("motion", "tokyo", BY_NAME["motion"].message(), {"participant": "eve"}),
    ],
    ids=[
        "name-in-body",
        "site-in-body",
        "command-in-body",
        "thing-in-body",
        "led-by-another",
        "no-prop",
        "no-site",
        "node",
        "nobody",
    ],
)
def test_what_a_message_says_of_itself_is_believed_of_its_own_site_only(
    topic: str, site: str, message: Any, names: dict[str, str]
) -> None:
    heard, admission = delivered(topic, site, message, **names)
    assert heard == []
    assert admission._counters.refused == {topic: 1}


def test_who_sends_in_their_own_name_is_heard_and_an_empty_name_is_that_of_the_key() -> None:
    heard, _ = delivered("participant", "tokyo", Participant(display_name="Ann"), participant="ann")
    assert (heard[0].participant, heard[0].site) == ("ann", "tokyo")
    assert delivered("prop", "tokyo", Prop(thing="baton"), thing="baton")[0], "a prop of the file"
    assert delivered("prop", "paris", Prop(thing="ball", led_by="ben"), thing="ball")[0], "a thing that is led by a mouse"


def test_a_flood_of_refused_messages_is_one_line_a_minute_for_each_sender_and_topic(caplog: pytest.LogCaptureFixture) -> None:
    admission = delivered("motion", "tokyo", BY_NAME["motion"].message(), participant="ann")[1]
    for n in range(100_000):
        admission.names(BY_NAME["motion"], f"vistel/demo/site/paris/participant/eve-{n}/motion", 60_000_000_000 + n)
        admission.names(BY_NAME["motion"], f"vistel/demo/site/no-{n}/participant/eve/motion", 60_000_000_000 + n)
    assert len([r for r in caplog.records if "event=message_refused" in r.message]) == 2
    assert admission._counters.refused == {"motion": 200_000}
    assert len(admission._admitted) + len(admission._logged) < 10


def test_invented_names_that_the_file_does_not_give_are_bounded_for_each_site() -> None:
    admission = delivered("prop", "tokyo", Prop(thing="baton"), thing="baton")[1]
    kept = [admission.names(BY_NAME["prop"], f"vistel/demo/site/paris/prop/thing-{n}/pose", n) for n in range(100_000)]
    assert sum(names is not None for names in kept) == MOST_NAMES["thing"]
    assert admission.names(BY_NAME["prop"], "vistel/demo/site/tokyo/prop/ball/pose", 1), "the other site has its own"
    long = "a" * 20_000
    assert admission.names(BY_NAME["prop"], f"vistel/demo/site/tokyo/prop/{long}/pose", 1) is None


def test_presence_of_sites_that_the_file_does_not_know_is_dropped() -> None:
    async def run() -> None:
        network, clock = MemoryNetwork(), SimulatedClock(1)
        seen: list[str] = []
        for site in ("lagos", "tokyo"):
            network.bus("demo", site, clock).announce("process-capture")
        network.bus("demo", "hub", clock, owners=OWNERS).watch_presence(lambda site, token, alive: seen.append(site))
        network.bus("demo", "lagos", clock).announce("process-renderer")
        await asyncio.sleep(0)
        assert seen == ["tokyo"]

    asyncio.run(run())


@pytest.mark.parametrize("guarded", [False, True])
def test_the_room_is_not_reset_by_paris_in_the_name_of_somebody_of_tokyo(tmp_path: Path, guarded: bool) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.2)
        for where, name in (("bruno", "aiko"), ("aiko", "aiko"), ("bruno", "bruno")):
            command = Command(id=f"{where} as {name}", participant=name, reset={})
            site.buses[where].publish(BY_NAME["command"], participant=name).put(command)
        await site.play(0.2)

    answered = {r.id for r in scenario(tmp_path, play, owners_of(MEETING) if guarded else None).results()}
    assert answered == {"aiko as aiko", "bruno as bruno"} | (set() if guarded else {"bruno as aiko"})
