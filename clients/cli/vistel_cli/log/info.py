"""What a log contains: how long it is, who is in it, what is missing; then its channels."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from rich.table import Table

from vistel.conference.device_list import devices_of
from vistel.conference.model import Conference
from vistel.wire.log import LogReader
from vistel_cli.terminal import out

_GAP_S = 1.0
"""A stream that is silent for longer is missing."""
_ENDING_S = 10.0
"""Sites stop before the recorder does, by less than this."""
_FRAMES = ("tracker", "glove", "face", "pointer", "camera_body", "headset")
_WRAPPED = 2
"""How far the rest of a wrapped key is indented."""


@dataclass
class Channel:
    """One key of the log. Times are conference time."""

    key: str
    topic: str
    names: dict[str, str]
    first_ns: int
    last_ns: int
    messages: int = 0
    bytes: int = 0
    longest_gap_s: float = 0.0
    gap_begin_ns: int = 0

    @property
    def rate_hz(self) -> float:
        """Messages per second between the first and the last."""
        return max(0, self.messages - 1) / self._seconds if self._seconds > 0.0 else 0.0

    @property
    def kbit_s(self) -> float:
        """Rate of the messages alone, without the network's own bytes."""
        return self.bytes * 8e-3 / self._seconds if self._seconds > 0.0 else 0.0

    @property
    def _seconds(self) -> float:
        return (self.last_ns - self.first_ns) * 1e-9


@dataclass
class LogContents:
    """What `read_contents` found. missing: one line per participant, device or stream that is absent for a while or altogether."""

    begin_ns: int
    seconds: float
    conference: Conference | None
    channels: list[Channel]
    damage: list[str]
    missing: list[str] = field(default_factory=list[str])

    def of(self, *topics: str, **names: str) -> list[Channel]:
        """The channels of these topics, of these names."""
        return [c for c in self.channels if c.topic in topics and names.items() <= c.names.items()]

    def second(self, t_ns: int) -> float:
        """Seconds after the log's beginning."""
        return (t_ns - self.begin_ns) * 1e-9


def read_contents(reader: LogReader) -> LogContents:
    """Reads the whole log."""
    channels: dict[str, Channel] = {}
    for r in reader.records():
        c = channels.setdefault(r.key, Channel(r.key, r.topic.name, r.names, r.log_ns, r.log_ns))
        gap_s = (r.log_ns - c.last_ns) * 1e-9
        if gap_s > c.longest_gap_s:
            c.longest_gap_s, c.gap_begin_ns = gap_s, c.last_ns
        c.messages += 1
        c.bytes += r.size
        c.last_ns = r.log_ns
    try:
        conference = Conference.model_validate(reader.conference)
    except ValueError:
        conference = None
    seconds = (reader.end_ns - reader.begin_ns) * 1e-9
    found = LogContents(reader.begin_ns, seconds, conference, sorted(channels.values(), key=lambda c: c.key), reader.damage)
    found.missing = list(_missing(found))
    return found


def _missing(log: LogContents) -> Iterator[str]:
    wanted: dict[str, list[Channel]] = {}
    if log.conference is None:
        yield "a conference file that this version can read"
    else:
        for site in log.conference.sites:
            for person in site.participants:
                wanted[f"motion of {person.name}"] = log.of("motion", participant=person.name)
        for device in devices_of(log.conference):
            decoded = log.of(*_FRAMES, device=device.name)
            wanted[f"frames of {device.name}"] = decoded or log.of("device_raw", device=device.name)
    end_s = max((log.second(c.last_ns) for channels in wanted.values() for c in channels), default=log.seconds)
    if log.seconds - end_s > _ENDING_S:
        end_s = log.seconds
    for what, channels in wanted.items():
        yield from _absent(log, what, channels, end_s)
    yield from _absent(log, "state of the world", log.of("world_state"), log.seconds)


