"""Logs: reading them beside mcap's own reader, a slice of an hour, size beside JSON, and how fast a log is computed anew."""

import resource
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import version
from pathlib import Path

from google.protobuf.json_format import MessageToJson
from mcap.reader import make_reader

import vistel.log
from benchmarks.logs.long_log import MEETING, long_log
from benchmarks.progress import part
from benchmarks.row import Row, at_least, at_most, ratio_at_least
from vistel.conference.model import Conference
from vistel.wire.log import LogReader
from vistel.wire.topics import BY_NAME
from vistel_cli.log.fast import replay_fast
from vistel_services import posture, world

PEER = f"mcap {version('mcap')}"
RUNS = 5
"""Measured so often in turn; medians count."""
MINUTE_S, HOUR_S = 60.0, 3600.0
WANTED_HZ = 20_000.0
"""Messages a second that a program is to read."""
SLICE_S = 1.0
"""A slice of an hour is to be there within so long [s]."""
REAL_TIME = 10.0
"""Times real time at which a log is to be computed anew."""


def run() -> Iterator[Row]:
    """One row after the other."""
    with tempfile.TemporaryDirectory() as folder:
        with part("writing an hour"):
            minute, hour = (long_log(Path(folder) / f"{s:.0f}.mcap", s) for s in (MINUTE_S, HOUR_S))
        yield from _reading(minute)
        yield from _slices(hour)
        yield from _sizes(minute)
        yield from _computed(Path(folder))


def _reading(path: Path) -> Iterator[Row]:
    """Processor time: other work may keep the cores busy."""
    ways: dict[str, Callable[[], int]] = {
        "messages": lambda: sum(1 for _ in vistel.log.open(path).messages()),
        "postures": lambda: sum(1 for _ in vistel.log.open(path).postures("ben")),
        "raw": partial(_raw, path),
        "decoded": partial(_decoded, path),
    }
    rates: dict[str, list[float]] = {name: [] for name in ways}
    with part("reading"):
        for _ in range(RUNS):
            for name, read in ways.items():
                begun = time.process_time()
                count = read()
                rates[name].append(count / (time.process_time() - begun))
    ours, postures, raw, decoded = (statistics.median(rates[name]) for name in ways)
    at = "a minute of two people, processor time"
    yield Row("logs", at, "messages, decoded", "1/s", ours, f"{PEER}, decoded", decoded, target=at_least(WANTED_HZ))
    yield Row("logs", at, "messages, beside bytes only", "1/s", ours, f"{PEER}, not decoded", raw, target=ratio_at_least(1.0))
    yield Row("logs", at, "postures of one", "1/s", postures, target=at_least(WANTED_HZ))


def _raw(path: Path) -> int:
    with path.open("rb") as file:
        return sum(1 for _ in make_reader(file).iter_messages())


def _decoded(path: Path) -> int:
    """Each message as its protobuf class, as we have them."""
    count = 0
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            BY_NAME[channel.metadata["topic"]].message.FromString(message.data)
            count += 1
    return count


def _slices(hour: Path) -> Iterator[Row]:
    with part("slices"):
        took: list[float] = []
        for n in range(RUNS):
            begun = time.perf_counter()
            at = 600.0 * (n + 1)
            count = sum(1 for _ in vistel.log.open(hour).postures("ben", at, at + 10.0))
            took.append(time.perf_counter() - begun)
            if count < 500:
                raise ValueError(f"only {count} postures in a slice")
    size = hour.stat().st_size / 1e6
    yield Row(
        "logs", f"an hour, {size:.0f} MB", "10 s of postures, opened anew", "s", statistics.median(took), target=at_most(SLICE_S)
    )


def _sizes(minute: Path) -> Iterator[Row]:
    log = vistel.log.open(minute)
    plain = text = 0
    for record in log.records():
        plain += record.size
        text += len(MessageToJson(record.message, indent=None))
    size = minute.stat().st_size / 1e3
    yield Row("logs", "a minute of two people", "size", "kB", size, "JSON", text / 1e3)
    yield Row("logs", "a minute of two people", "size, beside messages alone", "kB", size, "protobuf, not compressed", plain / 1e3)


def _computed(folder: Path) -> Iterator[Row]:
    """A log from its devices' bytes, in one process."""
    reader = LogReader(MEETING)
    conference = Conference.model_validate(reader.conference)
    world.preload(conference)
    posture.preload(conference)
    length_s = (reader.end_ns - reader.begin_ns) * 1e-9
    one: list[float] = []
    two: list[float] = []  # of the slower process
    with part("computing"):
        for n in range(RUNS + 1):
            for took, apart in ((one, False), (two, True)):
                begun, children = time.process_time(), _children_s()
                path = folder / f"{n}-{apart}.mcap"
                replay_fast(reader, conference, "devices", reader.begin_ns, reader.end_ns + 1, path, apart=apart)
                took.append(max(time.process_time() - begun, _children_s() - children))
    case = "computed from devices' bytes"  # the first runs load kernels
    yield Row("logs", case, "two people, one process", "x real time", length_s / statistics.median(one[1:]))
    speed = length_s / statistics.median(two[1:])
    yield Row("logs", case, "two people, two processes", "x real time", speed, target=at_least(REAL_TIME))


def _children_s() -> float:
    """Processor time of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
