"""Random faults under a real conference of four sites, and what came of it: `python -m vistel_sim.chaos --minutes 30 --seed 1`."""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import psutil

from vistel.conference.connect import connect
from vistel.conference.files import load
from vistel.conference.model import HUB_PLACE
from vistel.conference.running import running_conferences
from vistel.v1.service_pb2 import FaultReply, FaultRequest
from vistel.v1.world_pb2 import WorldMoveReply, WorldMoveRequest
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus
from vistel_sim.chaos.asker import Asker
from vistel_sim.chaos.invariants import Span
from vistel_sim.chaos.plan import MOVE, Planned, planned
from vistel_sim.chaos.witness import Witness

NAME = "chaos"
PEOPLE = {"tokyo": "aiko", "columbus": "ben", "zurich": "carla", "lima": "dario"}
"""Who is where. The first site has a world that waits."""
LOOKS = {"aiko": (1.64, "person=aiko"), "ben": (1.82, "person=ben"), "carla": (1.71, "person=carla")}
"""Those of the demo, who are made once; others look like the first."""
DRAWING = ("tokyo", "lima")
"""Sites whose pictures are drawn."""
DISPLAY = ("video = false", "width = 96", "height = 72", "frames_per_s = 8", 'light = "fast"', "layers = false", "wrinkles = false")
"""Of those."""
START_S = 300.0
"""The longest wait for the beginning."""
CLOCK_SETTLES_S = 12.0
"""So long after the hub's clock was set all processes have followed it."""
TOLD_EVERY_S = 60.0
"""From one line to the next where nothing strikes."""
PROCESS_NAME = re.compile(r"vistel: (\S+)")


@dataclass
class Outcome:
    """What happened, beside what the witness heard."""

    struck: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    clock_steps: list[Span] = field(default_factory=list[Span])
    memory_before: dict[str, int] = field(default_factory=dict[str, int])
    memory_after: dict[str, int] = field(default_factory=dict[str, int])
    files_before: dict[str, int] = field(default_factory=dict[str, int])
    files_after: dict[str, int] = field(default_factory=dict[str, int])
    asked: int = 0
    done: int = 0
    refused: int = 0
    late: int = 0
    exit_code: int | None = None


def conference_file() -> str:
    """Four sites, a world at the hub, and one that waits at the first site. Two sites draw, small pictures and few of them: two
    cores shall be enough for all."""
    first = next(iter(PEOPLE))
    lines = [
        f'name = "{NAME}"',
        "record_raw = false",
        "[room]",
        "seats = 4",
        "[world]",
        f'waiting = ["{first}"]',
        'folder = "room"',
    ]
    for site, person in PEOPLE.items():
        height, look = LOOKS.get(person, LOOKS["aiko"])
        lines += ["[[sites]]", f'name = "{site}"', f"processes = {json.dumps(_groups(site))}", "[sites.display]", *DISPLAY]
        lines += ["[[sites.participants]]", f'name = "{person}"', f"height = {height}", f'avatar = "builtin:{look}"']
    return "\n".join(lines) + "\n"


def _groups(site: str) -> list[list[str]]:
    capture = ["tracker", "glove", "face", "posture"]
    return [capture, ["renderer"]] if site in DRAWING else [capture]


def processes() -> list[str]:
    """Those that may be struck."""
    hub = ["hub/world", f"hub/world-{next(iter(PEOPLE))}", "hub/recorder", "hub/sim"]
    return [*hub, *(f"{site}/capture" for site in PEOPLE), *(f"{site}/renderer" for site in DRAWING)]


async def run(folder: Path, seed: int, lasting_s: float, quiet_s: float, *, faults: bool = True) -> Outcome:
    """A conference in `folder`, under faults for `lasting_s`, or as long without; quiet_s: before and after that."""
    file, out = folder / "conference.toml", folder / "out"
    file.write_text(conference_file(), "utf-8")
    command = (sys.executable, "-m", "vistel_cli.main", "up", file.name, "--out", "out", "--simulate-links", "--json")
    with (folder / "up.log").open("ab") as log:
        up = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log)
    try:
        router = await _within(START_S, lambda: next((r.hub for r in running_conferences(NAME) if r.folder == str(out)), ""), up)
        return await _under_faults(_Running(up, router, out), folder / "heard.mcap", seed, lasting_s, quiet_s, faults)
    finally:
        if up.poll() is None:
            up.kill()
            up.wait()


@dataclass(frozen=True)
class _Running:
    up: subprocess.Popen[bytes]
    router: str
    out: Path

    def link(self, site: str) -> str:
        """Where the site finds the router."""
        text = (self.out / "logs/supervisor.log").read_text("utf-8")
        return re.findall(rf"event=simulated_link site={site} endpoint=(\S+)", text)[-1]