def _absent(log: LogContents, what: str, channels: list[Channel], end_s: float) -> Iterator[str]:
    if not channels:
        yield f"{what}: none at all"
    for c in channels:
        if c.longest_gap_s > _GAP_S:
            yield f"{what}: none for {c.longest_gap_s:.1f} s from {log.second(c.gap_begin_ns):.1f} s"
        if end_s - log.second(c.last_ns) > _GAP_S:
            yield f"{what}: ends at {log.second(c.last_ns):.1f} s"


def contents_json(log: LogContents) -> dict[str, Any]:
    """The contents as JSON-ready data."""
    channels = [
        {
            "key": c.key,
            "topic": c.topic,
            "messages": c.messages,
            "bytes": c.bytes,
            "rate_hz": round(c.rate_hz, 2),
            "kbit_s": round(c.kbit_s, 2),
            "longest_gap_s": round(c.longest_gap_s, 3),
        }
        for c in log.channels
    ]
    sites = {s.name: [p.name for p in s.participants] for s in log.conference.sites} if log.conference else {}
    return {
        "conference": log.conference and log.conference.name,
        "seconds": round(log.seconds, 3),
        "begin": _time(log).isoformat(),
        "sites": sites,
        "missing": log.missing,
        "damage": log.damage,
        "channels": channels,
    }


def print_contents(log: LogContents, size: int) -> None:
    """How long, who, what is missing or damaged; then a table of the channels. size: bytes of the file."""
    name = log.conference.name if log.conference else "a log"
    out.print(f"{name}: {log.seconds:.1f} s from {_time(log):%Y-%m-%d %H:%M:%S} UTC, {size / 1e6:.1f} MB")
    for site in log.conference.sites if log.conference else ():
        out.print(f"  {site.name:10} {', '.join(_person(log, p.name) for p in site.participants) or 'nobody'}")
    _print_faults("missing", log.missing)
    _print_faults("damaged", log.damage)
    out.print()
    _print_channels(log)


def _person(log: LogContents, name: str) -> str:
    motion, voice = log.of("motion", participant=name), log.of("voice", participant=name)
    return f"{name} ({'no motion' if not motion else f'{motion[0].rate_hz:.0f} postures/s'}{', voice' if voice else ''})"


def _print_faults(heading: str, faults: list[str]) -> None:
    """The faults in one column, long ones wrapped within it."""
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(min_width=8)
    for n, line in enumerate(faults or ["nothing"]):
        table.add_row(heading if n == 0 else "", line, style="yellow" if faults else "")
    out.print(table)


def _print_channels(log: LogContents) -> None:
    keys = [c.key for c in log.channels]
    common = f"{os.path.commonpath(keys)}/" if len(keys) > 1 else ""
    messages = sum(c.messages for c in log.channels)
    out.print(f"{messages} messages in {len(keys)} channels{f' under {common}' if common else ''}")
    rows = [
        (c.key.removeprefix(common), str(c.messages), f"{c.rate_hz:.1f}", f"{c.kbit_s:.1f}", f"{c.longest_gap_s:.2f}")
        for c in log.channels
    ]
    headings = ("key", "messages", "per s", "kbit/s", "longest gap, s")
    widths = [max(len(row[n]) for row in (headings, *rows)) for n in range(1, len(headings))]
    widths[-1] = len("longest")
    left = out.width - sum(w + 2 for w in widths)
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(overflow="fold")
    for width in widths:
        table.add_column(justify="right", width=width)
    table.add_row(*headings, style="bold")
    for key, *figures in rows:
        table.add_row(wrap_at_slashes(key, left), *figures)
    out.print(table)


def wrap_at_slashes(key: str, width: int) -> str:
    """The key in lines of at most `width` characters, broken after slashes; a part that is longer by itself stays whole."""
    lines = [""]
    for part in key.replace("/", "/\n").split("\n"):
        if lines[-1].strip() and len(lines[-1]) + len(part) > width:
            lines.append(" " * _WRAPPED)
        lines[-1] += part
    return "\n".join(lines)


def _time(log: LogContents) -> datetime:
    return datetime.fromtimestamp(log.begin_ns * 1e-9, UTC).replace(microsecond=0)
