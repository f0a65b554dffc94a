"""Compiles kernels and makes built-in people once, and keeps both on disk.

Without this, every process of the first conference would compile the same kernels at the same time. Runs as

    python -m vistel_cli.run.prepare CONFERENCE.toml [--no-figures]

in a process of its own (its memory goes back), which forks one more for each core. They take one step after the other, and
print lines for the progress bar of `vistel_cli.run.prepared`: `steps COUNT`, then `begun NAME`, `kernel NAME` for each that a
step compiles, and `done NAME`.
"""

from __future__ import annotations

import contextlib
import gc
import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing.connection import wait
from pathlib import Path

import numpy as np

from vistel.capture import body as capture
from vistel.conference.files import DEMO_FILE, load
from vistel.conference.model import Conference
from vistel.conference.room_things import extras_of
from vistel.figure.avatar.cache_folder import file_lock
from vistel.figure.figure import Figure
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import Posture, standing
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.render.figures.people import load_figure
from vistel.render.preparation import compile_filter
from vistel.render.stage.stage import ParticipantInfo
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.room import meeting_room
from vistel.space.world import World
from vistel.wire import motion as motion_codec
from vistel_cli.run.compile_in_turn import compile_in_turn
from vistel_cli.run.prepared import DRAWING, INTERRUPTED, KERNELS, NO_FIGURES, ROOM, lock_of_this_copy, people_of, stamps_of
from vistel_services.world.service import warm_up
from vistel_sim import rotations
from vistel_sim.motion import open_motion

Step = tuple[str, Callable[..., object], tuple[object, ...]]
"""What it is called, what does it, and with what."""

_doing = ""
"""What this process is doing."""


def _by_the_meeting(conference: Conference) -> Conference:
    """Everybody is moved by the built-in choreography: a recording may be on another site's machine."""
    data = conference.model_dump(mode="json", exclude_none=True)
    for site in data["sites"]:
        for p in site["participants"]:
            p.pop("motion", None)
    return Conference.model_validate(data)


def _steps(conference: Conference, *, draws: bool) -> list[Step]:
    """What is not made yet, in this order: neighbours share few kernels, and the long ones come first."""
    steps: list[Step] = []
    for part, stamp in stamps_of(conference, draws=draws).items():
        if stamp.exists():
            continue
        if part == KERNELS:
            demo = load(DEMO_FILE)  # of people enough for all that people do to each other
            steps.append(("compiling the world", _compile_world, (demo,)))
            steps.append(("compiling posture", _compile_posture, (demo,)))
            steps.append(("compiling the motion codec", motion_codec.warm_up, ()))
        elif part == ROOM:
            steps.append(("compiling the room", _compile_world, (conference,)))
        elif part == DRAWING:
            steps.insert(0, ("compiling deformation", _compile_figures, (conference,)))
        elif not isinstance(part, str) and part[0].startswith("builtin"):
            spec, name, height = part
            steps.append((f"making the avatar of {name}", load_figure, (ParticipantInfo(name, name, spec, height),)))
    return steps


def _compile_posture(conference: Conference) -> None:
    motion = open_motion(conference)
    for site in conference.sites:
        for p in site.participants:
            motion.receivers(p.name, 0.0)
            motion.hand_angles(p.name, 0.0)
    capture.warm_up()
    rotations.warm_up()


def _compile_world(conference: Conference) -> None:
    """Two steps with everybody at the table, moved by the motion source."""
    motion = open_motion(conference)
    keys = conference.room
    if keys.from_files:  # rooms made from foreign files are kept from now on
        from vistel.conference.rooms import interior_of

        room = interior_of(keys).room
    else:
        room = meeting_room(keys.seats, extras_of(keys))
    world = World(room)
    people = [p for s in conference.sites for p in s.participants]
    persons = tuple(ParticipantBody(p.name, p.height) for p in people)
    for step in (1, 2):
        motions = tuple(MotionInput(p.name, motion.posture(p.name, 0.0), step, step) for p in people)
        world.step(StepInputs(step, step, persons if step == 1 else (), motions))
    World.restore(world.snapshot())
    warm_up()


def _compile_figures(conference: Conference) -> None:
    """Somebody next to somebody else and to a thing of every kind."""
    # An avatar file needs the same kernels as a built-in person.
    spec, name, height = people_of(conference)[0]
    spec = spec if spec.startswith("builtin") else "builtin"
    avatar = builtin_avatar(spec, name=name, height=height).coarser[-1]
    one, other = Figure(avatar), Figure(avatar)
    posed = one.pose(standing()).posed
    kinds = ("sphere", "cone_sphere", "rounded_polygon", "superellipsoid", "supertoroid")
    params = (
        (0.1,),
        (0, 0, 0, 0.1, 0, 0, 0.1, 0.1),
        (0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1, 0),
        (0.1, 0.1, 0.1, 1, 1),
        (0.1, 0.1, 0.1, 2, 1, 1),
    )
    things = PrimitiveSet.of_kinds(kinds, params, np.tile(np.eye(3), (5, 1, 1)), np.tile((0.0, 1.2, 0.1), (5, 1)))
    other.pose(Posture(), [one.ghosts(posed), ghosts_of(things, compliance=0.0)])
    compile_filter()


def _say(line: str) -> None:
    """One write for a line: those of several processes do not mix."""
    os.write(1, f"{line}\n".encode())


def _begin_worker() -> None:
    """Take turns with the other workers; end when the process that began them all has ended; leave Ctrl-C to it."""
    # A tenth of the time went into looking for garbage; a worker lives for a minute.
    gc.freeze()
    gc.set_threshold(100_000, 50, 50)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=lambda: wait([parent.sentinel]) and os._exit(1), daemon=True).start()
    compile_in_turn(lambda: _say(f"kernel {_doing}"))


def _do(step: Step) -> str:
    """Do it in a worker. Returns what it is called."""
    global _doing
    _doing, function, arguments = step
    _say(f"begun {_doing}")
    function(*arguments)
    return _doing


def _run(steps: list[Step]) -> None:
    """All steps, on all cores. Raises what a step raises."""
    _say(f"steps {len(steps)}")
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    with ProcessPoolExecutor(os.cpu_count(), context, _begin_worker) as pool:
        try:
            for done in as_completed([pool.submit(_do, step) for step in steps]):
                _say(f"done {done.result()}")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():
                worker.kill()
            raise


def main() -> None:
    """Entry point of the child."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    logging.getLogger().addHandler(logging.NullHandler())  # what a log says of people, their renderers' logs will have
    conference, draws = _by_the_meeting(load(Path(sys.argv[1]))), NO_FIGURES not in sys.argv
    try:
        # Sites that start together on one machine prepare one after the other: the second finds all done.
        print("begun waiting for another `vistel`, which prepares the same", flush=True)
        with file_lock(lock_of_this_copy()):
            print("begun loading", flush=True)
            _run(_steps(conference, draws=draws))
            with contextlib.suppress(OSError):  # an unwritable cache only means preparing again
                for stamp in stamps_of(conference, draws=draws).values():
                    stamp.touch()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
