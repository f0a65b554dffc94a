"""How long a new user waits: from a fresh clone with nothing installed to a meeting, and for what comes after."""

import contextlib
import os
import pty
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from statistics import median

from benchmarks.progress import part
from benchmarks.row import Row, at_most

_ROOT = Path(__file__).resolve().parents[2]
_NOT_A_NEW_USERS = {"VIRTUAL_ENV", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR"}
HELP_RUNS = 5
LOOK_S = 0.1
MEETING_S = 20


@dataclass
class Heard:
    """What a command in a terminal printed, and when: seconds from its start. processor_s: of it and all it started."""

    pieces: list[tuple[float, bytes]] = field(default_factory=list[tuple[float, bytes]])
    picture_s: float | None = None
    whole_s: float = 0.0
    processor_s: float = 0.0
    code: int | None = None

    @property
    def text(self) -> bytes:
        return b"".join(piece for _, piece in self.pieces)

    def silence_s(self) -> float:
        """The longest time without a character."""
        times = [0.0, *(at for at, _ in self.pieces), self.whole_s]
        return max(b - a for a, b in pairwise(times))


def in_terminal(
    command: list[str], folder: Path, environment: dict[str, str], meanwhile: Callable[[Heard], bool] = lambda _: True
) -> Heard:
    """Runs `command` in a terminal of its own to its end. The first picture is there when a film in `folder`/out has bytes.

    meanwhile: called ten times a second; Ctrl-C is sent when it returns False.
    """
    heard, used, began = Heard(), _used(), time.monotonic()
    master, slave = pty.openpty()
    before = set(_films(folder))
    process = subprocess.Popen(
        command, cwd=folder, env=environment, stdin=slave, stdout=slave, stderr=slave, start_new_session=True
    )
    os.close(slave)
    reader = threading.Thread(target=_listen, args=(master, heard, began))
    reader.start()
    stopped = False
    while reader.is_alive():
        if heard.picture_s is None and set(_films(folder)) - before:
            heard.picture_s = time.monotonic() - began
        if not stopped and not meanwhile(heard):
            os.killpg(process.pid, signal.SIGINT)
            stopped = True
        reader.join(LOOK_S)
    heard.code = process.wait()
    os.close(master)
    heard.whole_s, heard.processor_s = time.monotonic() - began, _used() - used
    return heard


def _listen(master: int, heard: Heard, began: float) -> None:
    """Keeps what is printed until the terminal has no more writers. A thread, so that what is done meanwhile is no silence."""
    with contextlib.suppress(OSError):
        while piece := os.read(master, 65536):
            heard.pieces.append((time.monotonic() - began, piece))


def _films(folder: Path) -> Iterator[tuple[Path, int]]:
    for film in (folder / "out").glob("**/*.mp4"):
        if film.stat().st_size:
            yield film, film.stat().st_ino


def _used() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return children.ru_utime + children.ru_stime


def run() -> Iterator[Row]:
    """A clone of this checkout as it is committed, in a home of its own; pip fetches packages anew."""
    with tempfile.TemporaryDirectory(prefix="vistel-first-") as place:
        clone, home = Path(place) / "vistel", Path(place) / "home"
        home.mkdir()
        subprocess.run(["git", "clone", "-q", str(_ROOT), str(clone)], check=True)
        keep = {k: v for k, v in os.environ.items() if k not in _NOT_A_NEW_USERS and not k.startswith("PYTHON")}
        environment = keep | {"HOME": str(home), "TERM": "xterm", "COLUMNS": "100"}
        if sys.prefix != sys.base_prefix:  # the clone makes its own
            outside = [p for p in keep["PATH"].split(os.pathsep) if not p.startswith(sys.prefix)]
            environment["PATH"] = os.pathsep.join(outside)
        with part("make setup"):
            setup = in_terminal(["make", "setup"], clone, environment)
        if setup.code != 0:
            raise RuntimeError(f"make setup ended with {setup.code}: {setup.text[-300:].decode(errors='replace')}")
        yield from _told("make setup, fresh clone", setup)
        with part("make demo"):
            demo = in_terminal(["make", "demo", f"DEMO=--seconds {MEETING_S}"], clone, environment)
        if demo.code != 0 or demo.picture_s is None:
            raise RuntimeError(f"make demo ended with {demo.code}: {demo.text[-300:].decode(errors='replace')}")
        case = f"make demo, the first time, {MEETING_S} s of meeting"
        yield from _told(case, demo)
        yield _timed(case, "first picture", demo.picture_s, 90.0)
        yield _timed(case, "installation and meeting", setup.whole_s + demo.whole_s, 180.0)
        shutil.rmtree(clone / "out")
        yield from _warm(clone, environment)


def _told(case: str, heard: Heard) -> Iterator[Row]:
    yield _timed(case, "first word", heard.pieces[0][0], 1.0)
    yield _timed(case, "longest silence", heard.silence_s(), 2.0)
    yield _timed(case, "whole", heard.whole_s)
    yield _timed(case, "processor time", heard.processor_s)


def _warm(clone: Path, environment: dict[str, str]) -> Iterator[Row]:
    """A second meeting, and what is asked beside it."""
    vistel = str(clone / ".venv" / "bin" / "vistel")
    asked, refused = list[float](), list[str]()

    def ask(heard: Heard) -> bool:
        if heard.picture_s is None:
            return True
        began = time.monotonic()
        command = [vistel, "ask", "create", "red", "box", "here"]
        done = subprocess.run(command, cwd=clone, env=environment, capture_output=True, check=False)
        if done.returncode == 0:
            asked.append(time.monotonic() - began)
        else:
            refused.append((done.stdout + done.stderr).decode(errors="replace"))
        return len(asked) < 3 and len(refused) < 10

    with part("vistel up, warm"):
        warm = in_terminal([vistel, "up"], clone, environment, ask)
    if warm.picture_s is None:
        raise RuntimeError(f"vistel up ended with {warm.code}: {warm.text[-300:].decode(errors='replace')}")
    yield _timed("vistel up, warm", "first picture", warm.picture_s, 6.0)
    yield _timed("vistel up, warm", "longest silence", warm.silence_s(), 2.0)
    if not asked:
        raise RuntimeError(f"vistel ask: {refused[-1] if refused else warm.text[-300:]}")
    yield _timed("beside it", "vistel ask", median(asked), 1.0)
    helped: list[float] = []
    for _ in range(HELP_RUNS):
        began = time.monotonic()
        subprocess.run([vistel, "--help"], cwd=clone, env=environment, stdout=subprocess.DEVNULL, check=True)
        helped.append(time.monotonic() - began)
    yield _timed("alone", "vistel --help", median(helped), 0.3)


def _timed(case: str, metric: str, seconds: float, most: float | None = None) -> Row:
    return Row("first", case, metric, "s", round(seconds, 2), target=None if most is None else at_most(most))
