"""The bus beside raw Zenoh, from one process to another; and from a device's last byte to a figure at another site.

Both send the same bytes to the same router by turns: raw Zenoh from `put` to its callback, our bus from `put` with a message to the
`async for` of a service. Times are of the machine's monotonic clock, which its processes share.
"""

import argparse
import asyncio
import contextlib
import importlib.metadata
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import zenoh

from benchmarks.conferences.device_pipeline import rows as device_rows
from benchmarks.row import NONE_AT_ALL, Row, ratio_at_least, ratio_at_most
from vistel.v1.motion_pb2 import Motion
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.config import as_text, client_config

STREAMS, RATE_HZ, BLOCK_S, ROUNDS = 10, 60, 2.0, 4
BURST = 20_000
MOTION = BY_NAME["motion"]


def run() -> Iterator[Row]:
    yield from device_rows()
    yield from bus_rows()


def bus_rows() -> Iterator[Row]:
    """The bus alone."""
    peer = f"eclipse-zenoh {importlib.metadata.version('eclipse-zenoh')}"
    router = Router.open()
    try:
        result = _measure(router.endpoint)
    finally:
        router.close()
    case = f"{STREAMS} streams of {RATE_HZ} Hz, routed"
    ours, raw = result["ours_us"], result["raw_us"]
    for q, most in ((50, 1.5), (99, 2.0)):
        a = statistics.median(float(np.percentile(b, q)) for b in ours)
        b = statistics.median(float(np.percentile(b, q)) for b in raw)
        yield Row("pipeline", case, f"publish to handler p{q}", "us", a, peer, b, target=ratio_at_most(most))
    for what in ("lost", "reordered"):
        n = result[what]
        yield Row("pipeline", case, f"messages {what}", "messages", n, target=NONE_AT_ALL)
    a, b = statistics.median(result["ours_per_s"]), statistics.median(result["raw_per_s"])
    yield Row(
        "pipeline",
        "one publisher as fast as it can, every message kept",
        "throughput",
        "messages/s",
        a,
        peer,
        b,
        target=ratio_at_least(0.5),
    )


