"""Logs: reading them beside mcap's own reader, a slice of an hour, size beside JSON, and how fast a log is computed anew."""

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from google.protobuf.json_format import MessageToJson
from mcap.reader import make_reader

import vistel.log
from benchmarks.logs.long_log import MEETING, long_log
from benchmarks.progress import part
from benchmarks.row import Row, at_least, at_most, ratio_at_least
from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.topics import BY_NAME
from vistel_cli.log.fast import SETTLE_NS
from vistel_cli.log.fast_sites import computed_sites
from vistel_cli.log.fast_world import computed_world, write_messages
from vistel_cli.testing.simulated_conference import SimulatedConference

PEER = f"mcap {version('mcap')}"
RUNS = 5
"""Measured so often in turn; medians count."""
MINUTE_S, HOUR_S = 60.0, 3600.0
WANTED_HZ = 20_000.0
"""Messages a second that a program is to read."""
SLICE_S = 1.0
"""A slice of an hour is to be there within so long [s]."""
PEOPLE = (("tokyo", "aiko", 1.64), ("columbus", "ben", 1.82), ("paris", "carla", 1.71))
"""Their sites and heights [m]."""
THREE = Conference.model_validate(
    {
        "name": "three",
        "room": {"seats": 3},
        "sites": [
            {"name": site, "participants": [{"name": who, "height": height, "avatar": f"builtin:person={who}", "seat": seat}]}
            for seat, (site, who, height) in enumerate(PEOPLE)
        ],
    }
)
"""A FASTRAK and two CyberGloves each."""
MEETING_S = 20.0
"""Of three people: one cycle of what they do [s]."""
CORES = 2
"""On so many a log is to be computed."""
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
    """Logs from their devices' bytes. Processor time: other work may keep the cores busy. Of the processes the slowest counts, or
    half of them together where that is more: there are two cores."""
    three = folder / "three.mcap"
    with part("a meeting of three in simulated time"), SimulatedConference(THREE, three) as meeting:
        meeting.live(MEETING_S)
    for who, path in (("two people", MEETING), ("three people", three)):
        reader = LogReader(path)
        length_s = (reader.end_ns - reader.begin_ns) * 1e-9
        with part(f"computing {who}"):
            parts = np.median([_parts(reader, folder) for _ in range(RUNS + 1)][1:], axis=0)  # the first run loads kernels
        case = "computed from devices' bytes"
        yield Row("logs", case, f"{who}, one process", "x real time", length_s / float(parts.sum()))
        slowest = max(float(parts.max()), float(parts.sum()) / CORES)
        yield Row("logs", case, f"{who}, two cores", "x real time", length_s / slowest, target=at_least(REAL_TIME))


def _parts(reader: LogReader, folder: Path) -> F64:
    """(3,) processor time of postures, world and writing [s]."""
    conference = Conference.model_validate(reader.conference)
    with tempfile.TemporaryDirectory() as name:
        paths = RunPaths(Path(name), Path(name))
        end_ns = reader.end_ns + 1
        times = [time.process_time()]
        sites = list(computed_sites(reader, conference, "devices", reader.begin_ns, end_ns, end_ns + SETTLE_NS, paths))
        times.append(time.process_time())
        windows = list(computed_world(reader, conference, reader.begin_ns, sites, paths))
        times.append(time.process_time())
        with LogWriter(folder / "computed.mcap", reader.conference_toml) as writer:
            for window in windows:
                write_messages(writer, window.messages)
        times.append(time.process_time())
    return np.diff(times)
