"""A site behind a thin uplink: real capture and audio processes with simulated devices send over a simulated link to a real router.

What arrives at the hub is measured before the link gets thin, while it is, and after it is wide again.
"""

import asyncio
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.progress import part
from benchmarks.row import Row, at_most
from benchmarks.wire.linked_sites import linked_sites
from vistel.wire.clock import SystemClock
from vistel.wire.inbox import Inbox
from vistel.wire.topics import BY_NAME
from vistel_sim.network import Conditions, DatagramProxy, StreamProxy

DELAY_S = 0.050
WIDE, THIN = Conditions(DELAY_S), Conditions(DELAY_S, bits_per_s=64_000)
THIN_S = 10.0
"""The link gets thin so long after everything runs [s]."""
SETTLED_S = 40.0
"""From here on what is received over the thin link is measured [s]."""
WIDE_S = 70.0
"""The link is wide again [s]."""
END_S = 115.0
CASE = "64 kbit/s up"
SECTIONS = """
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "ann"
[sites.audio]
loudspeaker = "none"
[[sites]]
name = "paris"
[[sites.participants]]
name = "ben"
"""
"""Nobody talks alone; what paris does is not sent."""
TOPICS = ("motion", "voice", "tracker", "glove", "device_raw")
"""What a recorder takes, too: all that a site sends often."""


@dataclass
class Arrived:
    """Of one topic: when each message was received and how old it was, both in seconds, and its number."""

    at_s: np.ndarray
    age_s: np.ndarray
    seq: np.ndarray

    def between(self, begin_s: float, end_s: float) -> "Arrived":
        """What was received in that time."""
        chosen = (self.at_s >= begin_s) & (self.at_s < end_s)
        return Arrived(self.at_s[chosen], self.age_s[chosen], self.seq[chosen])

    @property
    def lost(self) -> float:
        """The part of the messages that did not arrive."""
        return 1.0 - len(self.seq) / (self.seq.max() - self.seq.min() + 1) if len(self.seq) else 1.0


def rows() -> Iterator[Row]:
    """Motion first, voice next: what arrives over 64 kbit/s, and how soon all is back; beside it, what arrives without adapting."""
    ours, theirs = (asyncio.run(measure(adapts=adapts)) for adapts in (True, False))
    for topic, (median, p99) in {"motion": (60.0, 110.0), "voice": (None, None)}.items():
        for name, percent, limit in (("median", 50, median), ("p99", 99, p99)):
            ages = (_percentile_ms(seen[topic].between(SETTLED_S, WIDE_S), percent) for seen in (ours, theirs))
            target = None if limit is None else at_most(limit)
            yield Row("apart", CASE, f"{topic} received, beyond one way, {name}", "ms", *_against(ages), target=target)
    rates = (len(seen["motion"].between(SETTLED_S, WIDE_S).at_s) / (WIDE_S - SETTLED_S) for seen in (ours, theirs))
    yield Row("apart", CASE, "motion received", "frames/s", *_against(rates))
    lost = (100.0 * seen["voice"].between(SETTLED_S, WIDE_S).lost for seen in (ours, theirs))
    yield Row("apart", CASE, "messages of voices lost", "%", *_against(lost))
    yield Row("apart", CASE, "fresh motion after the link got thin", "s", *_against(_fresh_s(seen) for seen in (ours, theirs)))
    for topic in ("motion", "tracker"):
        back = (_back_s(seen[topic]) for seen in (ours, theirs))
        yield Row("apart", CASE, f"{topic}: all frames after the link got wide", "s", *_against(back))


def _against(values: Iterable[float]) -> tuple[float, str, float]:
    ours, theirs = values
    return float(ours), "not adapting", float(theirs)


def _percentile_ms(arrived: Arrived, percent: float) -> float:
    return 1e3 * (float(np.percentile(arrived.age_s, percent)) - DELAY_S) if len(arrived.at_s) else np.inf


def _fresh_s(seen: dict[str, Arrived]) -> float:
    """From when the link got thin until no motion is older than half a second for 5 s; infinite: never."""
    motion = seen["motion"].between(THIN_S, WIDE_S)
    for begin_s in np.arange(THIN_S, WIDE_S - 5.0, 0.1):
        now = motion.between(begin_s, begin_s + 5.0)
        if len(now.at_s) > 25 and now.age_s.max() < 0.5 + DELAY_S:
            return begin_s - THIN_S
    return np.inf


def _back_s(arrived: Arrived) -> float:
    """From when the link got wide until as many frames are received in a second as before it got thin; infinite: never."""
    before = len(arrived.between(0.0, THIN_S).at_s) / THIN_S
    for begin_s in np.arange(WIDE_S, END_S - 1.0, 0.1):
        now = arrived.between(begin_s, begin_s + 1.0)
        if len(now.at_s) >= 0.95 * before and now.age_s.max() < 0.5 + DELAY_S:
            return begin_s - WIDE_S
    return np.inf


async def measure(protocol: str = "quic", *, adapts: bool) -> dict[str, Arrived]:
    """What arrives at the hub, by topic; times are from when everything runs."""
    clock = SystemClock()
    async with linked_sites(SECTIONS, ["tokyo"], ["tokyo/capture"], WIDE, clock, protocol, adapts=adapts) as there:
        inboxes = {t: there.observer.subscribe(BY_NAME[t], queue_all=True) for t in TOPICS}
        return await _phases(inboxes, there.links["tokyo"], clock)


async def _phases(inboxes: dict[str, Inbox], link: DatagramProxy | StreamProxy, clock: SystemClock) -> dict[str, Arrived]:
    found: dict[str, list[tuple[float, float, int]]] = {topic: [] for topic in inboxes}
    begun_ns = clock.now_ns()

    async def listen(seconds: float) -> None:
        until_ns = clock.now_ns() + round(seconds * 1e9)
        while clock.now_ns() < until_ns:
            await asyncio.sleep(0.05)
            for topic, inbox in inboxes.items():
                for s in inbox.take():
                    age_s = (s.received_ns - s.message.header.t_ns) * 1e-9
                    found[topic].append(((s.received_ns - begun_ns) * 1e-9, age_s, s.message.header.seq))

    async with asyncio.timeout(120):
        while not (found["motion"] and found["voice"]):
            await listen(0.5)
    await listen(5.0)
    for of_topic in found.values():
        of_topic.clear()
    begun_ns = clock.now_ns()
    with part(CASE, 3) as done:
        await listen(THIN_S)
        done()
        link.change(THIN, "up")
        await listen(WIDE_S - THIN_S)
        done()
        link.change(WIDE, "up")
        await listen(END_S - WIDE_S)
        done()
    return {t: Arrived(*(np.array(c) for c in zip(*rows, strict=True))) for t, rows in found.items() if rows}
