"""The session with the clay: what its file says happens to the lump in the world."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.conference.room_things import extras_of
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.room import TABLE_HEIGHT, meeting_room
from vistel.space.view import WorldView
from vistel.space.world import World
from vistel_sim.motion import open_motion
from vistel_sim.motion.source import MotionError

FILE = Path(__file__).parents[3] / "examples/conferences/clay.toml"


@pytest.fixture(scope="module")
def views() -> list[WorldView]:
    """Fourteen seconds of the file, thirty steps of motion a second."""
    conference = load(FILE)
    source, world = open_motion(conference), World(meeting_room(conference.room.seats, extras_of(conference.room)))
    people = [p for s in conference.sites for p in s.participants]
    out = []
    for k in range(1, 14 * 60):
        motions = tuple(MotionInput(p.name, source.posture(p.name, k / 60), k, k * 16_666_667) for p in people)
        new = tuple(ParticipantBody(p.name, p.height) for p in people) if k == 1 else ()
        out.append(world.step(StepInputs(k, k * 16_666_667, new, motions)))
    return out


def test_the_palm_the_finger_and_both_palms_leave_their_dents(views: list[WorldView]) -> None:
    assert not views[130].dents
    palm, poke, both = len(views[260].dents), len(views[570].dents), len(views[-1].dents)
    assert 4 <= palm < poke < both <= 48
    assert all(d.maker == "aiko" for d in views[-1].dents)


def test_the_lump_stays_on_the_table_about_where_it_was(views: list[WorldView]) -> None:
    for view in views:
        lump = next(s for s in view.states if s.id == "clay")
        assert np.hypot(lump.position[0], lump.position[2] + 0.305) < 0.06
        assert TABLE_HEIGHT + 0.02 < lump.position[1] < TABLE_HEIGHT + 0.06


def test_the_hands_feel_it(views: list[WorldView]) -> None:
    felt = [t.normal_force for v in views for h in v.hands for t in h.touches if t.body == "clay"]
    assert max(felt) > 3.0
    assert np.isfinite(felt).all()


def test_without_anything_soft_the_choreography_is_refused() -> None:
    data = {"sites": [{"name": "a", "participants": [{"name": "ann", "motion": "clay"}]}]}
    with pytest.raises(MotionError, match=r"clay: needs a \[\[room.things\]\]"):
        open_motion(Conference.model_validate(data))


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ('id = "ball"', "'ball' stands in the room already"),
        ('id = "x"\nshape = "cube"', "room.things"),
        ('id = "x"\nmaterial = "plasic"', "room.things"),
        ('id = "x"\nrigidity = 2.0', "room.things"),
        ('id = "x"\ncolour = "red"', "room.things"),
        ('id = "x"\nsize = nan', "room.things"),
        ('id = "x"\nat = [0.0, 9.0]', "within 4 m"),
        ('id = "x"\n[[room.things]]\nid = "x"', "'x' stands in the room already"),
    ],
)
def test_a_thing_that_cannot_be_is_reported_in_a_line(tmp_path: Path, line: str, what: str) -> None:
    file = tmp_path / "c.toml"
    file.write_text(f'[[room.things]]\n{line}\n[[sites]]\nname = "a"\n[[sites.participants]]\nname = "ann"\n')
    with pytest.raises(ConferenceError, match=what):
        load(file)
