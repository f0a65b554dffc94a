"""A person who is not there yet is made by a process of its own, while the renderer goes on."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from waiting import wait_until

from vistel.figure.people import builtin
from vistel.figure.people.builtin import builtin_avatar, is_made
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.people import no_parcel
from vistel.render.stage.stage import ParticipantInfo
from vistel_services.renderer import figure_maker

EVA = ParticipantInfo("eva", "eva", "builtin:person=carla", 1.70)


def test_a_person_is_made_apart_and_read_here(monkeypatch: pytest.MonkeyPatch) -> None:
    builtin_avatar(EVA.avatar, name=EVA.name, height=EVA.height)  # so that the process need only read it
    asked: list[list[str]] = []
    monkeypatch.setattr(figure_maker, "is_made", lambda *_, **__: False)
    run = subprocess.run

    def watched(command: list[str], **options: object) -> subprocess.CompletedProcess[bytes]:
        asked.append(command)
        done = run(command, **options)  # type: ignore[call-overload]
        assert done.returncode == 0
        return done

    monkeypatch.setattr(subprocess, "run", watched)
    monkeypatch.setattr(builtin.body_model, "make", None)
    figure = figure_maker.load_apart(EVA, {}, no_parcel)
    assert isinstance(figure, AvatarFigure)
    assert asked == [figure_maker.command(EVA, os.getpid())]


def test_a_person_who_is_there_is_read_without_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    builtin_avatar(EVA.avatar, name=EVA.name, height=EVA.height)
    monkeypatch.setattr(subprocess, "run", None)
    assert isinstance(figure_maker.load_apart(EVA, {}, no_parcel), AvatarFigure)


def test_where_no_process_can_be_had_the_renderer_makes_the_person_and_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(figure_maker, "is_made", lambda *_, **__: False)
    monkeypatch.setattr(figure_maker, "command", lambda *_: [sys.executable, "-c", "raise SystemExit(3)"])
    assert isinstance(figure_maker.load_apart(EVA, {}, no_parcel), AvatarFigure)
    assert "event=figure_not_made_apart participant=eva exit_code=3" in caplog.text


def test_whether_a_person_is_made_is_seen_without_making_it(tmp_path: Path) -> None:
    assert not is_made("builtin:person=carla", name="eva", height=1.70, cache=tmp_path)
    with pytest.raises(ValueError, match="height"):
        is_made("builtin:person=carla", name="eva", height=17.0, cache=tmp_path)


def test_the_process_ends_when_the_renderer_is_killed(tmp_path: Path) -> None:
    """The renderer is here a process that has a person made who is not there yet."""
    code = """
import os, subprocess
from vistel.render.stage.stage import ParticipantInfo
from vistel_services.renderer.figure_maker import command
making = subprocess.Popen(command(ParticipantInfo("new", "new", "builtin:seed=77", 1.66), os.getpid()))
print(making.pid, flush=True)
making.wait()
"""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "XDG_CACHE_HOME": str(tmp_path)}
    renderer = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment)
    assert renderer.stdout is not None
    making = psutil.Process(int(renderer.stdout.readline()))
    renderer.kill()
    renderer.wait()
    wait_until(lambda: not making.is_running() or making.status() == psutil.STATUS_ZOMBIE)
    assert not list(tmp_path.glob("**/person-*.npz"))
