"""Every command of every page does what its reader types: as printed, in order, in a folder that `vistel examples` filled.

`make test` runs the pages of `QUICK`, `make docs-commands` all.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from waiting import wait_until

from vistel.conference.running import running_conferences

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3000)]

ROOT = Path(__file__).resolve().parents[2]
COMMAND = re.compile(r"(\.venv/bin/)?vistel [a-z]|(make|cp|python|pytest|sudo|pip) ")
LINE = re.compile(r"^ {4,8}(\S.*?)(?: +#.*)?$|\| `(vistel [^`]+)` \|$", re.MULTILINE)
FILE = re.compile(
    r"^(Save this as|Put this in place of the last line of) `([\w.]+)`(?:(?!\n\n).)*\n\n```\w+\n(.*?)^```", re.MULTILINE | re.DOTALL
)
"""A file that the reader writes, or whose end they change: how, its name, the text."""
FAILS = re.compile(r"\s*This time it fails")
"""Follows a command that must not end well."""
QUICK = {"docs/how-to/calibrate.md", "docs/how-to/simulated-devices.md"}
"""Pages whose commands take some seconds: one that ends, and two that go on until they are stopped."""
NOT_RUN = {
    r"make test$": "it runs this test",
    r"sudo ": "needs another user's rights",
    r"hub\.example\.org|192\.0\.2\.|vistel site |doctor .*--site": "needs another machine",
    r"can you hear us": "needs a site that has joined",
    r"--from conference-room/": "names a room that a meeting of that day left",
    r"devices --": "needs a device that is attached",
    r"me\.toml|--as me$": "needs the conference file that the page shows",
    r"calibrate (body|tracker|glove|face|gaze)|distortion points.csv --log": "needs a person who makes the moves that it asks for",
    r"--rig rig\.game_engine": "needs files of MakeHuman",
    r"speech (try|enrol [^ ]+)$": "needs a microphone and somebody who speaks",
    r"--show$": "needs a display",
    r"voice equipment": "needs an amplifier",
    r"vistel bench": "make bench runs it",
    r"make replays": "make test runs tests/replay",
    r"log (grep|diff) |--against ": "its exit code says what it found",
    r"(take|snatch) the baton": "needs a hand that is at the baton at this moment",
    r"import (rosbag2_walk|grab)": "needs a recording of somebody else",
    r"--wav ": "needs somebody who speaks",
    r"dist/vistel": "make wheel makes and installs it",
}
"""Commands that no test can run, as regular expressions, and why."""
INSTEAD = {"make demo": "vistel up --seconds 20"}
"""What `make demo` does after setting up, which `make first` tries in a fresh clone."""
UNTIL_STOPPED = r"vistel sim (?!crowd)|replay .*--open|vistel (wrinkle )?studio|voice watch|vistel chat$|examples/activities"
"""They run until Ctrl-C: each must show a line, and then end well."""
WAITING = re.compile(r"… \d+ s$")
"""The end of a line that says what a command waits for (`vistel_cli/waiting.py`)."""
BESIDE_A_CONFERENCE = r"vistel (ask|record|voice|chat|show|invite)|world (where|move)|--now|examples/activities"


def commands_of(page: Path) -> list[str]:
    """The commands that stand alone on a line of a page, or in a cell of a table."""
    return [command for _, command in _commands(page.read_text("utf-8"))]


def _commands(text: str) -> list[tuple[re.Match[str], str]]:
    found = [(line, line[1] or line[2]) for line in LINE.finditer(text)]
    return [(m, c) for m, c in found if COMMAND.match(c) and not re.search(r"…|\b(?!VISTEL)[A-Z]{4,}\b|   ", c)]


PAGES = {
    str(page.relative_to(ROOT)): commands
    for page in sorted([ROOT / "README.md", *ROOT.glob("docs/**/*.md")])
    if (commands := commands_of(page)) and not page.is_relative_to(ROOT / "docs/ja")
}
"""Japanese pages have the commands of the English ones (tests/unit/test_docs_japanese.py)."""


@dataclass
class Reader:
    """Somebody who types what a page says, in a terminal; a conference goes on in another one."""

    folder: Path
    conference: subprocess.Popen[bytes] | None = None

    def start(self, command: str, terminal: str = "terminal.log") -> subprocess.Popen[bytes]:
        self.log = (self.folder / terminal).open("ab")
        shown = command.replace(".venv/bin/", "")
        return subprocess.Popen(["bash", "-c", f"exec {shown}"], cwd=self.folder, stdout=self.log, stderr=subprocess.STDOUT)

    def said(self, terminal: str = "terminal.log") -> str:
        return (self.folder / terminal).read_text("utf-8")

    def write(self, how: str, name: str, text: str) -> None:
        """A file of the page, or its new end."""
        path = self.folder / name
        kept = path.read_text("utf-8").splitlines(keepends=True)[:-1] if how.startswith("Put") else []
        path.write_text("".join(kept) + text, "utf-8")

    def run(self, command: str, fails: bool = False) -> None:
        """Until it ends, as the page says."""
        code = self.start(command).wait()
        assert (code != 0) == fails, f"{command}: exit code {code}\n{self.said()[-3000:]}"

    def see(self, command: str) -> None:
        """Until it has shown something; then Ctrl-C."""
        before = len(self.said()) if (self.folder / "terminal.log").exists() else 0
        process = self.start(command)

        def shown() -> bool:
            return any(line.strip() and not WAITING.search(line) for line in self.said()[before:].splitlines())

        wait_until(lambda: shown() or process.poll() is not None, every_s=0.2)
        process.send_signal(signal.SIGINT)
        code = process.wait()
        assert code == 0, f"{command}: exit code {code}\n{self.said()[before:]}"

    def begin(self, command: str) -> None:
        """Start a conference that goes on."""
        self.end()
        self.conference = started = self.start(command, "conference.log")
        wait_until(lambda: bool(running_conferences()) or started.poll() is not None, every_s=0.2)
        where = ["vistel", "world", "where"]
        wait_until(lambda: started.poll() is not None or subprocess.run(where, capture_output=True, check=False).returncode == 0)
        assert started.poll() is None, f"{command}: ended\n{self.said('conference.log')[-3000:]}"

    def end(self) -> None:
        if self.conference is not None:
            self.conference.send_signal(signal.SIGINT)
            code = self.conference.wait()
            self.conference = None
            assert code == 0, self.said("conference.log")[-3000:]


@pytest.fixture(scope="session")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the examples, and no recording."""
    folder = tmp_path_factory.mktemp("examples") / "mine"
    subprocess.run([sys.executable, "-m", "vistel_cli.main", "examples", str(folder), "--no-recording"], check=True)
    return folder


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder `out` of an example meeting."""
    folder = tmp_path_factory.mktemp("meeting")
    subprocess.run([sys.executable, "-m", "vistel_cli.main", "up", "--seconds", "18"], cwd=folder, check=True)
    return folder / "out"


@pytest.fixture(scope="session")
def programs(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The `PATH` of a reader whose `python` has the packages of this one. What a page installs stays in a folder of the test."""
    own = tmp_path_factory.mktemp("packages")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(own)], check=True)
    packages = sysconfig.get_path("purelib")
    own_packages = Path(sysconfig.get_path("purelib", vars={"base": str(own), "platbase": str(own)}))
    (own_packages / "beside.pth").write_text(f"import site; site.addsitedir({packages!r})\n", "utf-8")
    return os.pathsep.join([str(own / "bin"), str(Path(sys.executable).parent), os.environ["PATH"]])


