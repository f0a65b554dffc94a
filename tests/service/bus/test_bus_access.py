"""The access rules on a real router with certificates: each site speaks for itself only."""

from __future__ import annotations

import asyncio
import socket
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from secured_bus import Secured, secured
from waiting import until

from vistel.v1.command_pb2 import Command, CommandResult
from vistel.v1.motion_pb2 import Motion, Participant
from vistel.v1.service_pb2 import ClockReply
from vistel.v1.world_pb2 import WorldSnapshot, WorldState
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.motion.interest import ChosenSubscriptions
from vistel.wire.topics import BY_NAME, TOPICS, Delivery, Publisher
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import BusError, ZenohBus
from vistel.wire.zenoh.config import TlsFiles


async def first(subscription: Any, site: str = "") -> Any:
    """The first message, from `site` if named (a process hears itself, and no router is asked for that)."""
    async for sample in subscription:
        if not site or sample.names["site"] == site:
            return sample


@pytest.mark.parametrize("protocol", ["tls", "quic"])
def test_every_site_is_heard_under_its_own_name_and_the_hub_as_the_world(tmp_path: Path, protocol: str) -> None:
    async def body(s: Secured) -> None:
        paris, tokyo, hub = await s.door("paris"), await s.door("tokyo"), await s.door("hub")
        commands, results = hub.subscribe(BY_NAME["command"]), paris.subscribe(BY_NAME["command_result"])
        paris.publish(BY_NAME["command"], participant="ann").put(Command(id="1"))
        assert (await first(commands)).message.id == "1"
        hub.publish(BY_NAME["command_result"], participant="ann").put(CommandResult(id="1"))
        assert (await first(results)).message.id == "1"
        hub.serve(BY_NAME["clock"], lambda _: ClockReply(t_server_ns=7))
        hub.serve(BY_NAME["world_snapshot"], lambda _: WorldSnapshot(private_state=b"x"))
        for topic in ("clock", "world_snapshot"):
            reply = None
            while reply is None:
                reply = await tokyo.query(BY_NAME[topic])
        seen: list[tuple[str, str, bool]] = []
        tokyo.watch_presence(lambda *change: seen.append(change))
        paris.announce("posture")
        await until(lambda: seen == [("paris", "posture", True)])
        late = tokyo.subscribe(BY_NAME["command"])
        assert (await first(late)).message.id == "1", "the last value waits behind the access rules too"

    secured(tmp_path, body, protocol=protocol)


