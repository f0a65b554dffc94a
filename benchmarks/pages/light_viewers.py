"""Many viewers of the console in one process: each receives all that a page receives, and decodes every frame to rotations.

python -m benchmarks.pages.light_viewers URL COUNT SECONDS prints one JSON object.
"""

import asyncio
import json
import struct
import sys
import time
from dataclasses import dataclass, field

import aiohttp
import numpy as np

from vistel.arrays import F64
from vistel.render.frames import BODY, FINGERS, FORMAT, HEADER, PERSON, THING

_BEGUN_S = 2.0
"""Until all are there, and have been told everything [s]."""


@dataclass
class Viewer:
    """What one has received. ages_ms: from the conference time of a frame to its arrival."""

    frames: int = 0
    people: int = 0
    bytes: int = 0
    ages_ms: list[float] = field(default_factory=list[float])


def rotations(frame: bytes) -> F64:
    """(people, joints, 4) quaternions (x, y, z, w) of a frame. Raises ValueError for what is none."""
    kind, _, _, count, things, _ = HEADER.unpack_from(frame)
    if kind != FORMAT or len(frame) != HEADER.size + count * PERSON.itemsize + things * THING.itemsize:
        raise ValueError("not a frame")
    people = np.frombuffer(frame, PERSON, count, HEADER.size)
    out = np.empty((count, len(BODY) + len(FINGERS), 4))
    body, fingers = people["body"].astype(np.int64), people["fingers"].astype(np.int64)
    _unpack(out, BODY, (body[..., 0] >> 15) | (body[..., 1] >> 15 << 1), body & 32767, 32767)
    parts = np.stack((fingers >> 20, fingers >> 10, fingers), axis=-1) & 1023
    _unpack(out, FINGERS, fingers >> 30, parts, 1023)
    return out


def _unpack(out: F64, joints: np.ndarray, missing: np.ndarray, parts: np.ndarray, most: int) -> None:
    three = (parts * 2.0 / most - 1.0) * np.sqrt(0.5)
    last = np.sqrt(np.maximum(0.0, 1.0 - (three**2).sum(axis=-1)))
    whole = np.empty((*parts.shape[:-1], 4))
    for k in range(4):
        at = missing == k
        whole[at] = np.insert(three[at], k, 0.0, axis=-1)
        whole[at, k] = last[at]
    out[:, joints] = whole


async def _watch(session: aiohttp.ClientSession, url: str, begin_s: float, end_s: float) -> Viewer:
    out = Viewer()
    async with session.ws_connect(f"{url}live", max_msg_size=0) as live:
        while (left := end_s - time.monotonic()) > 0:
            try:
                said = await live.receive(timeout=left)
            except TimeoutError:
                break
            if said.type in (aiohttp.WSMsgType.CLOSED, aiohttp.WSMsgType.ERROR):
                raise RuntimeError("the gateway closed a viewer's connection")
            if said.type is not aiohttp.WSMsgType.BINARY or time.monotonic() < begin_s:
                continue
            found = rotations(said.data)
            out.frames, out.people, out.bytes = out.frames + 1, len(found), out.bytes + len(said.data)
            out.ages_ms.append(time.time_ns() * 1e-6 - struct.unpack_from("<d", said.data, 8)[0])
    return out


async def _all(url: str, count: int, seconds: float) -> dict[str, float]:
    begin_s = time.monotonic() + _BEGUN_S
    used: list[float] = []
    asyncio.get_running_loop().call_later(_BEGUN_S, lambda: used.append(time.process_time()))
    async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=0)) as session:
        viewers = await asyncio.gather(*(_watch(session, url, begin_s, begin_s + seconds) for _ in range(count)))
    share = (time.process_time() - used[0]) / seconds
    ages = np.concatenate([v.ages_ms for v in viewers])
    rates = [v.frames / seconds for v in viewers]
    kbit = 8e-3 * float(np.mean([v.bytes for v in viewers])) / seconds
    return {
        "frames_per_s": float(np.median(rates)),
        "least_per_s": min(rates),
        "people": min(v.people for v in viewers),
        "age_p95_ms": float(np.percentile(ages, 95)),
        "kbit_s": kbit,
        "load": share,
    }


if __name__ == "__main__":
    print(json.dumps(asyncio.run(_all(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))))
