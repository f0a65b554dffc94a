"""What a log is made of: rates, gaps, sizes and delays of every channel, and how well the clocks of the nodes agreed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vistel.log import Log


@dataclass(frozen=True)
class ChannelStatistics:
    """One key of a log. jitter_ms: standard deviation of the time between messages; gap_s: the longest, from gap_at_s on, and
    gap99_s what all but a hundredth keep to; delay_ms, delay99_ms: from the sender's time to arrival, the median and as above."""

    key: str
    messages: int
    bytes: int
    rate_hz: float
    jitter_ms: float
    gap99_s: float
    gap_s: float
    gap_at_s: float
    delay_ms: float
    delay99_ms: float
    backwards: int
    """How often the sender's time went back."""


@dataclass(frozen=True)
class ClockStatistics:
    """A node's clock against conference time: how often it was measured, its offset from least to most, and the largest
    uncertainty of a measurement [ms]."""

    node: str
    measured: int
    least_ms: float
    most_ms: float
    uncertainty_ms: float


@dataclass(frozen=True)
class LogStatistics:
    """seconds: of the log; bytes: of all messages, unpacked; file_bytes: of the file."""

    seconds: float
    bytes: int
    file_bytes: int
    channels: list[ChannelStatistics]
    clocks: list[ClockStatistics]


def statistics(log: Log) -> LogStatistics:
    """Reads the whole log."""
    arrived: dict[str, list[tuple[float, float, int]]] = {}
    clocks: dict[str, list[tuple[float, float]]] = {}
    for record in log.records():
        said_ns = record.message.header.t_ns
        t = (record.log_ns - log.begin_ns) * 1e-9
        arrived.setdefault(record.key, []).append((t, (said_ns - log.begin_ns) * 1e-9, record.size))
        if record.topic.name == "clock_offset":
            clocks.setdefault(f"{record.names['site']}/{record.names['node']}", []).append(
                (record.message.offset_ns * 1e-6, record.message.uncertainty_ns * 1e-6)
            )
    channels = [_channel(key, found) for key, found in sorted(arrived.items())]
    measured = [
        ClockStatistics(node, len(of), min(o for o, _ in of), max(o for o, _ in of), max(u for _, u in of))
        for node, of in sorted(clocks.items())
    ]
    return LogStatistics(log.duration, sum(c.bytes for c in channels), log.path.stat().st_size, channels, measured)


def _channel(key: str, found: list[tuple[float, float, int]]) -> ChannelStatistics:
    t, said, size = (np.array(column) for column in zip(*found, strict=True))
    apart = np.diff(t) if len(t) > 1 else np.zeros(1)
    longest = int(np.argmax(apart))
    span = float(t[-1] - t[0])
    delay = 1e3 * (t - said)
    return ChannelStatistics(
        key=key,
        messages=len(t),
        bytes=int(size.sum()),
        rate_hz=(len(t) - 1) / span if span > 0.0 else 0.0,
        jitter_ms=1e3 * float(apart.std()),
        gap99_s=float(np.percentile(apart, 99)),
        gap_s=float(apart[longest]),
        gap_at_s=float(t[longest]),
        delay_ms=float(np.median(delay)),
        delay99_ms=float(np.percentile(delay, 99)),
        backwards=int(np.count_nonzero(np.diff(said) < 0.0)),
    )
