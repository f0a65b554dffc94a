"""Dashboards and alerts ask for metrics that there are, by labels that they have."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
import yaml

from scripts.metrics_reference import metrics

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "deploy/monitoring"
ALERTS = [r for g in yaml.safe_load((FOLDER / "alerts.yml").read_text("utf-8"))["groups"] for r in g["rules"]]
DASHBOARD = json.loads((FOLDER / "dashboard.json").read_text("utf-8"))
PANELS = {p["title"]: p["targets"] for p in DASHBOARD["panels"]}

OF_THE_MACHINE = {"site", "process", "instance", "job"}
"""Labels that Prometheus and the address of a machine give to all."""
FUNCTIONS = {"abs", "avg_over_time", "changes", "histogram_quantile", "increase", "rate", "sum", "max"}
TOKEN = re.compile(
    r'(?P<name>[a-zA-Z_]\w*)|(?P<text>"[^"]*")|(?P<time>\d+[smh])|(?P<number>\d+(\.\d+)?)|(?P<sign>=~|[=<>!]=|[-+*/<>=(),{}\[\]])|\s+'
)


@cache
def known() -> dict[str, set[str]]:
    """Every series there is, and its labels."""
    out = {"up": {"job", "instance"}}
    for m in metrics():
        labels = OF_THE_MACHINE | set(m.labels)
        ends = ("_bucket", "_sum", "_count") if m.kind == "Histogram" else ("",)
        out |= {m.name + end: labels | ({"le"} if end == "_bucket" else set()) for end in ends}
    return out


def faults(query: str, shown: str = "") -> Iterator[str]:
    """What of a query is not there. shown: a text with {{ labels }} of its result."""
    tokens, at = list[tuple[str, str]](), 0
    while at < len(query):
        found = TOKEN.match(query, at)
        if found is None:
            yield f"not understood: {query[at:]}"
            return
        tokens += [(found.lastgroup or "", found[0])] if found[0].strip() else []
        at = found.end()
    words = [t for kind, t in tokens if kind in ("name", "sign")]
    series, by, depth = set[str](), set[str](), 0
    braces = by_now = False
    for i, word in enumerate(words):
        after = words[i + 1] if i + 1 < len(words) else ""
        depth += (word == "(") - (word == ")")
        braces = (braces or word == "{") and word != "}"
        by_now = (by_now or words[i - 1 : i] == ["by"]) and word != ")"
        if re.fullmatch(r"\w+", word) and word != "by":
            if braces or by_now:
                by |= {word}
            elif after in ("(", "by"):
                yield from [] if word in FUNCTIONS else [f"no function {word}"]
            elif word in known():
                series |= {word}
            else:
                yield f"no metric {word}"
    labels = set.intersection(*(known()[s] for s in series)) if series else set()
    yield from (f"no label {label}" for label in sorted(by - labels))
    left = by if " by " in query else labels
    yield from (
        f"{label} is not in the result" for label in re.findall(r"{{ ?(?:\$labels\.)?(\w+) ?}}", shown) if label not in left
    )
    if depth:
        yield "not whole"


@pytest.mark.parametrize("rule", ALERTS, ids=lambda r: r["alert"])
def test_an_alert_asks_for_what_there_is_and_names_a_page_to_read(rule: dict[str, object]) -> None:
    annotations = rule["annotations"]
    assert isinstance(annotations, dict)
    assert list(faults(str(rule["expr"]), annotations["summary"])) == []
    assert (ROOT / annotations["read"]).is_file()
    assert re.fullmatch(r"\d+[sm]", str(rule.get("for", "0s"))) and rule["labels"] in ({"severity": "page"}, {"severity": "warn"})


@pytest.mark.parametrize("title", PANELS)
def test_a_panel_of_the_dashboard_asks_for_what_there_is(title: str) -> None:
    for target in PANELS[title]:
        assert list(faults(target["expr"], target["legendFormat"])) == []


def test_panels_have_numbers_of_their_own_and_lie_beside_each_other() -> None:
    panels = DASHBOARD["panels"]
    assert len({p["id"] for p in panels}) == len(PANELS) == len(panels)
    places = [(p["gridPos"]["x"], p["gridPos"]["y"]) for p in panels]
    assert len(set(places)) == len(places) and all(p["gridPos"]["x"] + p["gridPos"]["w"] <= 24 for p in panels)


@pytest.mark.parametrize(
    ("query", "fault"),
    [
        ("vistel_world_steps > 1", "no metric vistel_world_steps"),
        ("vistel_world_step_time_seconds > 1", "no metric vistel_world_step_time_seconds"),
        ("sum by (room) (vistel_world_steps_total)", "no label room"),
        ('vistel_bus_dropped_total{cause="lost"}', "no label cause"),
        ("rates(vistel_world_steps_total[1m])", "no function rates"),
        ("sum(vistel_world_steps_total", "not whole"),
    ],
)
def test_a_query_for_what_is_not_there_is_found(query: str, fault: str) -> None:
    assert list(faults(query)) == [fault]
