"""Scores of the sets that are opened once: kept, in the docs' tables, and no commit twice."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import scores
from benchmarks.grasping import report as grasping
from benchmarks.hearing import report as hearing
from benchmarks.scores import Scores, refusal, wilson

FIGURES = [("gloves: found", 9, 10)]
TASKS = (grasping.SCORES, hearing.SCORES)


def test_a_commit_is_scored_once_and_only_as_it_is() -> None:
    assert refusal("1234abcd", []) is None
    assert "commit first" in str(refusal("1234abcd+", []))
    assert "scored already" in str(refusal("1234abcd", [{"commit": "1234abcd"}]))


def test_intervals_of_shares_are_wilsons() -> None:
    assert wilson(0, 10) == pytest.approx((0.0, 27.8), abs=0.1)
    assert wilson(95, 100) == pytest.approx((88.8, 97.8), abs=0.1)
    assert np.diff(wilson(950, 1000))[0] < np.diff(wilson(95, 100))[0]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.kept)
def test_a_score_is_kept_and_stands_in_the_table_of_its_page_and_a_second_one_is_refused(
    task: Scores, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (scores._DOCS / task.page).read_text("utf-8")
    (tmp_path / task.page).parent.mkdir(parents=True)
    (tmp_path / task.page).write_text(page, "utf-8")
    monkeypatch.setattr(scores, "_DOCS", tmp_path)
    now = scores.conditions()
    monkeypatch.setattr(scores, "conditions", lambda: replace(now, commit="1234abcd"))
    assert task.opened(lambda: FIGURES) == 0
    assert "gloves: found: 9 of 10" in capsys.readouterr().out
    (kept,) = (tmp_path / task.kept).read_text("utf-8").splitlines()
    assert json.loads(kept)["commit"] == "1234abcd"
    written = (tmp_path / task.page).read_text("utf-8")
    assert f"| {now.date} | 1234abcd | gloves: found | 90.0 % | 59.6 to 98.2 % | 10 |" in written
    assert written.split("<!-- scores -->")[0] == page.split("<!-- scores -->")[0]
    assert task.opened(lambda: pytest.fail("it was opened again")) == 1
    assert "scored already" in capsys.readouterr().err
