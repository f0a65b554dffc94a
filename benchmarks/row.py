"""One figure of one benchmark, and the line that `vistel bench --json` prints of it."""

import os
import platform
import subprocess
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[1]


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


@dataclass(frozen=True)
class Conditions:
    """Under which a benchmark runs. commit: with + where files differ from it; load: processes that wanted a core in the minute
    before."""

    commit: str
    date: str
    machine: str
    load: float


def conditions() -> Conditions:
    """Those of now."""
    load = os.getloadavg()[0]
    changed = "+" if _git("status", "--porcelain", "--untracked-files=no") else ""
    date = datetime.now(UTC).date().isoformat()
    return Conditions(_git("rev-parse", "--short=8", "HEAD") + changed, date, _machine(), round(load, 1))


def line(row: Row, under: Conditions) -> dict[str, Any]:
    """What `vistel bench --json` prints of a figure."""
    return asdict(row) | asdict(under)


def _machine() -> str:
    gpu = "a GPU" if any(map(Path.exists, (Path("/dev/dri"), Path("/dev/nvidiactl")))) else "no GPU"
    python = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
    return f"{_processor()}, {os.cpu_count()} cores, {gpu}, {python}"


def _processor() -> str:
    known = Path("/proc/cpuinfo")
    models = [w for w in known.read_text("utf-8").splitlines() if w.startswith("model name")] if known.is_file() else []
    return models[0].partition(":")[2].strip() if models else platform.processor()


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=_ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip()
