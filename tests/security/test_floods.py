"""Somebody sends far too often, or announces far more than they send. What it needs: a site's certificate, or an address."""

from __future__ import annotations

import asyncio
import contextlib
import os
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import aiohttp
import pytest
import zenoh
from guest_room import GuestRoom
from secured_bus import Secured, secured
from waiting import until

from vistel.conference.connect import owners_of
from vistel.conference.console import ConsoleConfig
from vistel.conference.model import Conference, Recording
from vistel.protocol import vrpn
from vistel.v1.device_pb2 import RawBytes
from vistel.v1.motion_pb2 import Motion
from vistel.wire import limits
from vistel.wire.clock import SimulatedClock, SystemClock
from vistel.wire.inbox import OverflowedError
from vistel.wire.limits import AT_ONCE_S, LEAST_AT_ONCE, MOST_OFTEN, Rates
from vistel.wire.log import LogReader
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME, TOPICS, Delivery, Publisher
from vistel.wire.zenoh.config import as_text, client_config
from vistel_services.recorder import Config, run

NOW_NS = 1_700_000_000_000_000_000
GIB = 1 << 30
MIB = 1 << 20
TWO = Conference.model_validate(
    {"sites": [{"name": site, "participants": [{"name": who}]} for site, who in (("tokyo", "ann"), ("paris", "ben"))]}
)
"""Each with a tracker, as everybody has by default."""
MOTION = BY_NAME["motion"]


@pytest.mark.parametrize("topic", TOPICS, ids=lambda t: t.name)
def test_no_topic_is_held_below_ten_times_its_rate_and_each_of_a_site_that_may_be_lost_is_held_to_that(topic: Any) -> None:
    limited = topic.publisher is Publisher.SITE and topic.delivery is Delivery.NEWEST and topic.rate_hz > 0
    held = Rates(topic)
    rate = topic.rate_hz or 50.0
    as_told = [held.admit("ann", NOW_NS + round(n * 1e9 / rate / MOST_OFTEN)) for n in range(2000)]
    assert all(as_told)
    flood = [held.admit("ben", NOW_NS + round(n * 1e9 / rate / 1000)) for n in range(20_000)]
    most = max(LEAST_AT_ONCE, AT_ONCE_S * rate) + 20.0 * MOST_OFTEN
    assert sum(flood) <= most if limited else all(flood)


def test_a_clock_that_goes_back_gives_a_sender_no_more() -> None:
    held = Rates(MOTION)
    got = sum(held.admit("ann", NOW_NS - n * 1_000_000_000) for n in range(10_000))
    assert got == AT_ONCE_S * MOTION.rate_hz


@pytest.mark.parametrize("limited", [False, True], ids=["before", "now"])
def test_a_site_that_sends_motion_at_a_hundred_times_its_rate_is_heard_at_ten_times_and_the_others_as_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, limited: bool
) -> None:
    if not limited:
        monkeypatch.setattr(limits, "AT_ONCE_S", 1e9)

    async def body(s: Secured) -> None:
        owners = owners_of(TWO)
        listening = await s.door("tokyo", owners=owners)
        clock = SystemClock()
        heard = {"ann": 0, "ben": 0}
        subscription = listening.subscribe(MOTION, queue_all=True, polled=True)
        calm = await s.door("tokyo", tls=s.issue("tokyo"), owners=owners)
        ann = calm.publish(MOTION, participant="ann")
        paris = s.session("paris")
        message = Motion(frame=bytes(60))
        message.header.version = 1

        def take() -> None:
            for sample in subscription.take():
                heard[sample.names["participant"]] += 1

        while not heard["ann"]:
            ann.put(Motion(frame=b"ann"))
            await asyncio.sleep(0.02)
            take()
        begun_ns, sent, before = clock.now_ns(), 0, heard["ann"]
        for _ in range(60):
            ann.put(Motion(frame=b"ann"))
            for _ in range(100):
                message.header.t_ns, message.header.seq = clock.now_ns(), sent + 1
                paris.put(f"vistel/demo/site/paris/participant/ben/{'motion'}", message.SerializeToString())
                sent += 1
            await asyncio.sleep(0.01)
            take()

        def calm_is_heard() -> bool:
            """What may be lost on the way is sent until enough of it has come."""
            ann.put(Motion(frame=b"ann"))
            take()
            return heard["ann"] >= before + 50

        await until(calm_is_heard)
        lasted_s = (clock.now_ns() - begun_ns) * 1e-9
        may = AT_ONCE_S * MOTION.rate_hz + MOST_OFTEN * MOTION.rate_hz * lasted_s
        if limited:
            assert 0 < heard["ben"] <= may
            assert listening.counters.refused["motion"] > 0
        else:
            assert heard["ben"] > sent / 2

    secured(tmp_path, body)
    told = [r for r in caplog.records if "more than 10 times" in r.getMessage()]
    assert len(told) == int(limited), "one line"


