"""One figure of one benchmark, and the line that `vistel bench --json` prints of it."""

import operator
import os
import platform
import subprocess
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

_ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Target:
    """What a figure, or its ratio to the peer's, must be. sign: `<=`, `>=` or `=`."""

    sign: str
    limit: float
    of_ratio: bool = False

    def __str__(self) -> str:
        return f"{'ratio ' if self.of_ratio else ''}{self.sign} {self.limit:.3g}"

    def met(self, row: "Row") -> bool | None:
        """None where there is nothing to compare."""
        found = row.ratio if self.of_ratio else row.value
        return None if found is None else bool(_SIGNS[self.sign](found, self.limit))


_SIGNS: dict[str, Callable[[float, float], bool]] = {"<=": operator.le, ">=": operator.ge, "=": operator.eq}


def at_most(limit: float) -> Target:
    return Target("<=", limit)


def at_least(limit: float) -> Target:
    return Target(">=", limit)


def ratio_at_most(limit: float) -> Target:
    return Target("<=", limit, of_ratio=True)


def ratio_at_least(limit: float) -> Target:
    return Target(">=", limit, of_ratio=True)


NONE_AT_ALL = Target("=", 0.0)


@dataclass(frozen=True)
class Row:
    """peer: name and version of what was measured beside us in the same run; ratio: ours to the peer's, that of the two values
    unless it is given. judged: False where this machine cannot tell whether the target is met.
    """

    bench: str
    case: str
    metric: str
    unit: str
    value: float
    peer: str | None = None
    peer_value: float | None = None
    target: Target | None = field(default=None, kw_only=True)
    ratio: float | None = field(default=None, kw_only=True)
    judged: bool = field(default=True, kw_only=True)

    def __post_init__(self) -> None:
        if self.ratio is None and self.peer_value is not None and self.peer_value > 0:
            object.__setattr__(self, "ratio", self.value / self.peer_value)

    @property
    def met(self) -> bool | None:
        return self.target.met(self) if self.target is not None and self.judged else None


@dataclass(frozen=True)
class Conditions:
    """Under which a benchmark runs. commit: with + where files but those of docs/ differ from it; load: processes that wanted a
    core in the minute before.
    """

    commit: str
    date: str
    machine: str
    load: float


def conditions() -> Conditions:
    """Those of now."""
    load = os.getloadavg()[0]
    changed = "+" if _git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs") else ""
    date = datetime.now(UTC).date().isoformat()
    return Conditions(_git("rev-parse", "--short=8", "HEAD") + changed, date, _machine(), round(load, 1))


def line(row: Row, under: Conditions) -> dict[str, Any]:
    """What `vistel bench --json` prints of a figure."""
    names = ("bench", "case", "metric", "unit", "value", "peer", "peer_value", "ratio")
    told = {name: getattr(row, name) for name in names}
    short = {name: float(f"{value:.5g}") for name, value in told.items() if isinstance(value, float | np.floating)}
    target = None if row.target is None else str(row.target)
    return told | short | {"target": target, "met": row.met} | asdict(under)


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
