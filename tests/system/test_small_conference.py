"""A small conference with a real router: programs watch it and take part, and a process that hangs is started again."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from small_site import SMALL_SITE
from waiting import wait_until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

EXAMPLES = Path(__file__).parents[2] / "examples"
FILE = f"""
name = "small"
{SMALL_SITE}
[[sites.participants]]
name = "lab"
program = true
height = 1.82
avatar = "builtin:person=ben"
"""

UP = """
import functools
from vistel_cli.main import main
from vistel_cli.run import conference_run
conference_run.Supervisor = functools.partial(conference_run.Supervisor, silent_s=20.0)
main()
"""
"""`vistel up` that takes a process for hanging after a third of the time that it otherwise has."""


@dataclass
class Conference:
    """A conference that runs, until it is told to stop."""

    file: Path
    out: Path
    hub: str
    process: subprocess.Popen[str]

    def example(self, name: str, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, str(EXAMPLES / name), str(self.file), *arguments]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def watched(self, seconds: float) -> str:
        """What example 10 prints."""
        watching = self.example("10_watch_a_conference.py", self.hub, str(seconds))
        text, _ = watching.communicate(timeout=600)
        assert watching.returncode == 0, text
        return text

    def find(self, node: str) -> int | None:
        """The process of a node."""
        for child in psutil.Process(self.process.pid).children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):  # it just ended
                if f"vistel: {node}" in child.cmdline():
                    return child.pid
        return None

    def wait_until(self, done: Callable[[], bool]) -> None:
        def holds() -> bool:
            assert self.process.poll() is None, self.process.communicate()[0]
            return done()

        wait_until(holds, every_s=0.25)


@pytest.fixture(scope="module")
def conference(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Conference]:
    folder = tmp_path_factory.mktemp("small")
    file, out = folder / "small.toml", folder / "out"
    file.write_text(FILE)
    command = [sys.executable, "-c", UP, "up", str(file), "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        hub = next(found[1] for line in process.stdout if (found := re.search(r"bus +(tcp/\S+)", line)))
        running = Conference(file, out, hub, process)
        log = out / "logs" / "here-renderer.log"
        running.wait_until(lambda: log.exists() and "event=picture people=1 stand_ins=0" in log.read_text())
        yield running
    finally:
        process.kill()
        process.communicate()


def test_a_program_takes_part_while_another_one_watches(conference: Conference) -> None:
    answer = watched = ""
    # On a busy machine one of them may have ended when the other has begun, or the world may not have seen who asks for a ball.
    while not (answer.startswith("a ball: ") and re.search(r"^step \d+: 2 people; ", watched, re.MULTILINE)):
        part = conference.example("11_take_part.py", "lab", conference.hub, "15")
        while part.poll() is None:
            watched += conference.watched(6.0)
        answer, _ = part.communicate()
        print(answer, watched)
        assert part.returncode == 0, answer
    steps = [int(n) for n in re.findall(r"^step (\d+): ", watched, re.MULTILINE)]
    assert len(steps) > 2 and steps == sorted(set(steps))


def test_a_world_that_is_stopped_is_started_again_and_goes_on(conference: Conference) -> None:
    hangs = conference.find("hub/world")
    assert hangs is not None
    before = int(re.findall(r"^step (\d+): ", conference.watched(1.0), re.MULTILINE)[-1])
    psutil.Process(hangs).send_signal(signal.SIGSTOP)
    conference.wait_until(lambda: conference.find("hub/world") not in (None, hangs))
    after = [int(n) for n in re.findall(r"^step (\d+): ", conference.watched(1.0), re.MULTILINE)]
    assert min(after) > before - 120
    assert "event=process_hangs process=hub/world" in (conference.out / "logs" / "supervisor.log").read_text()
    conference.process.send_signal(signal.SIGINT)
    text, _ = conference.process.communicate(timeout=600)
    assert conference.process.returncode == 0, text
    report = json.loads((conference.out / "report.json").read_text())
    assert report["processes"]["hub/world"]["restarts"] >= 1  # on a machine that stands still for so long others hang, too


def test_ctrl_c_before_the_first_picture_is_no_error(tmp_path: Path) -> None:
    file = tmp_path / "short.toml"
    file.write_text(FILE.replace('"small"', '"short"'))
    command = [sys.executable, "-m", "vistel_cli.main", "up", str(file), "--out", str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as starting:
        assert starting.stdout is not None
        begun = next((line for line in starting.stdout if line.startswith("  folder")), "")
        starting.send_signal(signal.SIGINT)
        text = starting.stdout.read()
    assert begun and starting.returncode == 0, text
    assert "stopped before every site had a picture of everybody" in text
    assert "error" not in text
