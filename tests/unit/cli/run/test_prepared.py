"""Whether a conference is prepared is looked at before anything else starts: that must not load what prepares it."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from pathlib import Path

import pytest

import vistel
from vistel.conference.files import DEMO_FILE, load
from vistel_cli.run.prepared import NO_FIGURES, lock_of_this_copy, prepare, stamp_of


def test_looking_loads_neither_compiler_nor_renderer() -> None:
    code = "import sys, vistel_cli.run.up; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert "vistel_cli.run.prepared" in loaded
    assert not {"numba", "scipy", "vistel_services.renderer", "vistel_cli.run.prepare"} & set(loaded)


def test_what_is_prepared_is_not_made_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    conference = load(DEMO_FILE)
    stamp = stamp_of(conference, draws=True)
    assert stamp.is_relative_to(tmp_path)
    stamp.parent.mkdir(parents=True)
    stamp.touch()
    monkeypatch.setattr(asyncio, "create_subprocess_exec", None)  # would be called to make it
    for draws in (True, False):
        assert asyncio.run(prepare(conference, DEMO_FILE, asyncio.Event(), draws=draws))


def test_another_copy_prepares_at_the_same_time_and_the_same_copy_waits(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    mine = lock_of_this_copy()
    assert mine == lock_of_this_copy()
    monkeypatch.setattr(vistel, "__file__", str(tmp_path / "clone" / "vistel" / "__init__.py"))
    assert lock_of_this_copy().parent == mine.parent and lock_of_this_copy() != mine


def test_other_people_need_another_preparation() -> None:
    conference = load(DEMO_FILE)
    data = conference.model_dump(mode="json", exclude_none=True)
    data["sites"][0]["participants"][0]["height"] = 1.5
    other = type(conference).model_validate(data)
    assert stamp_of(other, draws=True) != stamp_of(conference, draws=True)
    assert stamp_of(other, draws=False) == stamp_of(conference, draws=False)


def test_where_nothing_is_drawn_nobody_is_made(tmp_path: Path) -> None:
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-m", "vistel_cli.run.prepare", str(DEMO_FILE), NO_FIGURES]
    said = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
    assert "done compiling posture" in said and "making" not in said and "deformation" not in said
    conference = load(DEMO_FILE)
    assert list(tmp_path.glob("**/prepared-*")) == [tmp_path / "vistel" / stamp_of(conference, draws=False).name]
