"""One figure of one benchmark, as `vistel bench --json` prints it."""

import os
import platform
from dataclasses import dataclass, field


def machine() -> str:
    """The machine a figure was measured on, in a few words."""
    return f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"


@dataclass(frozen=True)
class Row:
    """peer: name and version of what was measured beside us in the same run; ratio: ours to the peer's.

    target: as text; met: None where this machine cannot tell.
    """

    bench: str
    case: str
    metric: str
    unit: str
    value: float
    peer: str | None = None
    peer_value: float | None = None
    ratio: float | None = None
    target: str | None = None
    met: bool | None = None
    machine: str = field(default_factory=machine)


def row_beside(
    bench: str,
    case: str,
    metric: str,
    unit: str,
    value: float,
    peer: str | None = None,
    peer_value: float | None = None,
    target: str | None = None,
    met: bool | None = None,
) -> Row:
    """A row whose ratio is that of the two values."""
    ratio = None if peer_value is None else value / peer_value
    return Row(bench, case, metric, unit, value, peer, peer_value, ratio, target, met)
