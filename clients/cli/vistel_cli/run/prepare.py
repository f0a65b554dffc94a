"""Compiles kernels and makes built-in people once, and keeps both on disk.

Without this, every process of the first conference would compile the same kernels at the same time. Runs as

    python -m vistel_cli.run.prepare CONFERENCE.toml

in a process of its own (its memory goes back), which prints a line per step for the progress bar of `vistel_cli.run.prepared`:
the steps done, the number of steps, and the name of the next one.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from vistel.conference.files import load
from vistel.conference.model import Conference
from vistel.conference.room_things import extras_of
from vistel.figure.avatar.cache_folder import default_cache, file_lock
from vistel.figure.figure import Figure
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import Posture, standing
from vistel.figure.posture.solve import PostureSolver
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.render.figures.people import load_figure
from vistel.render.preparation import compile_filter
from vistel.render.stage.stage import ParticipantInfo
from vistel.space.inputs import MotionInput, Person, StepInputs
from vistel.space.room import meeting_room
from vistel.space.world import World
from vistel.wire import motion as motion_codec
from vistel_cli.run.prepared import INTERRUPTED, people_of, stamp_of
from vistel_services.world.service import warm_up
from vistel_sim.motion import open_motion

Step = tuple[str, Callable[[], object]]


def _by_the_meeting(conference: Conference) -> Conference:
    """Everybody is moved by the built-in choreography: a recording may be on another site's machine."""
    data = conference.model_dump(mode="json", exclude_none=True)
    for site in data["sites"]:
        for p in site["participants"]:
            p.pop("motion", None)
    return Conference.model_validate(data)


def _steps(conference: Conference) -> list[Step]:
    steps: list[Step] = [
        ("compiling motion and posture", lambda: _compile_posture(conference)),
        ("compiling the world", lambda: _compile_world(conference)),
    ]
    for spec, name, height in people_of(conference):
        if spec.startswith("builtin"):
            steps.append((f"making {name}", lambda s=spec, n=name, h=height: load_figure(ParticipantInfo(n, n, s, h))))
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
    persons = tuple(Person(p.name, p.height) for p in people)
    for step in (1, 2):
        motions = tuple(MotionInput(p.name, motion.posture(p.name, 0.0), step, step) for p in people)
        world.step(StepInputs(step, step, persons if step == 1 else (), motions))
    World.restore(world.snapshot())
    warm_up()


def _compile_figures(conference: Conference) -> None:
    """Somebody next to somebody else and to a thing of every kind."""
    # An avatar file needs the same kernels as a built-in person.
    spec, name, height = people_of(conference)[0]
    spec = spec if spec.startswith("builtin") else "builtin:seed=0"
    avatar = builtin_avatar(spec, name=name, height=height)
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
    PostureSolver(avatar.skeleton).solve(0.0, {})
    compile_filter()


def _run(conference: Conference) -> Iterator[str]:
    steps = _steps(conference)
    for done, (label, step) in enumerate(steps):
        yield f"{done} {len(steps)} {label}"
        step()


def main() -> None:
    """Entry point of the child."""
    conference = _by_the_meeting(load(Path(sys.argv[1])))
    try:
        # Sites that start together on one machine prepare one after the other: the second finds all done.
        with file_lock(default_cache().parent / "prepare.lock"):
            if stamp_of(conference).exists():
                return
            for line in _run(conference):
                print(line, flush=True)
            with contextlib.suppress(OSError):  # an unwritable cache only means preparing again
                stamp_of(conference).touch()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
