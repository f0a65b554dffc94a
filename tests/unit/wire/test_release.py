"""Versions: releases with the same messages meet, whatever is new in one of them; others are told in one line what to update."""

from __future__ import annotations

import asyncio
import logging

import pytest

from vistel.v1.motion_pb2 import Participant
from vistel.v1.service_pb2 import ClockProbe, ClockReply
from vistel.wire import clock_sync
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.release import objection, release
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION


def test_releases_with_the_same_messages_meet_and_one_that_does_not_say_does() -> None:
    assert objection("99.1", MESSAGE_VERSION) == "" and objection("", 0) == ""


@pytest.mark.parametrize(("messages", "who"), [(8, "this machine: pip install --upgrade 'vistel==99.1'"), (6, "the hub: ")])
def test_one_line_tells_what_to_update(monkeypatch: pytest.MonkeyPatch, messages: int, who: str) -> None:
    monkeypatch.setattr("vistel.wire.release.MESSAGE_VERSION", 7)
    told = objection("99.1", messages)
    assert "\n" not in told and "VISTEL 99.1" in told and release() in told and f"update {who}" in told


def test_a_message_of_a_newer_release_with_fields_that_nobody_here_knows_arrives() -> None:
    async def play() -> Participant:
        network, clock = MemoryNetwork(), SystemClock()
        reader = network.bus("demo", "paris", clock).subscribe(BY_NAME["participant"])
        newer = Participant(participant="aiko", site="tokyo")
        newer.header.version = MESSAGE_VERSION
        newer.header.t_ns = clock.now_ns()
        unknown = b"\xfa\x3e\x05later"  # field 1007, a text
        key = BY_NAME["participant"].format(conference="demo", site="tokyo", participant="aiko")
        network.send(BY_NAME["participant"], key, newer.SerializeToString() + unknown)
        async for sample in reader:
            return sample.message
        raise AssertionError

    assert asyncio.run(play()).participant == "aiko"


def test_hub_and_site_of_different_messages_both_tell_it_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def play() -> str:
        network, clock = MemoryNetwork(), SystemClock()
        hub, site = network.bus("demo", "hub", clock), network.bus("demo", "tokyo", clock)
        clock_sync.serve_clock(hub, clock)
        for _ in range(3):
            reply: ClockReply = await site.query(BY_NAME["clock"], ClockProbe(release="9.0", message_version=MESSAGE_VERSION + 1))
        assert reply.message_version == MESSAGE_VERSION and reply.release == release()
        monkeypatch.setattr(clock_sync, "objection", lambda theirs, messages: f"{theirs} and {messages}")
        following = asyncio.create_task(clock_sync.follow_hub(site, clock, "capture", 0.001))
        offset = await clock_sync.set_clock(site, clock)
        for _ in range(50):
            await asyncio.sleep(0)
        following.cancel()
        return offset.objection if offset is not None else ""

    caplog.set_level(logging.ERROR)
    assert asyncio.run(play()) == f"{release()} and {MESSAGE_VERSION}"
    told = [r.getMessage() for r in caplog.records]
    assert sum("site not understood release='9.0'" in t for t in told) == 1
    assert sum("hub not understood" in t for t in told) == 1