async def _under_faults(here: _Running, heard: Path, seed: int, lasting_s: float, quiet_s: float, faults: bool) -> Outcome:
    outcome, conference = Outcome(), load(here.out.parent / "conference.toml")
    witness = await Witness.open(conference, here.router, heard)
    async with background.service("witness") as beside:
        beside.start(witness.run(), "hear")
        everybody = {site: set(PEOPLE.values()) for site in DRAWING}
        await _within(START_S, lambda: witness.seen == everybody, here.up)
        askers = [
            await Asker.open(conference, site, here.link(site), who, random.Random(f"{seed} {who}")) for site, who in PEOPLE.items()
        ]
        hub = await connect(conference, HUB_PLACE, SystemClock(), here.router)
        asking = [beside.start(a.run(), "ask") for a in askers]
        await asyncio.sleep(quiet_s)
        outcome.memory_before, outcome.files_before = measured(here.up.pid)
        if faults:
            await _strike(planned(seed, lasting_s, list(PEOPLE), processes(), ["hub", next(iter(PEOPLE))]), hub, outcome, here.up)
        else:
            await _wait(lasting_s, here.up)
        await asyncio.sleep(quiet_s)
        for task in asking:
            task.cancel()
        await asyncio.sleep(3.0)
        outcome.memory_after, outcome.files_after = measured(here.up.pid)
        for a in askers:
            outcome.asked, outcome.done = outcome.asked + a.asked, outcome.done + a.done
            outcome.refused, outcome.late = outcome.refused + a.refused, outcome.late + a.late
            await a.close()
        await hub.close()
    await witness.close()
    here.up.send_signal(signal.SIGINT)
    outcome.exit_code = await asyncio.to_thread(here.up.wait, 60)
    return outcome


async def _strike(plan: list[Planned], hub: ZenohBus, outcome: Outcome, up: subprocess.Popen[bytes]) -> None:
    """Strike one after the other, and wait until all is mended."""
    begun, over_s = time.monotonic(), 0.0
    clock = SystemClock()
    for each in plan:
        await asyncio.sleep(max(0.0, begun + each.at_s - time.monotonic()))
        _check_runs(up)
        said = await (_move(hub, each.target) if each.name == MOVE else _ask_for(hub, each))
        print(f"{time.monotonic() - begun:7.1f} s  {said}", flush=True)
        outcome.struck.append(asdict(each) | {"said": said})
        lasts_s = each.seconds or 0.0
        over_s = max(over_s, time.monotonic() + lasts_s)
        if each.name == "clock-step":
            end_s = lasts_s + CLOCK_SETTLES_S
            outcome.clock_steps.append(Span(clock.now_ns() - 1_000_000_000, clock.now_ns() + round(end_s * 1e9)))
    await asyncio.sleep(max(0.0, over_s - time.monotonic()))


async def _wait(seconds: float, up: subprocess.Popen[bytes]) -> None:
    """So long, with a line now and then of the memory of all processes."""
    begun = time.monotonic()
    while (passed := time.monotonic() - begun) < seconds:
        _check_runs(up)
        memory, files = measured(up.pid)
        print(f"{passed:7.0f} s  {sum(memory.values()) / 1e6:.0f} MB, {sum(files.values())} files open", flush=True)
        await asyncio.sleep(min(TOLD_EVERY_S, seconds - passed))


async def _ask_for(hub: ZenohBus, each: Planned) -> str:
    request = FaultRequest(name=each.name, target=each.target, seconds=each.seconds, amount=each.amount)
    for _ in range(10):  # the router may be away
        reply: FaultReply | None = await hub.query(BY_NAME["fault"], request)
        if reply is not None:
            return reply.struck or f"refused: {reply.refused}"
    return f"{each.name}: no answer"


async def _move(hub: ZenohBus, place: str) -> str:
    reply: WorldMoveReply | None = await hub.query(BY_NAME["world_move"], WorldMoveRequest(place=place))
    return f"move {place}: {WorldMoveReply.Outcome.Name(reply.outcome) if reply is not None else 'no answer'}"


def measured(up: int) -> tuple[dict[str, int], dict[str, int]]:
    """Resident memory [bytes] and open files of the processes of a conference, by name. up: the process of `vistel up`."""
    top = psutil.Process(up)
    memory, files = {"vistel up": top.memory_info().rss}, {"vistel up": top.num_fds()}
    for child in top.children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):  # it just ended
            words = " ".join(child.cmdline())
            name = PROCESS_NAME.search(words)
            node = name[1] if name else next((n for n in processes() if n in words.split()), "")
            if node:
                memory[node], files[node] = child.memory_info().rss, child.num_fds()
    return memory, files


async def _within(seconds: float, found: Any, up: subprocess.Popen[bytes]) -> Any:
    """What `found` gives, as soon as it gives something."""
    end = time.monotonic() + seconds
    while not (what := found()):
        _check_runs(up)
        if time.monotonic() > end:
            raise TimeoutError(f"the conference did not begin within {seconds:.0f} s; see up.log and out/logs")
        await asyncio.sleep(0.2)
    return what


def _check_runs(up: subprocess.Popen[bytes]) -> None:
    if up.poll() is not None:
        raise ChildProcessError(f"`vistel up` ended with {up.returncode}; see up.log")


def counts(outcome: Outcome) -> dict[str, int]:
    """How often each fault was struck."""
    return dict(sorted(Counter(s["name"] for s in outcome.struck if not s["said"].startswith("refused")).items()))


def save(outcome: Outcome, path: Path) -> None:
    """As JSON."""
    path.write_text(json.dumps(asdict(outcome), indent=1) + "\n", "utf-8")