@pytest.mark.parametrize("limited", [False, True], ids=["before", "now"])
def test_a_site_that_floods_the_recorder_fills_its_share_and_the_others_are_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, limited: bool
) -> None:
    monkeypatch.setattr(limits, "SITE_BYTES_AT_ONCE", 1e6 if limited else 1e12)
    monkeypatch.setattr(limits, "SITE_BYTES_S", 1e5)
    seconds = 20

    async def meet() -> None:
        clock, network = SimulatedClock(NOW_NS), MemoryNetwork()
        hub = network.bus("demo", "hub", clock, owners=owners_of(TWO))
        recorder = asyncio.create_task(run(Config(tmp_path / "conference.mcap", limits=Recording(keep_free=0.0)), hub, clock))
        said = {
            who: network.bus("demo", site, clock).publish(BY_NAME["device_raw"], device=f"{who}-tracker")
            for site, who in (("tokyo", "ann"), ("paris", "ben"))
        }
        for _ in range(seconds * 10):
            said["ann"].put(RawBytes(data=b"ann"))
            for _ in range(10):
                said["ben"].put(RawBytes(data=os.urandom(20_000)))
            await clock.advance_to_ns(clock.now_ns() + 100_000_000)
        recorder.cancel()
        with contextlib.suppress(OverflowedError):
            await asyncio.gather(recorder, return_exceptions=True)

    asyncio.run(meet())
    (log,) = tmp_path.glob("*.mcap")
    heard = [r.names["device"] for r in LogReader(log).records(("device_raw",))]
    assert heard.count("ann-tracker") == seconds * 10
    size = log.stat().st_size
    assert (size < 1e6 + seconds * 1e5 + 0.5e6) is limited, size
    told = [r.getMessage() for r in caplog.records if "event=site_not_recorded site=paris" in r.getMessage()]
    assert len(told) == int(limited)


ROUTER = """
import sys, time
from vistel.wire.zenoh.bus import Router
router = Router.open()
print(router.endpoint, flush=True)
sys.stdin.read()
router.close()
"""


