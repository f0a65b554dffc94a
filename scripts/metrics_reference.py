"""Writes the reference page of metrics from the services' source: `python -m scripts.metrics_reference`."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
_SERVICES = ROOT / "services/vistel_services"
PAGE = ROOT / "docs/reference/metrics.md"
_KINDS = {"Counter", "Gauge", "Histogram"}
_SHARED = {"devices": "tracker, glove, face", "process": "every process"}
"""Whose metrics those of folders are that belong to no one service."""


class Metric(NamedTuple):
    """One of Prometheus's, as its module makes it; labels: what its values are told apart by."""

    name: str
    kind: str
    labels: tuple[str, ...]
    what: str
    service: str


def metrics() -> list[Metric]:
    """Of all services, by name."""
    return sorted(m for file in _SERVICES.rglob("*.py") for m in _made_in(file))


def page() -> str:
    """The whole page, Markdown."""
    rows = "\n".join(f"| `{m.name}` | {m.kind.lower()} | {', '.join(m.labels)} | {m.service} | {m.what} |" for m in metrics())
    return f"""# Metrics

<!-- Made by `python -m scripts.metrics_reference` from the services' source; do not edit. -->

Every process of a conference serves its figures for Prometheus at `/metrics`, on a free port of this machine's own address,
and a machine those of all its processes where the conference file says;
[how to collect them](../how-to/collect-metrics.md). Counters only rise; histograms have `_bucket`, `_sum` and `_count`.

| metric | kind | labels | service | what |
|---|---|---|---|---|
{rows}
"""


def _made_in(file: Path) -> Iterator[Metric]:
    inside = file.relative_to(_SERVICES).parts
    nodes = list(ast.walk(ast.parse(file.read_text("utf-8"))))
    imports = (n for n in nodes if isinstance(n, ast.ImportFrom) and n.module == "prometheus_client")
    kinds = {a.name for i in imports for a in i.names} & _KINDS  # collections has a Counter too
    for node in nodes:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in kinds:
            name, what, *more = (ast.literal_eval(argument) for argument in node.args)
            yield Metric(name, node.func.id, tuple(more[0]) if more else (), what, _SHARED.get(inside[0], inside[0]))


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
