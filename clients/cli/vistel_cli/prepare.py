"""What a conference needs made once: compiled kernels and built-in people, both kept on disk.

Without this, every process of the first conference would compile the same kernels at the same time. Runs as

    python -m vistel_cli.prepare CONFERENCE.toml

in a process of its own (its memory goes back), which prints a line per step for the progress bar.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numba
import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

import vistel
from vistel.conference.files import load
from vistel.conference.model import Conference, Room
from vistel.figure.avatar import builtin_avatar
from vistel.figure.avatar_builtin import by_turns, default_cache
from vistel.figure.figure import Figure
from vistel.figure.posture import Posture, standing
from vistel.figure.solve import PostureSolver
from vistel.implicit.contact_set import PrimitiveSet
from vistel.implicit.ghost import ghosts_of
from vistel.space.inputs import MotionInput, Person, StepInputs
from vistel.space.room import meeting_room
from vistel.space.world import World
from vistel.wire import motion as motion_codec
from vistel_cli.terminal import err, fail
from vistel_services.renderer.antialias import antialias
from vistel_services.renderer.people import load_shape
from vistel_services.renderer.stage import About
from vistel_services.world.service import warm_up
from vistel_sim.motion import open_motion

INTERRUPTED = 130
Step = tuple[str, Callable[[], object]]


async def prepare(conference: Conference, file: Path, stop: asyncio.Event, *, silent: bool = False) -> bool:
    """Make what is missing, with progress; at once when all is there. False when `stop` was set meanwhile.

    Exits with one line when it fails.
    """
    stamp = _stamp(conference)
    if stamp.exists():
        return True
    columns = (TextColumn("preparing, once: {task.description}"), BarColumn(bar_width=20), TimeElapsedColumn())
    command = (sys.executable, "-m", "vistel_cli.prepare", str(file))
    with Progress(*columns, console=err, transient=True, disable=silent) as bar:
        task = bar.add_task("starting", total=len(_steps(conference)))
        child = await asyncio.create_subprocess_exec(*command, stdout=subprocess.PIPE)

        async def follow() -> None:
            assert child.stdout is not None
            done = 0
            async for line in child.stdout:
                bar.update(task, completed=done, description=line.decode().strip())
                done += 1

        following, stopping = asyncio.create_task(follow()), asyncio.create_task(stop.wait())
        await asyncio.wait({following, stopping}, return_when=asyncio.FIRST_COMPLETED)
        stopping.cancel()
        if not following.done():
            with contextlib.suppress(ProcessLookupError):
                child.terminate()
        await following
        code = await child.wait()
    if stop.is_set() or code in (INTERRUPTED, -signal.SIGINT, -signal.SIGTERM):
        return False
    if code != 0:
        fail(f"preparing the conference failed with {code}; `python -m vistel_cli.prepare {file}` shows why")
    return True


def _stamp(conference: Conference) -> Path:
    """A file that is there when all has been made."""
    return default_cache().parent / f"prepared-{_fingerprint(conference)}"


def _fingerprint(conference: Conference) -> str:
    text = f"{sys.version} {numba.__version__} {_people(conference)}"
    if conference.room.from_files:
        text += f" {conference.room.model_dump_json()} {_newest(conference.room)}"
    for source in sorted(Path(vistel.__file__).parent.rglob("*.py")):
        text += f" {source.name} {source.stat().st_mtime_ns}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _newest(room: Room) -> list[int]:
    """When the files of a room were last changed; 0 for those that are not there."""
    files = [f for f in (room.file, *(t.file for t in room.things)) if f is not None]
    return [f.stat().st_mtime_ns if f.is_file() else 0 for f in files]


def _by_the_meeting(conference: Conference) -> Conference:
    """Everybody moved by the built-in choreography: a recording may lie on another site's machine."""
    data = conference.model_dump(mode="json", exclude_none=True)
    for site in data["sites"]:
        for p in site["participants"]:
            p.pop("motion", None)
    return Conference.model_validate(data)


def _people(conference: Conference) -> list[tuple[str, str, float]]:
    return [(p.avatar, p.name, p.height) for s in conference.sites for p in s.participants]


def _steps(conference: Conference) -> list[Step]:
    steps: list[Step] = [
        ("compiling motion and posture", lambda: _compile_posture(conference)),
        ("compiling the world", lambda: _compile_world(conference)),
    ]
    for spec, name, height in _people(conference):
        if spec.startswith("builtin"):
            steps.append((f"making {name}", lambda s=spec, n=name, h=height: load_shape(About(n, n, s, h))))
    steps.append(("compiling deformation", lambda: _compile_figures(conference)))
    steps.append(("compiling the motion codec", motion_codec.warm_up))
    return steps


def _compile_posture(conference: Conference) -> None:
    motion = open_motion(conference)
    for site in conference.sites:
        for p in site.participants:
            motion.receivers(p.name, 0.0)
            motion.hand_angles(p.name, 0.0)


def _compile_world(conference: Conference) -> None:
    """Two steps with everybody at the table, from what the motion source says."""
    motion = open_motion(conference)
    keys = conference.room
    if keys.from_files:  # what is made of files of others is kept from now on
        from vistel.conference.rooms import interior_of  # noqa: PLC0415

        room = interior_of(keys).room
    else:
        room = meeting_room(keys.seats, keys.extras())
    world = World(room)
    people = [p for s in conference.sites for p in s.participants]
    persons = tuple(Person(p.name, p.height) for p in people)
    for step in (1, 2):
        motions = tuple(MotionInput(p.name, motion.posture(p.name, 0.0), step, step) for p in people)
        world.step(StepInputs(step, step, persons if step == 1 else (), motions))
    World.restore(world.snapshot())
    warm_up()


def _compile_figures(conference: Conference) -> None:
    """Somebody next to somebody else and to a thing of every kind."""
    # An avatar file has the kernels of a built-in person, whom one without a file gets.
    spec, name, height = _people(conference)[0]
    spec = spec if spec.startswith("builtin") else "builtin:seed=0"
    avatar = builtin_avatar(spec, name=name, height=height)
    one, other = Figure(avatar), Figure(avatar)
    posed = one.pose(standing()).posed
    kinds = ("sphere", "cone_sphere", "rounded_polygon", "superellipsoid", "supertoroid")
    params = ((0.1,), (0, 0, 0, 0.1, 0, 0, 0.1, 0.1), (0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1, 0), (0.1, 0.1, 0.1, 1, 1),
              (0.1, 0.1, 0.1, 2, 1, 1))  # fmt: skip
    things = PrimitiveSet.of_kinds(kinds, params, np.tile(np.eye(3), (5, 1, 1)), np.tile((0.0, 1.2, 0.1), (5, 1)))
    other.pose(Posture(), [one.ghosts(posed), ghosts_of(things, compliance=0.0)])
    PostureSolver(avatar.skeleton).solve(0.0, {})
    antialias(np.zeros((8, 8, 4), np.uint8))


def _run(conference: Conference) -> Iterator[str]:
    for label, step in _steps(conference):
        yield label
        step()


def main() -> None:
    """Entry point of the child."""
    conference = _by_the_meeting(load(Path(sys.argv[1])))
    try:
        # Sites that start together on one machine prepare one after the other: the second finds all done.
        with by_turns(default_cache().parent / "prepare.lock"):
            if _stamp(conference).exists():
                return
            for label in _run(conference):
                print(label, flush=True)
            with contextlib.suppress(OSError):  # an unwritable cache only means preparing again
                _stamp(conference).touch()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
