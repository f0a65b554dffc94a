"""The room of a running conference, or of a log at a time, ready to be written."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from vistel.conference.model import Conference
from vistel.wire.log import LogError, LogReader
from vistel.wire.topics import BY_NAME
from vistel_cli.conference_choice import on_bus, site_here
from vistel_cli.log.piece import check_within
from vistel_cli.log.study import reading
from vistel_cli.terminal import FAILED, fail, print_warning

if TYPE_CHECKING:
    from vistel.space.files import Interior
    from vistel.space.world import World


def running(conference: Conference, hub: str) -> tuple[Interior, str]:
    """The room of a running conference, asked over its router, and a text with its step."""
    from vistel.space.world import World  # loads the mathematics

    site, world = site_here(conference, hub), f"the world of {conference.name} at {hub}"
    answer = on_bus(conference, site, hub, lambda bus: bus.query(BY_NAME["world_save"]), world)
    if answer is None:
        fail(f"no world answers at {hub}; is the conference {conference.name} running?", FAILED)
    world = World.restore(answer.private_state)
    return _interior(world, conference), f"as of step {world.step_number}"


def of_log(log: Path, at: float | None) -> tuple[Interior, str]:
    """The room of a log, `at` seconds after its beginning (None: at its end): the newest state recorded by then."""
    from vistel.space.world import World  # loads the mathematics

    try:
        reader = LogReader(log)
    except LogError as e:
        fail(str(e))
    if at is not None:
        check_within(reader, "--at", at)
    end_ns = None if at is None else reader.begin_ns + round(at * 1e9)
    state, when_ns = b"", 0
    records = reader.records(("world_inputs",), end_ns=end_ns)
    with reading(reader):
        for r in records:
            if r.message.private_state:
                state, when_ns = r.message.private_state, r.log_ns
    if not state:
        fail(f"{log}: no state of the world by then; they are recorded once a second, as world_inputs", FAILED)
    conference = None
    with contextlib.suppress(ValidationError):  # of another version: the looks of things stay unknown
        conference = Conference.model_validate(reader.conference) if reader.conference else None
    return _interior(World.restore(state), conference), f"as they were {(when_ns - reader.begin_ns) * 1e-9:.1f} s after it began"


def _interior(world: World, conference: Conference | None) -> Interior:
    """The things where they are. Things whose polymesh files are missing here are written as their primitives."""
    from vistel.conference.rooms import RoomFileError, interior_of
    from vistel.space.commands.reshape import unveiled
    from vistel.space.files import Interior
    from vistel.space.files.interior import looks_of

    models = {}
    try:
        if conference is not None and conference.room.from_files:
            models = dict(interior_of(conference.room).models)
    except RoomFileError as e:
        print_warning(f"{e}; written as their primitives")
    things = [t if all(k.model in models for k in looks_of(t)) else unveiled(t) for t in world.things_now]
    return Interior(replace(world.room, things=())).with_things(tuple(things), models)
