"""A conference that runs is found by other commands, leaves nothing behind that misleads, and writes over no other run."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from waiting import wait_until

import vistel
from vistel.conference.running import Running, conferences_here, running_conferences
from vistel.wire.zenoh.endpoints import free_port

pytestmark = pytest.mark.slow

VISTEL = (sys.executable, "-m", "vistel_cli.main")
CONFERENCE = """name = "{name}"

[[sites]]
name = "lab"
processes = [["posture"]]
[[sites.participants]]
name = "ada"
gloves = {{}}
[sites.participants.tracker]
port = "sim"
"""


class Ups:
    """Conferences that run in a folder of their own, for a user of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str) -> Running:
        """Run the conference until its world answers."""
        (self.folder / f"{name}.toml").write_text(CONFERENCE.format(name=name))
        self.begin(name, "up", f"{name}.toml")
        wait_until(lambda: running_conferences(name) and self.run("world", "where", f"{name}.toml").returncode == 0, every_s=0.2)
        return running_conferences(name)[0]

    def begin(self, name: str, *words: str) -> None:
        """Run a command that goes on, called `name`."""
        output = (self.folder / f"{name}.log").open("ab")
        self._processes[name] = subprocess.Popen([*VISTEL, *words], cwd=self.folder, stdout=output, stderr=output)

    def end(self, name: str) -> int:
        self.still_runs(name)
        process = self._processes.pop(name)
        process.send_signal(signal.SIGINT)
        code = process.wait()
        if code:
            print(self.said_by(name))
        return code

    def still_runs(self, name: str) -> None:
        """Fails with all that the conference has said if it has ended."""
        assert self._processes[name].poll() is None, self.said_by(name)

    def said_by(self, name: str) -> str:
        """All that a conference and its processes have said."""
        logs = [self.folder / f"{name}.log", *(self.folder / "out").glob(f"*-{name}*/logs/*.log")]
        return "\n".join(f"{log}:\n{log.read_text(errors='replace')}" for log in logs)

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*VISTEL, *words], cwd=self.folder, capture_output=True, text=True, check=False)

    def end_all(self) -> None:
        for process in self._processes.values():
            process.send_signal(signal.SIGINT)
            process.wait()


@pytest.fixture
def ups(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ups]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "user"))
    found = Ups(tmp_path)
    yield found
    found.end_all()


@pytest.mark.timeout(600)
def test_commands_find_the_conference_that_runs_and_each_run_has_its_own_folder(ups: Ups) -> None:
    first = ups.start("first")
    # On a busy machine Ada comes later than a command waits for her, and a box may be made of which the answer comes too late.
    wait_until(lambda: re.fullmatch(r"done: box-\d+\n", ups.run("ask", "create", "red", "box", "here").stdout), every_s=0.2)
    with vistel.join() as session:
        assert session.ask("create green ball 6 cm here").done

    second = ups.start("second")
    assert second.hub != first.hub
    assert f"first at {first.hub}" in (ups.folder / "second.log").read_text()
    newest = ups.run("ask", "undo")
    assert re.search(rf"second at {second.hub} is meant.*first runs too: --hub {first.hub}", newest.stderr)
    assert ups.run("ask", "first.toml", "undo").stdout.startswith("done")

    assert ups.end("second") == 0
    assert os.readlink(ups.folder / "out" / "latest") == Path(second.folder).name
    again = ups.start("second")
    assert {Path(r.folder).parent for r in (first, second, again)} == {ups.folder / "out"}
    assert len({first.folder, second.folder, again.folder}) == 3
    assert (Path(second.folder) / "report.json").is_file()

    ups.still_runs("first")
    assert ups.run("runs", "clear", "--keep", "1").returncode == 0
    ups.still_runs("first")
    assert {p.name for p in (ups.folder / "out").iterdir()} == {"latest", Path(first.folder).name, Path(again.folder).name}

    assert ups.end("second") == ups.end("first") == 0
    lost = ups.run("ask", "undo")
    assert lost.returncode == 1
    assert "this machine takes part in no conference" in lost.stderr


@pytest.mark.timeout(600)
def test_commands_find_the_conference_that_a_site_of_this_machine_has_joined(ups: Ups) -> None:
    router = f'[bus]\nmode = "routed"\nendpoints = ["tcp/127.0.0.1:{free_port()}"]\n\n[[sites]]'
    (ups.folder / "office.toml").write_text(CONFERENCE.format(name="office").replace("[[sites]]", router, 1))
    ups.begin("router", "site", "router", "office.toml")
    ups.begin("lab", "site", "join", "office.toml", "lab")
    wait_until(lambda: ups.still_runs("lab") or conferences_here(), every_s=0.2)
    assert ups.run("chat", "can you hear us?", "--as", "ada").stdout == "written to all, as ada\n"
    assert ups.run("chat", "here I am", "--as", "ben").returncode == 2
    assert ups.end("lab") == ups.end("router") == 0
    assert conferences_here() == []
