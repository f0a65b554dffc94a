"""Who leads a held thing, on the bus: told to whom it concerns; a holder whose capture dies; a renderer that predicts."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from world_site import TICK_NS, WorldSite

from vistel.messages.world.verify import verify
from vistel.space.holding.ownership import LEASE_NS
from vistel.v1.world_pb2 import Ownership
from vistel.wire.topics import BY_NAME


def told(reader: Any) -> list[Ownership]:
    return [s.message for s in reader.take()]


async def until_lifted(site: WorldSite, by: str) -> None:
    """The meeting up to the step in which somebody holds the baton 10 cm above where it lay."""
    await site.play(1 / 60, from_s=2.2)
    low = site.rooms()[-1].poses["baton"][0][1]
    for _ in range(30):
        await site.play(0.1)
        now = site.rooms()[-1]
        if [g.participant for g in now.grasps] == [by] and now.poses["baton"][0][1] > low + 0.1:
            return
    raise AssertionError(f"{by} never lifted the baton")


def test_what_a_killed_capture_held_falls_free_after_the_lease_and_that_is_reported(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = WorldSite(tmp_path)
        async with site.open():
            reader = site.network.bus("demo", "tokyo", site.clock).subscribe(BY_NAME["ownership"], queue_all=True)
            await until_lifted(site, "aiko")
            (granted,) = told(reader)
            assert (granted.event, granted.participant, granted.owner) == (Ownership.EVENT_GRANTED, "aiko", "aiko")
            assert granted.until_ns == granted.header.t_ns + LEASE_NS
            site.away |= {"aiko", "bruno"}  # nobody takes it from her; her capture is dead, her site still there
            steps = LEASE_NS // TICK_NS
            await site.play((steps - 3) / 60)
            assert [g.participant for g in site.rooms()[-1].grasps] == ["aiko"]
            high = site.rooms()[-1].poses["baton"][0][1]
            await site.play(0.1)
            (expired,) = told(reader)
            assert (expired.event, expired.thing, expired.owner) == (Ownership.EVENT_EXPIRED, "baton", "")
            await site.play(0.4)
            assert not site.rooms()[-1].grasps
            assert site.rooms()[-1].poses["baton"][0][1] < high - 0.05
            report = verify(site.log)
            assert report.equal and report.difference == ""

    asyncio.run(scenario())


def test_at_a_hand_over_the_taker_learns_whose_it_is_and_then_that_it_is_theirs(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = WorldSite(tmp_path)
        async with site.open():
            reader = site.network.bus("demo", "paris", site.clock).subscribe(BY_NAME["ownership"], queue_all=True)
            await site.play(5.0, from_s=2.2)
            events = told(reader)
            of = {who: [e.event for e in events if e.participant == who] for who in ("aiko", "bruno")}
            assert of["aiko"] == [Ownership.EVENT_GRANTED, Ownership.EVENT_RELEASED]
            assert of["bruno"] == [Ownership.EVENT_REJECTED, Ownership.EVENT_GRANTED]
            rejected = next(e for e in events if e.event == Ownership.EVENT_REJECTED)
            assert rejected.owner == "aiko" and rejected.until_ns > rejected.header.t_ns

    asyncio.run(scenario())
