"""Where the worlds of a conference run: the file, the processes, their disks, and what their sites may say."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.v1.world_pb2 import WorldState
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.endpoints import free_port
from vistel_services import world
from vistel_services.process.plan import find, hub_processes, site_processes


def conference(**placed: Any) -> Conference:
    sites = [{"name": n, "participants": [{"name": p}]} for n, p in (("osaka", "aiko"), ("paris", "bruno"))]
    return Conference.model_validate({"sites": sites, "world": placed})


def test_a_world_runs_at_the_hub_unless_the_file_says_where() -> None:
    plain = conference()
    assert [p.node for p in hub_processes(plain)] == ["hub/world", "hub/recorder"]
    assert not any("world" in p.services for p in site_processes(plain, "osaka"))


def test_worlds_run_where_the_file_says_each_with_a_disk_of_its_own_and_one_leads() -> None:
    placed = conference(on="osaka", waiting=["hub"])
    assert [p.node for p in hub_processes(placed)] == ["hub/world", "hub/recorder"]
    there = [p for p in site_processes(placed, "osaka") if "world" in p.services]
    assert [p.node for p in there] == ["hub/world-osaka"] and there[0].place == "osaka"
    assert find(placed, "hub/world-osaka") == there[0]
    assert not any("world" in p.services for p in site_processes(placed, "paris"))
    paths = RunPaths(Path("run"), Path("out"))
    at_osaka, at_hub = (world.configure(placed, site, paths) for site in (placed.sites[0], None))
    assert (at_osaka.place, at_osaka.waits) == ("osaka", False)
    assert (at_hub.place, at_hub.waits) == ("hub", True)
    assert at_osaka.folder != at_hub.folder


@pytest.mark.parametrize(
    ("placed", "what"),
    [
        ({"on": "lima"}, "no place 'lima'; expected one of hub, osaka, paris"),
        ({"on": "osaka", "waiting": ["osaka"]}, "osaka stands more than once"),
    ],
)
def test_a_place_that_is_none_or_stands_twice_is_refused(placed: dict[str, Any], what: str) -> None:
    with pytest.raises(ValidationError, match=what):
        conference(**placed)


def test_a_site_whose_machine_runs_a_world_may_publish_what_worlds_publish_and_no_other_site_may(tmp_path: Path) -> None:
    authority, now = Authority.create(tmp_path, datetime.now(UTC)), datetime.now(UTC)
    port = free_port()
    rules = access_rules("demo", ["osaka", "paris"], worlds=["hub", "osaka"])
    router = Router.open(f"tls/127.0.0.1:{port}", tls=authority.issue("hub", now, hosts=["localhost"]), access=rules)

    async def play() -> None:
        async def door(certificate: str, site: str) -> ZenohBus:
            return await ZenohBus.open(
                conference="demo",
                site=site,
                clock=SystemClock(),
                endpoints=[f"tls/localhost:{port}"],
                tls=authority.issue(certificate, now),
            )

        osaka, paris, reader = await door("osaka", "hub"), await door("paris", "hub"), await door("paris", "paris")
        heard = reader.subscribe(BY_NAME["world_state"], queue_all=True, polled=True)
        seen: set[str] = set()
        reader.watch_presence(lambda _site, token, _alive: seen.add(token))
        steps: list[int] = []
        n = 0
        while len(steps) <= 5 or not seen:
            paris.publish(BY_NAME["world_state"]).put(WorldState(step=1))
            osaka.publish(BY_NAME["world_state"]).put(WorldState(step=2))
            if n == 5:
                paris.announce("world-9-00000000-leads-paris")
                osaka.announce("world-0-11111111-leads-osaka")
            n += 1
            await asyncio.sleep(0.02)  # what is put before the connections stand is lost
            steps += [sample.message.step for sample in heard.take()]
        assert set(steps) == {2} and seen == {"world-0-11111111-leads-osaka"}
        for bus in (osaka, paris, reader):
            await bus.close()

    try:
        asyncio.run(play())
    finally:
        router.close()