def peak_mb(pid: int) -> int:
    """Of the memory that a process has asked for, used or not."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmPeak")).split()[1]) // 1024


MARK = bytes(range(100, 200))


async def announcing(router: tuple[str, int], seen: list[int]) -> asyncio.Server:
    """A way to a router on which a message with MARK says that it has a gigabyte; its own bytes go on being as many."""
    length = b"\x80\x80\x80\x80\x04"  # 2^30, as Zenoh writes numbers

    async def between(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, to = await asyncio.open_connection(*router)

        async def pass_on(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
            while data := await source.read(65536):
                at = data.find(MARK)
                if at > 0 and data[at - 1] == len(MARK):
                    seen.append(at)
                    data = data[: at - 1] + length + data[at - 1 + len(length) :]
                target.write(data)
                await target.drain()
            target.close()

        with contextlib.suppress(OSError):
            await asyncio.gather(pass_on(reader, to), pass_on(there, writer))

    return await asyncio.start_server(between, "127.0.0.1", 0)


def test_a_message_on_the_bus_that_announces_a_gigabyte_takes_none_of_the_router_and_others_are_heard() -> None:
    router = subprocess.Popen([sys.executable, "-c", ROUTER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert router.stdout is not None and router.stdin is not None
    endpoint = router.stdout.readline().strip()
    host, port = endpoint.removeprefix("tcp/").split(":")

    def session(to: str) -> zenoh.Session:
        return zenoh.open(zenoh.Config.from_json5(as_text(client_config([to]))))

    async def attack() -> None:
        seen: list[int] = []
        heard: list[bytes] = []
        between = await announcing((host, int(port)), seen)
        honest = await asyncio.to_thread(session, endpoint)
        subscriber = honest.declare_subscriber("a/*", lambda s: heard.append(s.payload.to_bytes()))
        attacker = await asyncio.to_thread(session, f"tcp/127.0.0.1:{between.sockets[0].getsockname()[1]}")
        while b"before" not in heard:
            attacker.put("a/b", b"before")
            await asyncio.sleep(0.05)
        before_mb = peak_mb(router.pid)
        while len(seen) < 5:
            attacker.put("a/b", MARK)
            await asyncio.sleep(0.05)
        other = await asyncio.to_thread(session, endpoint)
        while b"after" not in heard:
            other.put("a/b", b"after")
            await asyncio.sleep(0.05)
        assert peak_mb(router.pid) - before_mb < 512
        assert all(len(payload) <= len(MARK) for payload in heard)
        subscriber.undeclare()
        for s in (honest, attacker, other):
            await asyncio.to_thread(s.close)
        between.close()

    try:
        asyncio.run(attack())
    finally:
        router.stdin.close()
        router.wait()


def test_a_web_page_that_announces_a_gigabyte_is_closed_before_any_of_it_has_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = bytes([0x82, 0x80 | 127]) + struct.pack(">Q", GIB) + b"mask"

    async def play() -> None:
        async with GuestRoom(tmp_path, console=ConsoleConfig(at="127.0.0.1:0")).serving(monkeypatch) as room:
            for path in ("guest", "live"):
                async with aiohttp.ClientSession() as session, session.ws_connect(f"http://{room.address}/{path}") as socket:
                    link = socket._conn.transport  # type: ignore[union-attr]
                    link.write(frame)  # type: ignore[union-attr]
                    while not (said := await socket.receive()).type & aiohttp.WSMsgType.CLOSE:
                        assert said.type is not aiohttp.WSMsgType.ERROR
                    assert socket.close_code == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
            host, port = room.address.split(":")
            reader, writer = await asyncio.open_connection(host, int(port))
            writer.write(f"POST / HTTP/1.1\r\nHost: {room.address}\r\nContent-Length: {GIB}\r\n\r\n".encode())
            assert b" 4" in (await reader.readline())
            writer.close()
            async with room.opened(room.invited()) as page:
                await page.told("invited")

    asyncio.run(play())


@pytest.mark.parametrize("kind", [vrpn.SENDER, vrpn.TYPE, vrpn.UDP, vrpn.LOG, 0, 7])
@pytest.mark.parametrize("length", [GIB, 0xFFFFFFFF, 0x10FFFF])
def test_a_device_that_announces_a_gigabyte_is_waited_for_no_longer_than_for_a_message(kind: int, length: int) -> None:
    parser = vrpn.VrpnParser()
    parser.feed(vrpn.COOKIE, 1)
    header = struct.pack(">IIIii4x", length, 0, 0, 0, kind)
    for n in range(64):
        parser.feed(header + bytes(65_536 - len(header)), 2 + n)
        assert len(parser._buffer) < 8192, "what is kept until a message is whole"
    parser.feed(vrpn.describe(vrpn.SENDER, 0, "Tracker0"), 100)
    assert parser.devices == ("Tracker0",), "and what comes then is read"
