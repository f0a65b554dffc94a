"""docs/performance.md is what docs/figures.jsonl gives; what is missed stands on top."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from benchmarks.row import Row, conditions, line, ratio_at_most
from scripts import figures


def _line(bench: str = "field", met: bool | None = True, load: float = 0.5, value: float = 1.0) -> dict[str, Any]:
    told = line(Row(bench, "a case", "time", "ms", value, "NumPy", 2.0, target=ratio_at_most(0.4)), conditions())
    return told | {"load": load, "met": met}


def test_the_page_is_what_the_lines_say() -> None:
    assert figures.PAGE.read_text("utf-8") == figures.page(figures.kept()), "run `python -m scripts.figures`"


def test_every_benchmark_has_a_part_of_the_page() -> None:
    files = (figures.ROOT / "benchmarks").glob("*/bench_*.py")
    assert {file.stem.removeprefix("bench_") for file in files} == set(figures.SUBJECTS)


def test_every_part_says_where_it_is_explained() -> None:
    headings = (figures.ROOT / "docs/performance-history.md").read_text("utf-8").lower().replace(" ", "-").splitlines()
    for _, past in figures.SUBJECTS.values():
        assert f"##-{past}" in headings or f"###-{past}" in headings, past


def test_what_is_missed_stands_on_top_and_in_its_own_part() -> None:
    page = figures.page([_line(met=False, value=7.0), _line(value=3.0)])
    top = page.partition("## The first hour")[0]
    assert "1 of 2 targets are met" in top and "7 ms" in top and "3 ms" not in top
    assert page.count("7 ms") == 2 and page.count("3 ms") == 1


@pytest.mark.parametrize(("load", "marked"), [(1.5, False), (1.6, True)])
def test_a_busy_machine_is_marked(load: float, marked: bool) -> None:
    part = figures.page([_line(load=load)]).partition("## Field")[2].partition("## Ray")[0]
    assert (figures.MARK in part) == marked


def test_what_was_never_measured_says_so() -> None:
    assert figures.page([]).count("Not measured since") == len(figures.SUBJECTS)


@pytest.mark.parametrize(("code", "kept"), [(0, 5.0), (1, 1.0)])
def test_a_benchmark_that_fails_keeps_its_old_lines(
    code: int, kept: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "FIGURES", tmp_path / "figures.jsonl")
    old = [_line("trace", value=2.0), _line("field")]
    figures.FIGURES.write_text("".join(json.dumps(each) + "\n" for each in old), "utf-8")
    done = subprocess.CompletedProcess([], code, json.dumps(_line(value=5.0)) + "\n")
    monkeypatch.setattr(figures.subprocess, "run", lambda *_, **__: done)
    assert figures.renewed("field") == (code == 0)
    assert [(each["bench"], each["value"]) for each in figures.kept()] == (
        [("field", kept), ("trace", 2.0)] if code == 0 else [("trace", 2.0), ("field", kept)]
    )
