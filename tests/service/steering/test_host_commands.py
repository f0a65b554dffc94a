"""Somebody asks the world, or `vistel up`, in the name of the host. What it needs: the certificate of the hub."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from secured_bus import Secured, secured
from waiting import until

from vistel.conference.connect import owners_of
from vistel.conference.model import Conference
from vistel.host import HOST
from vistel.v1.command_pb2 import Command
from vistel.v1.service_pb2 import HostAction, RunReply, RunRequest
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.access import access_rules

PEOPLE = {"tokyo": "ann", "paris": "ben", "osaka": "cem"}
CONFERENCE = Conference.model_validate({"sites": [{"name": s, "participants": [{"name": p}]} for s, p in PEOPLE.items()]})


def _open_to_all() -> dict[str, Any]:
    """The router's rules as they would be if every certificate could say everything."""
    rules = access_rules("demo", list(PEOPLE), observers=["guest"])
    next(r for r in rules["rules"] if r["id"] == "paris-say")["key_exprs"] = ["vistel/demo/**"]
    return rules


@pytest.mark.parametrize("rule", [False, True], ids=["without-the-rule", "with-the-rule"])
def test_nobody_but_the_hub_asks_the_world_as_the_host(tmp_path: Path, rule: bool) -> None:
    async def body(s: Secured) -> None:
        if not rule:
            s.open_with(_open_to_all())
        world = await s.door("world", owners=owners_of(CONFERENCE))
        heard: set[str] = set()
        listening = asyncio.create_task(_ids(world.subscribe(BY_NAME["command"], queue_all=True), heard))
        hub, as_hub, as_paris = await s.door("hub"), await s.door("hub", tls=s.issue("paris")), await s.door("paris")

        def ask() -> bool:
            for bus, who in ((as_hub, "paris-as-hub"), (as_paris, "paris-as-paris"), (hub, "hub")):
                bus.publish(BY_NAME["command"], participant=HOST).put(Command(id=who, participant=HOST, reset={}))
            return heard >= ({"hub"} if rule else {"hub", "paris-as-hub"})

        await until(ask, "the commands")
        for _ in range(20):
            ask()
            await asyncio.sleep(0.02)  # what a router lets through comes as fast as what it does not stop
        assert heard == ({"hub"} if rule else {"hub", "paris-as-hub"})
        listening.cancel()

    secured(tmp_path, body)


async def _ids(subscription: Any, heard: set[str]) -> None:
    async for sample in subscription:
        heard.add(sample.message.id)


@pytest.mark.parametrize("all_may_ask", [True, False], ids=["before", "now"])
@pytest.mark.parametrize("name", ["guest", "paris", "world"])
def test_processes_are_stopped_by_the_hub_and_by_nobody_else(tmp_path: Path, name: str, all_may_ask: bool) -> None:
    async def body(s: Secured) -> None:
        hub, host, attacker = await s.door("hub"), await s.door("hub"), await s.door(name)
        hub.serve(BY_NAME["run"], lambda _: RunReply(done="stopping hub/world"))
        request = RunRequest(action=RunRequest.ACTION_STOP, process="hub/world")
        while await host.query(BY_NAME["run"], request) is None:  # until the router knows who answers
            pass
        assert (await attacker.query(BY_NAME["run"], request, 60.0 if all_may_ask else 1.0) is not None) == all_may_ask

    secured(tmp_path, body, all_may_ask=all_may_ask)


@pytest.mark.parametrize("topic", ["host_action", "muting"])
def test_only_the_hub_mutes_and_says_what_the_host_did(tmp_path: Path, topic: str) -> None:
    names: dict[str, Any] = {"participant": "ann"} if topic == "muting" else {}

    async def body(s: Secured) -> None:
        listener = await s.door("tokyo", owners=owners_of(CONFERENCE))
        subscription = listener.subscribe(BY_NAME[topic], polled=True, queue_all=True)
        doors = {name: await s.door(name) for name in ("paris", "world", "hub")}
        heard: set[int] = set()

        def said() -> bool:
            for number, bus in enumerate(doors.values(), 1):
                message: Any = BY_NAME[topic].message()
                message.header.t_ns = number
                if isinstance(message, HostAction):
                    message.who = bus.site
                bus.publish(BY_NAME[topic], **names).put(message)
            heard.update(sample.message.header.t_ns for sample in subscription.take())
            return len(heard) > 0

        await until(said, "the hub")
        for _ in range(20):
            said()
            await asyncio.sleep(0.02)  # what a router lets through comes as fast as what it does not stop
        assert heard == {3}

    secured(tmp_path, body)


def test_no_participant_of_a_file_is_called_as_the_host_of_the_console() -> None:
    with pytest.raises(ValueError, match="take another"):
        Conference.model_validate({"sites": [{"name": "tokyo", "participants": [{"name": HOST}]}]})
