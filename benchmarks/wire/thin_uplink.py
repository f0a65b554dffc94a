"""A site behind a thin uplink: real capture and audio processes with simulated devices send over a simulated link to a real router.

What arrives at the hub is measured before the link gets thin, while it is, and after it is wide again.
"""

import asyncio
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.progress import part
from benchmarks.row import Row, at_least, at_most
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.inbox import Inbox
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.endpoints import free_port
from vistel_sim.network import Conditions, DatagramProxy

DELAY_S = 0.050
WIDE, THIN = Conditions(DELAY_S), Conditions(DELAY_S, bits_per_s=64_000)
BEFORE_S, THIN_S, AFTER_S = 10.0, 60.0, 60.0
SETTLED_S = 30.0
"""So long after a change the new rates are measured."""
FILE = """
name = "thin"
record = false
standby = false
[bus]
mode = "routed"
endpoints = ["quic/127.0.0.1:{port}"]
tls = {{ folder = "certificates" }}
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "ann"
[sites.audio]
loudspeaker = "none"
[[sites]]
name = "paris"
[[sites.participants]]
name = "bea"
program = true
"""
TOPICS = ("motion", "voice", "tracker", "glove", "device_raw")
"""What a recorder takes, too: all that a site sends often."""


@dataclass
class Arrived:
    """Of one topic: when each message was received and how old it was, both in seconds, and the frames that it brought."""

    at_s: np.ndarray
    age_s: np.ndarray
    frames: np.ndarray

    def between(self, begin_s: float, end_s: float) -> "Arrived":
        """What was received in that time."""
        chosen = (self.at_s >= begin_s) & (self.at_s < end_s)
        return Arrived(self.at_s[chosen], self.age_s[chosen], self.frames[chosen])


def rows() -> Iterator[Row]:
    """Motion first, voice next: what arrives over 64 kbit/s, and how soon all is back."""
    seen = asyncio.run(measure())
    thin_s = BEFORE_S
    wide_s = thin_s + THIN_S
    case = "64 kbit/s up"
    for name, part_ in (("median", 50), ("p99", 99)):
        ages = seen["motion"].between(thin_s + SETTLED_S, wide_s).age_s - DELAY_S
        limit = at_most({50: 60.0, 99: 110.0}[part_])
        value = float(np.percentile(ages, part_)) * 1e3 if len(ages) else np.inf
        yield Row("apart", case, f"motion at the hub, beyond one way, {name}", "ms", value, target=limit)
    for topic, kept in (("motion", None), ("voice", at_least(0.98))):
        before, during, after = (
            float(seen[topic].between(a, b).frames.sum()) / (b - a)
            for a, b in ((0.0, thin_s), (thin_s + SETTLED_S, wide_s), (wide_s + SETTLED_S, wide_s + AFTER_S))
        )
        yield Row("apart", case, f"{topic}: frames a second before", "1/s", before)
        yield Row("apart", case, f"{topic}: of these while thin", "", during / before, target=kept)
        yield Row("apart", case, f"{topic}: of these after", "", after / before, target=at_least(0.95))


async def measure() -> dict[str, Arrived]:
    """What arrives at the hub, by topic; times are from when everything runs."""
    with tempfile.TemporaryDirectory() as text:
        folder, port = Path(text), free_port("quic")
        authority = Authority.create(folder / "certificates", datetime.now(UTC))
        names = {n: authority.issue(n, datetime.now(UTC), hosts=["127.0.0.1", "localhost"]) for n in ("hub", "tokyo", "paris")}
        rules = access_rules("thin", ["tokyo", "paris"])
        router = Router.open(f"quic/127.0.0.1:{port}", tls=names["hub"], access=rules)
        async with DatagramProxy.open(("127.0.0.1", port), WIDE, random.Random(1)) as link:
            clock, endpoints = SystemClock(), [f"quic/127.0.0.1:{port}"]
            hub, paris = [
                await ZenohBus.open(
                    conference="thin", site=site, clock=clock, endpoints=endpoints, tls=names[site], stale_after_ns=None
                )
                for site in ("hub", "paris")
            ]
            serve_clock(hub, clock)
            file = folder / "thin.toml"
            file.write_text(FILE.format(port=link.port))
            children = [subprocess.Popen(c, stderr=sys.stderr) for c in _commands(file, link.port)]
            try:
                return await _phases({t: paris.subscribe(BY_NAME[t], queue_all=True) for t in TOPICS}, link, clock)
            finally:
                for child in children:
                    child.terminate()
                for child in children:
                    child.wait(20)
                await asyncio.gather(hub.close(), paris.close())
                router.close()


def _commands(file: Path, port: int) -> Iterator[list[str]]:
    folder = str(file.parent)
    yield [sys.executable, "-m", "vistel_sim.process", str(file), "--run", folder, "--site", "tokyo"]
    host = [sys.executable, "-m", "vistel_services.process.host", str(file), "tokyo/capture"]
    yield [*host, "--hub", f"quic/127.0.0.1:{port}", "--run", folder, "--out", folder, "--measure-uplink"]


async def _phases(inboxes: dict[str, Inbox], link: DatagramProxy, clock: SystemClock) -> dict[str, Arrived]:
    found: dict[str, list[tuple[float, float, int]]] = {topic: [] for topic in inboxes}
    begun_ns = clock.now_ns()

    async def listen(seconds: float) -> None:
        until_ns = clock.now_ns() + round(seconds * 1e9)
        while clock.now_ns() < until_ns:
            await asyncio.sleep(0.05)
            for topic, inbox in inboxes.items():
                for s in inbox.take():
                    age_s = (s.received_ns - s.message.header.t_ns) * 1e-9
                    found[topic].append(((s.received_ns - begun_ns) * 1e-9, age_s, 1 + _earlier(topic, s.message)))

    async with asyncio.timeout(120):
        while not (found["motion"] and found["voice"]):
            await listen(0.5)
    await listen(5.0)
    for of_topic in found.values():
        of_topic.clear()
    begun_ns = clock.now_ns()
    with part("64 kbit/s", 3) as done:
        await listen(BEFORE_S)
        done()
        link.change(THIN, "up")
        await listen(THIN_S)
        done()
        link.change(WIDE, "up")
        await listen(AFTER_S)
        done()
    return {t: Arrived(*(np.array(c) for c in zip(*rows, strict=True))) for t, rows in found.items() if rows}


def _earlier(topic: str, message: Any) -> int:
    """Further frames that a message brings for the first time; where each is sent twice, none."""
    return len(message.earlier) if topic == "voice" and len(message.earlier) > 1 else 0
