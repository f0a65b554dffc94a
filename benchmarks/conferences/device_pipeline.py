"""From a device's last byte to a posed figure at another site: simulated devices, real processes, one machine.

One process simulates a FASTRAK and two CyberGloves at their ports, one is the site's capture process, this one is the
other site. A motion's capture time names the record it was solved from; that record's last byte was read when the raw
bytes round `capture + device latency + transmission` were, which the capture process publishes with their times.
"""

import asyncio
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.row import NONE_AT_ALL, Row, at_most
from vistel.conference.files import text_of
from vistel.conference.model import Conference
from vistel.figure.posture.posture import Posture, Stance, pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.motion import MotionDecoder
from vistel.wire.raw_bytes import reads_of
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus

SECONDS, SETTLE_S = 15.0, 4.0
DEVICE_LATENCY_NS = 3_750_000
"""FASTRAK's own, from measurement to its output buffer (its manual, E-4)."""
TRANSMISSION_NS = 33 * 10 * 1_000_000_000 // 115_200
"""33 bytes of ten bits."""
NEAR_NS = 4_000_000


def rows() -> Iterator[Row]:
    """Latency of the whole path, and what was lost on it."""
    latencies_ms, lost, reordered = event_loop.run(_measure())
    case = "last device byte to pose at another site"
    for q, limit in ((50, 5.0), (99, 25.0)):
        value = float(np.percentile(latencies_ms, q))
        yield Row("pipeline", case, f"latency p{q}", "ms", value, target=at_most(limit))
    for what, n in (("lost", lost), ("reordered", reordered)):
        yield Row("pipeline", case, f"frames {what}", "frames", n, target=NONE_AT_ALL)


def _conference() -> Conference:
    person = {"name": "ada"}
    return Conference.model_validate({"name": "bench", "sites": [{"name": "a", "participants": [person]}]})


async def _measure() -> tuple[list[float], int, int]:
    router = Router.open()
    clock = SystemClock()
    bus = await ZenohBus.open(conference="bench", site="b", clock=clock, endpoints=[router.endpoint])
    serve_clock(bus, clock)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "conference.toml"
        file.write_text(text_of(_conference()))
        sim = [sys.executable, "-m", "vistel_sim.process", str(file), "--run", folder]
        host = [
            sys.executable,
            "-m",
            "vistel_services.process.host",
            str(file),
            "a/capture",
            "--hub",
            router.endpoint,
            "--run",
            folder,
            "--out",
            folder,
            "--log-level",
            "ERROR",
        ]
        children = [subprocess.Popen(c, stderr=subprocess.DEVNULL) for c in (sim, host)]
        try:
            return await _listen(bus, clock)
        finally:
            for child in children:
                child.terminate()
            for child in children:
                child.wait(15)
            await bus.close()
            router.close()


async def _listen(bus: ZenohBus, clock: SystemClock) -> tuple[list[float], int, int]:
    motions = bus.subscribe(BY_NAME["motion"], queue_all=True)
    raw = bus.subscribe(BY_NAME["device_raw"], device="ada-tracker")
    read_ns: list[int] = []
    posed: list[tuple[int, int, int]] = []
    decoder, skeleton = MotionDecoder(), standard_skeleton()

    async def pose() -> None:
        async for sample in motions:
            motion = decoder.decode(sample.message)
            if motion is None:
                continue
            stance = Stance(motion.stance[:3], float(motion.stance[3]))
            pose_joints(skeleton, Posture(motion.body, motion.hands, stance))
            posed.append((motion.seq, motion.t_ns, clock.now_ns()))

    async def note_reads() -> None:
        async for sample in raw:
            read_ns.extend(t_ns for t_ns, _ in reads_of(sample.message))

    tasks = [asyncio.create_task(pose()), asyncio.create_task(note_reads())]
    async with asyncio.timeout(60):
        while not posed:
            await asyncio.sleep(0.1)
    await asyncio.sleep(SETTLE_S)  # clocks agree, kernels are loaded
    posed.clear()
    await asyncio.sleep(SECONDS)
    for task in tasks:
        task.cancel()
    reads = np.array(sorted(read_ns))
    latencies: list[float] = []
    for _, t_ns, done_ns in posed:
        due = t_ns + DEVICE_LATENCY_NS + TRANSMISSION_NS
        nearest = int(reads[np.abs(reads - due).argmin()])
        if abs(nearest - due) < NEAR_NS:
            latencies.append((done_ns - nearest) * 1e-6)
    steps = np.diff([seq for seq, _, _ in posed])
    return latencies, int((steps[steps > 1] - 1).sum()), int((steps <= 0).sum())