def _measure(endpoint: str) -> dict[str, Any]:
    with contextlib.ExitStack() as stack:
        reader, writer = (
            stack.enter_context(
                subprocess.Popen(
                    [sys.executable, "-m", "benchmarks.conferences.bench_pipeline", role, endpoint],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
            for role in ("read", "write")
        )
        for child in (reader, writer):
            _line(child)
        # Alternate, so that whatever else the machine does falls on both.
        for _ in range(ROUNDS):
            for kind in ("raw", "ours"):
                _tell(writer, f"{kind} steady")
                _line(writer)
                _tell(reader, f"{kind} steady")
                _line(reader)
        for _ in range(3):
            for kind in ("raw", "ours"):
                _tell(reader, f"{kind} burst")
                _line(reader)
                _tell(writer, f"{kind} burst")
                _line(writer)
                _tell(reader, "done")
                _line(reader)
        _tell(writer, "end")
        _tell(reader, "end")
        return json.loads(_line(reader))


def _tell(child: subprocess.Popen[str], word: str) -> None:
    assert child.stdin is not None
    child.stdin.write(word + "\n")
    child.stdin.flush()


def _line(child: subprocess.Popen[str]) -> str:
    assert child.stdout is not None
    line = child.stdout.readline()
    if not line:
        raise RuntimeError("a process of the benchmark has ended")
    return line


def _motion(i: int) -> Motion:
    message = Motion(key_seq=1, body=[(i + k) % 120 - 60 for k in range(25)], hands=[k % 50 - 25 for k in range(40)])
    message.header.t_ns = time.monotonic_ns()
    return message


async def _write(endpoint: str) -> None:
    bus = await ZenohBus.open(conference="bench", site="a", clock=SystemClock(), endpoints=[endpoint])
    ours = [bus.publish(MOTION, participant=f"p{n}") for n in range(STREAMS)]
    session = zenoh.open(zenoh.Config.from_json5(as_text(client_config([endpoint]))))
    raw = [session.declare_publisher(f"raw/p{n}", congestion_control=zenoh.CongestionControl.DROP) for n in range(STREAMS)]
    size = len(_motion(0).SerializeToString()) + 4
    loop = asyncio.get_running_loop()
    seq = 0

    def put(kind: str, n: int) -> None:
        nonlocal seq
        seq += 1
        if kind == "raw":
            raw[n].put(seq.to_bytes(8, "little") + time.monotonic_ns().to_bytes(8, "little") + bytes(size - 16))
        else:
            ours[n].put(_motion(seq))

    print("ready", flush=True)
    await asyncio.sleep(0.3)
    while (command := await loop.run_in_executor(None, sys.stdin.readline)).strip() not in ("", "end"):
        kind, what = command.split()
        if what == "steady":
            start, i = time.monotonic(), 0
            while i < BLOCK_S * RATE_HZ * STREAMS:
                put(kind, i % STREAMS)
                i += 1
                await asyncio.sleep(max(0.0, start + i / (RATE_HZ * STREAMS) - time.monotonic()))
        else:
            ready = _motion(0)  # the time of a protobuf object's making is not the bus's
            for i in range(BURST):
                if kind == "raw":
                    put(kind, 0)
                else:
                    ours[0].put(ready)
                if i % 200 == 0:  # about as fast as one reader can take
                    time.sleep(0.0005)
        await asyncio.sleep(0.3)
        print("sent", flush=True)
    await bus.close()
    session.close()


async def _read(endpoint: str) -> None:
    result: dict[str, Any] = {"ours_us": [], "raw_us": [], "ours_per_s": [], "raw_per_s": [], "lost": 0, "reordered": 0}
    raw: list[tuple[int, int]] = []
    ours: list[tuple[str, int, int]] = []
    session = zenoh.open(zenoh.Config.from_json5(as_text(client_config([endpoint]))))

    def arrived(sample: zenoh.Sample) -> None:
        payload = sample.payload.to_bytes()
        raw.append((int.from_bytes(payload[8:16], "little"), time.monotonic_ns()))

    session.declare_subscriber("raw/*", arrived)
    bus = await ZenohBus.open(conference="bench", site="b", clock=SystemClock(), endpoints=[endpoint])
    loop = asyncio.get_running_loop()

    async def read() -> None:
        async for sample in bus.subscribe(MOTION, queue_all=True):
            header = sample.message.header
            ours.append((sample.key, header.seq, header.t_ns))
            stamps.append(time.monotonic_ns())

    stamps: list[int] = []
    reading = asyncio.create_task(read())
    print("ready", flush=True)
    last: dict[str, int] = {}
    while (command := await loop.run_in_executor(None, sys.stdin.readline)).strip() not in ("", "end"):
        if command.strip().endswith("burst"):
            raw.clear()
            ours.clear()
            stamps.clear()
            print("listening", flush=True)
            await loop.run_in_executor(None, sys.stdin.readline)
            kind = command.split()[0]
            at = [t for _, t in raw] if kind == "raw" else stamps
            result[f"{kind}_per_s"].append((len(at) - 1) / ((at[-1] - at[0]) * 1e-9))
            last.clear()
        elif command.split()[0] == "raw":
            result["raw_us"].append([(t - sent) / 1000 for sent, t in raw])
        else:
            result["ours_us"].append([(t - sent) / 1000 for (_, _, sent), t in zip(ours, stamps, strict=True)])
            for key, seq, _ in ours:
                before = last.get(key)
                if before is not None:
                    result["lost"] += max(0, seq - before - 1)
                    result["reordered"] += seq <= before
                last[key] = seq
        raw.clear()
        ours.clear()
        stamps.clear()
        print("noted", flush=True)
    print(json.dumps(result), flush=True)
    reading.cancel()
    await bus.close()
    session.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("role", choices=["read", "write"])
    parser.add_argument("endpoint")
    args = parser.parse_args()
    event_loop.run((_read if args.role == "read" else _write)(args.endpoint))