@pytest.fixture
def reader(filled: Path, programs: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Reader]:
    monkeypatch.setenv("PATH", programs)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(str(ROOT / p) for p in (".", "services", "sim", "clients/cli")))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "user"))
    monkeypatch.setenv("BROWSER", "true")
    typist = Reader(tmp_path / "mine")
    shutil.copytree(filled, typist.folder)
    yield typist
    if typist.conference is not None:
        typist.conference.kill()


@pytest.mark.parametrize("page", [p if p in QUICK else pytest.param(p, marks=pytest.mark.docs) for p in PAGES])
def test_the_commands_and_programs_of_a_page_run_as_printed(page: str, reader: Reader, request: pytest.FixtureRequest) -> None:
    commands = PAGES[page]
    run = [c for c in commands if not any(re.search(reason, c) for reason in NOT_RUN)]
    if any("out/latest" in c for c in run):
        shutil.copytree(request.getfixturevalue("recorded"), reader.folder / "out", symlinks=True)
    text = (ROOT / page).read_text("utf-8")
    begin = 0
    for (line, command), following in zip(_commands(text), [*commands, ""][1:], strict=True):
        for file in FILE.findall(text, begin, line.start()):
            reader.write(*file)
        begin = line.end()
        if command not in run:
            continue
        typed = INSTEAD.get(command, command)
        goes_on = not re.search("--seconds|--plan", typed) or re.search(BESIDE_A_CONFERENCE, following)
        if re.match(r"(\.venv/bin/)?vistel up", typed) and goes_on:
            reader.begin(typed)
        elif re.search(UNTIL_STOPPED, typed):
            reader.see(typed)
        else:
            reader.run(typed, fails=FAILS.match(text, begin) is not None)
    reader.end()


def test_every_reason_not_to_run_a_command_is_needed() -> None:
    every = [c for commands in PAGES.values() for c in commands]
    assert [reason for reason in NOT_RUN if not any(re.search(reason, c) for c in every)] == []
