"""`vistel up` and `vistel up --plan` tell everything that would fail, before anything starts."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel.conference.files import DEMO_FILE, load
from vistel.conference.model import Conference
from vistel_cli.main import app
from vistel_cli.run.checks import faults_of
from vistel_cli.run.pages import CONSOLE_PORT, with_console

FAULTY = """[bus]
endpoints = ["tcp/127.0.0.1:{tcp}"]
[console]
at = "127.0.0.1:{page}"
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "aiko"
avatar = "me.usda"
motion = "walk.bvh"
tracker = {{ kind = "vmc", port = "{udp}", calibration = "notes.txt" }}
[[sites]]
name = "columbus"
[sites.display]
stream = "{tcp}"
[[sites.participants]]
name = "ben"
avatar = "builtin:seed=x"
motion = "clay"
gloves.left = {{ calibration = "gone.json" }}
"""
EXPECTED = (
    ":2: bus.endpoints[0]: port {tcp} is in use by another program; end that, or name another port",
    ":4: console.at: port {page} is in use by another program; end that, or name another port",
    ':9: sites[0].participants[0].avatar: "{folder}/me.usda": expected a USD file; this is an empty file',
    ':10: sites[0].participants[0].motion: "walk.bvh": no such file',
    ':11: sites[0].participants[0].tracker.calibration: "{folder}/notes.txt": expected a calibration or a JSON file; this is',
    ":11: sites[0].participants[0].tracker.port: UDP port {udp} is in use by another program; end that, or name another port",
    ":15: sites[1].display.stream: port {tcp} is that of bus.endpoints[0], too; name another port",
    ":18: sites[1].participants[0].avatar: 'builtin:seed=x': seed: expected a number from 0",
    ':19: sites[1].participants[0].motion: "clay": needs a [[room.things]]',
    ':20: sites[1].participants[0].gloves.left.calibration: "gone.json": no such file',
)


@pytest.fixture
def taken() -> Iterator[dict[str, int]]:
    """Ports that are in use."""
    with socket.socket() as tcp, socket.socket() as page, socket.socket(type=socket.SOCK_DGRAM) as udp:
        for one in (tcp, page):
            one.bind(("127.0.0.1", 0))
            one.listen()
        udp.bind(("0.0.0.0", 0))
        yield {"tcp": tcp.getsockname()[1], "page": page.getsockname()[1], "udp": udp.getsockname()[1]}


@pytest.fixture
def folder(tmp_path: Path, taken: dict[str, int], monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("c.toml").write_text(FAULTY.format(**taken))
    Path("notes.txt").write_text("hello\n")
    Path("me.usda").touch()
    return tmp_path


@pytest.mark.parametrize("options", [[], ["--plan"]], ids=["up", "plan"])
def test_everything_that_would_fail_is_reported_at_once_and_nothing_starts(
    options: list[str], folder: Path, taken: dict[str, int]
) -> None:
    done = CliRunner().invoke(app, ["up", "c.toml", *options])
    assert done.exit_code == 1
    lines = [line for line in done.stderr.splitlines() if not line.startswith("checking the conference …")]
    assert len(lines) == len(EXPECTED), done.stderr
    for line, expected in zip(lines, EXPECTED, strict=True):
        assert line.startswith(f"error: c.toml{expected.format(folder=folder, **taken)}")
    assert ("tokyo/capture" in done.stdout) == bool(options)
    assert not Path("out").exists()


def test_a_folder_of_certificates_that_is_missing_gets_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    routed = 'mode = "routed"\nendpoints = ["tls/127.0.0.1:7"]\ntls = { folder = "certificates" }\n'
    Path("c.toml").write_text(f'[bus]\n{routed}[[sites]]\nname = "tokyo"\n[[sites.participants]]\nname = "aiko"\n')
    done = CliRunner().invoke(app, ["up", "c.toml", "--plan"], env={"COLUMNS": "200"})
    assert done.exit_code == 1
    assert "error: c.toml:4: bus.tls.folder: " in done.stderr and 'certificates": no such file' in done.stderr
    joined = CliRunner().invoke(app, ["site", "join", "c.toml", "tokyo"], env={"COLUMNS": "200"})
    assert joined.exit_code == 1
    assert "certificates: no certificate of tokyo is here; the host's invitation brings it" in joined.stderr


def test_a_room_that_is_missing_hides_no_other_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    people = "[[sites]]\nname = 'tokyo'\n[[sites.participants]]\nname = 'aiko'\nmotion = 'nope'\navatar = 'me.usda'\n"
    Path("c.toml").write_text('[room]\nfile = "gone.usda"\n' + people)
    done = CliRunner().invoke(app, ["up", "c.toml"])
    assert [line.split(":")[2:4] for line in done.stderr.splitlines() if line.startswith("error")] == [
        ["2", " room.file"],
        ["7", " sites[0].participants[0].motion"],
        ["8", " sites[0].participants[0].avatar"],
    ]


def test_the_demo_has_no_fault_and_its_plan_names_its_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["up", "--plan"])
    assert (done.exit_code, done.stderr) == (0, "")
    first = [line.split()[0] for line in done.stdout.splitlines()][:4]
    assert first == ["hub/world", "hub/recorder", "hub/console", "tokyo/capture"]
    assert faults_of(load(DEMO_FILE), DEMO_FILE) == []


def test_a_site_that_joins_is_checked_alone_before_it_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    site = "[[sites]]\nname = '{0}'\n[[sites.participants]]\nname = '{0}-1'\navatar = '{0}.usda'\n"
    Path("c.toml").write_text(site.format("tokyo") + site.format("oslo"))
    done = CliRunner().invoke(app, ["site", "join", "c.toml", "oslo", "--hub", "tcp/127.0.0.1:9"])
    assert done.exit_code == 1
    assert done.stderr == (
        'error: c.toml:10: sites[1].participants[0].avatar: "oslo.usda": no such file; put it beside the conference file\n'
    )


def test_a_console_that_the_file_does_not_place_takes_no_port_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "watched.toml"
    file.write_text(f'[[sites]]\nname = "lab"\n[sites.display]\nstream = "{CONSOLE_PORT}"\n[[sites.participants]]\nname = "ada"\n')
    with with_console(load(file)) as placed:
        console = placed.console.at
    assert console.startswith("127.0.0.1:") and int(console.rpartition(":")[2]) not in (0, CONSOLE_PORT)


def test_a_console_that_the_file_does_not_place_is_placed_after_the_checks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "quiet.toml"
    file.write_text('[[sites]]\nname = "lab"\n[[sites.participants]]\nname = "ada"\n')
    checked: list[str] = []

    def checks(conference: Conference, source: Path) -> list[str]:
        checked.append(conference.console.at)
        return faults_of(conference, source)

    monkeypatch.setattr("vistel_cli.run.up.faults_of", checks)
    said = CliRunner().invoke(app, ["up", str(file), "--plan"])
    assert said.exit_code == 0, said.output
    assert checked == [""], "else a port that another conference takes meanwhile is called a fault of the file"


def test_two_conferences_that_start_at_once_choose_two_ports(tmp_path: Path) -> None:
    file = tmp_path / "quiet.toml"
    file.write_text('[[sites]]\nname = "lab"\n[[sites.participants]]\nname = "ada"\n')
    with with_console(load(file)) as first, with_console(load(file)) as second:
        assert first.console.at != second.console.at, "neither console listens yet"
        again = int(first.console.at.rpartition(":")[2])
        with socket.create_server(("127.0.0.1", again)):  # as the console does
            pass


def test_a_motion_that_cannot_be_played_hides_no_fault_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text('name = "lab"\n[[sites]]\nname = "here"\n[[sites.participants]]\nname = "ada"\navatar = "gone.usda"\n')
    walk = tmp_path / "walk.bvh"
    walk.write_text("HIERARCHY\nROOT Hips\n{\n")
    done = CliRunner().invoke(app, ["up", str(file), "--plan", "--motion", str(walk)])
    said = (done.stdout + done.stderr).replace("\n", " ")
    assert done.exit_code == 1
    assert "gone.usda" in said and f"--motion {walk}" in said
