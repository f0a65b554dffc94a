"""Rooms of several conferences are spread over the places where their worlds run, and a place is emptied."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from waiting import wait_until

from vistel.conference.placement import PlacedRoom
from vistel.wire.zenoh.bus import Router
from vistel_cli.world.spread import fault_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

VISTEL = (sys.executable, "-m", "vistel_cli.main")
ROOM = 'name = "{0}"\n[[sites]]\nname = "here"\n[[sites.participants]]\nname = "somebody"\n'
NAMES = ("monday", "tuesday", "friday")


class Hosts:
    """Worlds of three rooms, at places of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.router = Router.open()
        self.processes: list[subprocess.Popen[bytes]] = []
        self.files = [f"{name}.toml" for name in NAMES]
        for name in NAMES:
            (folder / f"{name}.toml").write_text(ROOM.format(name))

    def serve(self, place: str, *options: str) -> None:
        log = self.folder / f"{place}.log"
        command = [*VISTEL, "world", "serve", *self.files, "--hub", self.router.endpoint, "--place", place, *options]
        with log.open("wb") as output:
            self.processes.append(subprocess.Popen(command, cwd=self.folder, stdout=output, stderr=output))
        said = "world waits" if "--wait" in options else "world leads"
        wait_until(lambda: log.read_text().count(said) >= len(NAMES), every_s=0.2)

    def spread(self, *options: str) -> subprocess.CompletedProcess[str]:
        command = [*VISTEL, "world", "spread", *self.files, "--hub", self.router.endpoint, *options]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)

    def end(self) -> None:
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            process.wait()
        self.router.close()


@pytest.fixture
def hosts(tmp_path: Path) -> Iterator[Hosts]:
    found = Hosts(tmp_path)
    yield found
    found.end()


def test_rooms_go_where_there_is_less_to_do_and_away_from_a_place_that_is_drained(hosts: Hosts) -> None:
    hosts.serve("osaka")
    alone = hosts.spread("--drain", "osaka")
    assert alone.returncode == 1
    assert "monday: stays at osaka, for no world of it waits elsewhere" in alone.stderr
    hosts.serve("kobe", "--wait")
    shown = hosts.spread("--plan")
    assert "friday to kobe, not done" in shown.stdout and shown.returncode == 0
    assert hosts.spread().returncode == 0
    then = hosts.spread()
    assert "nothing to move" in then.stdout
    assert "osaka            rooms   2" in then.stdout and "kobe             rooms   1" in then.stdout
    nowhere = hosts.spread("--drain", "osakka")
    assert nowhere.returncode == 2 and "--drain osakka: no world of these rooms is there; there is kobe, osaka" in nowhere.stderr
    assert hosts.spread("--drain", "osaka").returncode == 0
    assert "osaka            rooms   0" in hosts.spread("--drain", "osaka").stdout


@pytest.mark.parametrize(
    ("at", "places", "fault"),
    [
        ("osaka", {"osaka"}, "monday: stays at osaka, for no world of it waits elsewhere"),
        ("", {"osaka"}, "monday: is led nowhere, for worlds of it wait only at places to be emptied"),
        ("", set[str](), "monday: no world of it is there"),
        ("kobe", {"kobe", "osaka"}, ""),
    ],
)
def test_why_a_room_is_not_moved_is_told_where_it_should_be(at: str, places: set[str], fault: str) -> None:
    assert fault_of(PlacedRoom("monday", 4, at, frozenset(places)), ["osaka"]) == fault


def test_a_name_that_is_no_place_and_a_file_that_stands_twice_are_refused_in_one_line(hosts: Hosts) -> None:
    wrong = hosts.spread("--drain", "Osaka!")
    assert wrong.returncode == 2
    *_, fault = wrong.stderr.splitlines()  # on a busy machine a line says before it that the command loads
    assert fault.startswith("error: Osaka!: expected lower-case letters")
    hosts.files.append(hosts.files[0])
    twice = hosts.spread()
    assert twice.returncode == 2 and "two of the files are of one conference" in twice.stderr
