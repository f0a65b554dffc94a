"""Running conferences are found by the files that they lock."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from vistel.conference.running import (
    Running,
    announced,
    conferences_here,
    running_conferences,
    running_folder,
    studio_announced,
    studio_here,
)

DEMO = Running("demo", "tcp/127.0.0.1:7447", "demo.toml", "out/demo", 1, {"aiko": "tokyo"}, {"tokyo": "http://127.0.0.1:8090/"})
OTHER = Running("den", "tcp/127.0.0.1:9", "den.toml", "out/den", 2)


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def announce_elsewhere(running: Running, then: str) -> subprocess.Popen[str]:
    """Another process that has announced a conference and does `then`."""
    script = f"""import os, sys
from vistel.conference.running import Running, announced
with announced({running!r}):
    print("announced", flush=True)
    {then}"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "announced\n"
    return process


def test_a_conference_is_found_with_all_that_was_announced_while_it_runs() -> None:
    assert running_conferences() == []
    with announced(DEMO):
        assert running_conferences() == [DEMO]
        assert running_conferences("demo") == [DEMO]
        assert running_conferences("den") == []
    assert running_conferences() == []


def test_of_two_the_newest_comes_first() -> None:
    other = announce_elsewhere(OTHER, "sys.stdin.read()")
    with announced(DEMO):
        assert running_conferences() == [OTHER, DEMO]
        other.communicate()
        assert running_conferences() == [DEMO]


def test_what_a_dead_process_left_is_removed() -> None:
    announce_elsewhere(OTHER, "os.kill(os.getpid(), 9)").wait()
    assert len(list(running_folder().iterdir())) == 1
    assert running_conferences() == []
    assert list(running_folder().iterdir()) == []


def test_a_site_that_joins_from_here_is_found_but_its_conference_runs_elsewhere() -> None:
    tokyo = Running("office", "tls/192.0.2.7:7447", "office/conference.toml", "out/a", 3, {"aiko": "tokyo"}, site="tokyo")
    columbus = replace(tokyo, people={"ben": "columbus"}, site="columbus", started_ns=4)
    other = announce_elsewhere(columbus, "sys.stdin.read()")
    with announced(tokyo):
        assert running_conferences() == []
        (office,) = conferences_here()
        other.communicate()
        assert conferences_here() == [tokyo]
    assert office.site == "columbus" and office.people == {"aiko": "tokyo", "ben": "columbus"}


def test_of_a_conference_that_runs_here_the_whole_is_meant_though_a_site_joins_it_too() -> None:
    joined = replace(DEMO, site="tokyo", started_ns=5, run="")
    other = announce_elsewhere(joined, "sys.stdin.read()")
    with announced(DEMO):
        (demo,) = conferences_here()
    other.communicate()
    assert demo.site == "" and demo.run == DEMO.run and demo.people == DEMO.people


def test_a_file_that_holds_something_else_is_passed_over(own_folder: Path) -> None:
    (own_folder / "vistel").mkdir()
    with announced(DEMO):
        (own_folder / "vistel" / "notes.txt").write_text("no conference")
        assert running_conferences() == [DEMO]


def test_a_folder_that_cannot_be_written_stops_no_conference(own_folder: Path) -> None:
    (own_folder / "vistel").write_text("a file where the folder should be")
    with announced(DEMO):
        assert running_conferences() == []


def test_only_the_user_may_read_where_their_conference_is() -> None:
    with announced(DEMO):
        (file,) = running_folder().iterdir()
        assert file.stat().st_mode & 0o077 == 0
        assert running_folder().stat().st_mode & 0o077 == 0


def test_studios_are_found_while_they_run_and_are_no_conference() -> None:
    assert studio_here() == ""
    with announced(DEMO), studio_announced("http://127.0.0.1:8765/avatar/"):
        assert studio_here() == "http://127.0.0.1:8765/avatar/"
        assert running_conferences() == [DEMO]
    assert studio_here() == ""


def test_studios_that_died_are_not_found() -> None:
    script = """import os
from vistel.conference.running import studio_announced
with studio_announced("x"):
    os.kill(os.getpid(), 9)"""
    subprocess.run([sys.executable, "-c", script], check=False)
    assert len(list(running_folder().iterdir())) == 1
    assert studio_here() == ""
    assert list(running_folder().iterdir()) == []
