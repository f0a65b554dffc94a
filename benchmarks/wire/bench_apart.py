"""Sites apart: motion from one site to another over a simulated link, through a router with certificates, as TLS and QUIC carry it.

Motion is published sixty times a second, crosses a real router over real sockets, and is drawn from a real playout. Delay is that
of the pose that is drawn, beyond the shortest one-way delay of the link.
"""

import asyncio
import contextlib
import random
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from benchmarks.row import Row, at_most
from benchmarks.wire import thin_uplink, whole_sites
from vistel.conference.model import Conference
from vistel.figure.posture.posture import Posture
from vistel.render.stage.stage import Stage
from vistel.v1.motion_pb2 import Participant
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.endpoints import free_port
from vistel_sim.motion import open_motion
from vistel_sim.network import Conditions, DatagramProxy, StreamProxy

SECONDS = 20.0
SETTLED_S = 3.0
"""Drawn pictures before this are not counted."""
CUTS_S = (10.0, 10.3, 9.6, 10.7, 9.9)
HEALED_S = 6.0
"""From the end of a cut to the next one."""
RATE_HZ = 60
DELAY_S, JITTER_S, LOSS = 0.050, 0.050, 0.05
PLAYOUT_NS = 100_000_000
LINKS = {
    "50 ms one way": Conditions(DELAY_S),
    "50 ms one way, 50 ms jitter": Conditions(DELAY_S, JITTER_S),
    "50 ms one way, 50 ms jitter, 5 % loss": Conditions(DELAY_S, JITTER_S, LOSS),
}
MEDIAN_MS, P99_MS, FRESH_S = 60.0, 110.0, 0.5


@dataclass
class _Seen:
    """Of each picture: when it was drawn, how old the pose in it is [s], and how old the newest frame that has arrived. And when
    the link healed."""

    at_s: list[float] = field(default_factory=list)
    delay_s: list[float] = field(default_factory=list)
    age_s: list[float] = field(default_factory=list)
    healed_s: list[float] = field(default_factory=list)


def run() -> Iterator[Row]:
    for case, conditions in LINKS.items():
        tls, quic = (asyncio.run(_meeting(protocol, conditions)) for protocol in ("tls", "quic"))
        limits = (MEDIAN_MS, P99_MS) if conditions.loss else (None, None)
        for (metric, part), limit in zip((("median", 50), ("p99", 99)), limits, strict=True):
            ours, theirs = (1e3 * (np.percentile(_settled(s), part) - conditions.delay_s) for s in (quic, tls))
            target = None if limit is None else at_most(limit)
            name = f"pose at the draw call, beyond one way, {metric}"
            yield Row("apart", case, name, "ms", float(ours), "TLS", float(theirs), target=target)
    case = f"{len(CUTS_S)} cuts of {min(CUTS_S):g} to {max(CUTS_S):g} s, 50 ms one way"
    tls, quic = (asyncio.run(_meeting(protocol, Conditions(DELAY_S), cuts=CUTS_S)) for protocol in ("tls", "quic"))
    for metric, of in (("median", np.median), ("longest", np.max)):
        ours, theirs = (float(of(_fresh_after_s(s))) for s in (quic, tls))
        yield Row("apart", case, f"fresh motion after it healed, {metric}", "s", ours, "TLS", theirs, target=at_most(FRESH_S))
    yield from thin_uplink.rows()
    yield from whole_sites.rows()


def _settled(seen: _Seen) -> np.ndarray:
    return np.array(seen.delay_s)[np.array(seen.at_s) > SETTLED_S]


def _fresh_after_s(seen: _Seen) -> list[float]:
    """From each moment at which the link healed until a picture shows motion that is newer."""
    at_s, newest_s = np.array(seen.at_s), np.array(seen.at_s) - np.array(seen.age_s)
    return [float(np.min(at_s[newest_s > h], initial=np.inf) - h) for h in seen.healed_s]


async def _meeting(protocol: str, conditions: Conditions, *, cuts: Sequence[float] = ()) -> _Seen:
    """Pictures that paris draws of a person in tokyo, whose link to the router is `conditions`; cuts: how long it is cut [s]."""
    with tempfile.TemporaryDirectory() as folder:
        authority = Authority.create(Path(folder), datetime.now(UTC))
        names = {n: authority.issue(n, datetime.now(UTC), hosts=["127.0.0.1", "localhost"]) for n in ("hub", "tokyo", "paris")}
        port = free_port(protocol)
        rules = access_rules("apart", ["tokyo", "paris"])
        router = Router.open(f"{protocol}/127.0.0.1:{port}", tls=names["hub"], access=rules)
        proxy = DatagramProxy if protocol == "quic" else StreamProxy
        async with proxy.open(("127.0.0.1", port), conditions, random.Random(1)) as link:
            clock = SystemClock()
            tokyo, paris = [
                await ZenohBus.open(
                    conference="apart",
                    site=site,
                    clock=clock,
                    endpoints=[f"{protocol}/127.0.0.1:{at}"],
                    tls=names[site],
                    connect_s=20.0,
                    stale_after_ns=None,
                )
                for site, at in (("tokyo", link.port), ("paris", port))
            ]
            seen, begun_ns = _Seen(), clock.now_ns()
            moving = asyncio.ensure_future(_move(tokyo, clock))
            drawing = asyncio.ensure_future(_draw(paris, clock, seen, begun_ns))
            await asyncio.sleep(SETTLED_S if cuts else SECONDS)
            for cut_s in cuts:
                link.cut()
                await asyncio.sleep(cut_s)
                link.heal()
                seen.healed_s.append((clock.now_ns() - begun_ns) * 1e-9)
                await asyncio.sleep(HEALED_S)
            for task in (moving, drawing):
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await task
            await asyncio.gather(tokyo.close(), paris.close())
        router.close()
        return seen


async def _move(bus: ZenohBus, clock: SystemClock) -> None:
    source = open_motion(Conference.model_validate({"sites": [{"name": "tokyo", "participants": [{"name": "ann"}]}]}))
    bus.publish(BY_NAME["participant"], participant="ann").put(Participant(participant="ann", height_m=1.7))
    publication = bus.publish(BY_NAME["motion"], participant="ann")
    encoder = MotionEncoder(losses="many", repeats=2)
    begun_ns = clock.now_ns()
    for number in range(1, 1_000_000):
        t_ns = begun_ns + number * 1_000_000_000 // RATE_HZ
        await asyncio.sleep(max(0.0, (t_ns - clock.now_ns()) * 1e-9))
        posture = source.posture("ann", number / RATE_HZ)
        publication.put(encoder.encode(_sample(number, clock.now_ns(), posture)))


def _sample(number: int, t_ns: int, posture: Posture) -> MotionSample:
    stance = np.append(posture.stance.position, posture.stance.heading)
    return MotionSample(number, t_ns, posture.dofs, posture.hands, stance, posture.gaze)


async def _draw(bus: ZenohBus, clock: SystemClock, seen: _Seen, begun_ns: int) -> None:
    stage = Stage(PLAYOUT_NS)
    stage.receive_participant(Participant(participant="ann", height_m=1.7))
    moved = bus.subscribe(BY_NAME["motion"], queue_all=True)
    while True:
        await asyncio.sleep(1.0 / RATE_HZ)
        for sample in moved.take():
            stage.receive_motion("ann", sample.message, sample.received_ns)
        now_ns = clock.now_ns()
        for person in stage.instant(now_ns).people:
            seen.at_s.append((now_ns - begun_ns) * 1e-9)
            seen.delay_s.append(person.timing.delay_ns * 1e-9)
            seen.age_s.append(person.timing.age_ns * 1e-9)