def test_a_site_subscribes_to_whom_it_chooses_alone(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        paris, tokyo = await s.door("paris"), await s.door("tokyo")
        chosen = ChosenSubscriptions(tokyo, BY_NAME["motion"], {"ann": "paris", "bob": "paris"})
        thin = tokyo.subscribe(BY_NAME["motion_thin"], queue_all=True)
        chosen.choose(["ann"])
        sent = [paris.publish(BY_NAME[t], participant=p) for t in ("motion", "motion_thin") for p in ("ann", "bob")]
        heard: set[tuple[str, str]] = set()

        def all_heard() -> bool:
            for publication in sent:
                publication.put(Motion())
            samples = [*chosen.take(), *thin.take()]
            heard.update((x.topic.name, x.names["participant"]) for x in samples if x.names["site"] == "paris")
            return len(heard) >= 3

        await until(all_heard)
        assert heard == {("motion", "ann"), ("motion_thin", "ann"), ("motion_thin", "bob")}
        chosen.close()

    secured(tmp_path, body)


@pytest.mark.parametrize("protocol", ["tls", "quic"])
def test_a_site_cannot_speak_for_another_nor_for_the_world_nor_be_present_as_another(tmp_path: Path, protocol: str) -> None:
    async def body(s: Secured) -> None:
        paris, tokyo = await s.door("paris"), await s.door("tokyo")
        heard: list[str] = []
        listening: list[asyncio.Task[None]] = []
        for topic in TOPICS:
            if topic.delivery is not Delivery.QUERY:
                subscription = tokyo.subscribe(topic, queue_all=True)

                async def listen(subscription: Any = subscription) -> None:
                    async for sample in subscription:
                        heard.append(sample.key)

                listening.append(asyncio.create_task(listen()))
        seen: list[tuple[str, str, bool]] = []
        tokyo.watch_presence(lambda *change: seen.append(change))
        session = s.session("paris")
        payload = Motion()
        payload.header.version = 1
        for key in (
            "vistel/demo/site/tokyo/participant/ann/motion",
            "vistel/demo/site/tokyo/participant/ann/motion_thin",
            "vistel/demo/site/tokyo/participant/ann/voice_level",
            "vistel/demo/site/*/participant/ann/motion",
            "vistel/demo/**",
            "vistel/demo/world/state",
            "vistel/other/site/paris/participant/ann/motion",
            "vistel/demo/site/paris/anything/at/all",
        ):
            session.put(key, payload.SerializeToString())
        token = session.liveliness().declare_token("vistel/demo/alive/tokyo/posture")
        forged = session.declare_queryable("vistel/demo/clock", lambda q: q.reply("vistel/demo/clock", b"forged"))
        paris.publish(BY_NAME["world_state"]).put(WorldState())
        paris.publish(BY_NAME["motion"], site="tokyo", participant="ann").put(Motion())
        # A message that is allowed, sent after all the others, marks when those would have arrived.
        marker = paris.publish(BY_NAME["participant"], participant="ann")
        mine = tokyo.subscribe(BY_NAME["participant"])
        marker.put(Participant())
        await first(mine)
        session.put("vistel/demo/site/paris/participant/mark/motion", payload.SerializeToString())
        await until(lambda: any("mark" in key for key in heard) and any(key.endswith("/about") for key in heard))
        assert await tokyo.query(BY_NAME["clock"], timeout_s=0.3) is None
        assert {k for k in heard if "mark" not in k} == {"vistel/demo/site/paris/participant/ann/about"}
        assert seen == []
        for task in listening:
            task.cancel()
        token.undeclare()
        forged.undeclare()

    secured(tmp_path, body, protocol=protocol)


def test_an_observer_hears_and_cannot_speak(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        paris, guest, tokyo = await s.door("paris"), await s.door("guest"), await s.door("tokyo")
        at_guest, at_tokyo = guest.subscribe(BY_NAME["participant"]), tokyo.subscribe(BY_NAME["participant"])
        guest.publish(BY_NAME["participant"], participant="eve").put(Participant(display_name="Eve"))
        paris.publish(BY_NAME["participant"], participant="ann").put(Participant(display_name="Ann"))
        assert (await first(at_guest, "paris")).message.display_name == "Ann"
        assert (await first(at_tokyo)).message.display_name == "Ann"

    secured(tmp_path, body)


def test_a_certificate_of_another_authority_is_refused_with_one_clear_line(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        foreign = Authority.create(tmp_path / "foreign", datetime.now(UTC)).issue("paris", datetime.now(UTC))
        mixed = TlsFiles(s.authority.file, foreign.certificate, foreign.key)
        with pytest.raises(BusError, match="certificates do not match"):
            await s.door("paris", mixed, connect_s=1.0)

    secured(tmp_path, body)


def test_a_listed_authority_but_unknown_name_is_neither_heard_nor_answered(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        eve, tokyo, paris = await s.door("eve"), await s.door("tokyo"), await s.door("paris")
        at_eve, at_tokyo = eve.subscribe(BY_NAME["participant"]), tokyo.subscribe(BY_NAME["participant"])
        eve.publish(BY_NAME["participant"], participant="eve").put(Participant(display_name="Eve"))
        paris.publish(BY_NAME["participant"], participant="ann").put(Participant(display_name="Ann"))
        assert (await first(at_tokyo)).message.display_name == "Ann"
        assert [s.names["site"] for s in at_eve.take() if s.names["site"] != "eve"] == []

    secured(tmp_path, body)


def test_every_topic_of_the_table_has_exactly_its_publishers_in_the_rules() -> None:
    rules = access_rules("demo", ["paris", "tokyo"])
    may = {
        p["subjects"][0]: {
            k
            for r in rules["rules"]
            if r["id"] in p["rules"] and "put" in r["messages"] and r["flows"] == ["ingress"]
            for k in r["key_exprs"]
        }
        for p in rules["policies"]
    }
    for topic in TOPICS:
        if topic.publisher is Publisher.SITE:
            assert topic.pattern("demo", site="paris") in may["paris"]
            assert topic.pattern("demo", site="paris") not in may["tokyo"]
        elif topic.publisher is Publisher.WORLD:
            assert topic.pattern("demo") in may["world"] & may["hub"]
            assert topic.pattern("demo") not in may["paris"]
        else:
            assert topic.pattern("demo") in may["hub"]
            assert topic.pattern("demo") not in may["world"] | may["paris"]


def test_where_nobody_answers_over_udp_a_site_joins_over_tls(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as silent:
            silent.bind(("127.0.0.1", 0))
            blocked = f"quic/127.0.0.1:{silent.getsockname()[1]}"
            clock, files = SystemClock(), s.issue("tokyo")
            bus = await ZenohBus.open(
                conference="demo", site="tokyo", clock=clock, endpoints=[blocked, s.endpoint], tls=files, connect_s=16.0
            )
        assert bus.connected
        await bus.close()

    secured(tmp_path, body)
