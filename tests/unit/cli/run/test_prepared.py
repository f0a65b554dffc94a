"""Whether a conference is prepared is looked at before anything else starts: that must not load what prepares it."""

from __future__ import annotations

import asyncio
import itertools
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import vistel
from vistel.conference.files import DEMO_FILE, load
from vistel_cli.run import prepared
from vistel_cli.run.prepared import KERNELS, NO_FIGURES, ROOM, lock_of_this_copy, prepare, stamps_of


def test_looking_loads_neither_compiler_nor_renderer() -> None:
    code = "import sys, vistel_cli.run.up; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert "vistel_cli.run.prepared" in loaded
    assert not {"numba", "scipy", "vistel_services.renderer", "vistel_cli.run.prepare"} & set(loaded)


def test_what_is_prepared_is_not_made_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    conference = load(DEMO_FILE)
    for stamp in stamps_of(conference, draws=True).values():
        assert stamp.is_relative_to(tmp_path)
        stamp.parent.mkdir(parents=True, exist_ok=True)
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


def test_of_other_people_only_those_are_made_who_are_new() -> None:
    conference = load(DEMO_FILE)
    data = conference.model_dump(mode="json", exclude_none=True)
    data["sites"][0]["participants"][0]["height"] = 1.5
    made, other = (stamps_of(c, draws=True) for c in (conference, type(conference).model_validate(data)))
    assert [part for part, stamp in other.items() if stamp not in made.values()] == [("builtin:person=aiko", "aiko", 1.5)]


def test_a_room_with_things_of_its_own_needs_a_preparation_of_its_own() -> None:
    conference = load(DEMO_FILE)
    data = conference.model_dump(mode="json", exclude_none=True)
    data["room"]["things"] = [{"id": "marble", "shape": "ball", "size": 0.02, "at": [0.0, -0.3]}]
    other = type(conference).model_validate(data)
    assert [*stamps_of(conference, draws=False)] == [KERNELS]
    assert [*stamps_of(other, draws=False)] == [KERNELS, ROOM]


def test_what_is_shown_is_a_step_that_goes_on_and_not_one_that_is_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seconds = itertools.count(step=10)  # so that every change is printed
    monkeypatch.setattr(prepared, "time", SimpleNamespace(monotonic=lambda: next(seconds)))
    said = "steps 2\\nbegun one\\nbegun two\\ndone one\\ndone two"

    async def shown() -> None:
        child = await asyncio.create_subprocess_exec(sys.executable, "-c", f"print('{said}')", stdout=asyncio.subprocess.PIPE)
        await asyncio.wait_for(child.wait(), 60.0)  # all is there to be read
        await prepared.show_steps(child, silent=False)

    asyncio.run(shown())
    lines = [line.rsplit(", ", 1)[0] for line in capsys.readouterr().err.splitlines()]
    assert lines[-2:] == ["preparing, once: 1 of 2 steps done; two", "preparing, once: 2 of 2 steps done; finishing"]


def test_where_nothing_is_drawn_nobody_is_made(tmp_path: Path) -> None:
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-m", "vistel_cli.run.prepare", str(DEMO_FILE), NO_FIGURES]
    said = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
    assert "done compiling posture" in said and "making" not in said and "deformation" not in said
    conference = load(DEMO_FILE)
    assert list(tmp_path.glob("**/prepared-*")) == [tmp_path / "vistel" / stamps_of(conference, draws=False)[KERNELS].name]
