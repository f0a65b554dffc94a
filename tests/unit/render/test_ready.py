"""What was made ahead is in the first picture."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from vistel.conference.model import Conference, Participant, Site
from vistel.figure.posture.posture import standing
from vistel.render import preparation as ready
from vistel.render.figures.figures import DrawableFigure, StandIn
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow

HEIGHT = 1.64
CONFERENCE = Conference(
    sites=[
        Site(name="tokyo", participants=[Participant(name="aiko", display_name="Aiko", height=HEIGHT)]),
        Site(name="zurich", participants=[Participant(name="carla", avatar="missing.vrm")]),
    ]
)
AIKO = ParticipantInfo("aiko", "somebody", "builtin", float(np.float32(HEIGHT)))
"""As the wire says it."""


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, DrawableFigure]]:
    """The figures `preload` has made; loading one takes no file and no time."""
    out: dict[str, DrawableFigure] = {}

    def load(about: ParticipantInfo, **_given: object) -> DrawableFigure:
        if not about.avatar.startswith("builtin"):
            raise FileNotFoundError(about.avatar)
        return out.setdefault(about.name, StandIn(about.height))

    monkeypatch.setattr(ready, "load_figure", load)
    ready.preload(CONFERENCE)
    yield out
    ready._figures.clear()
    ready._rooms.clear()


def test_a_figure_made_ahead_is_handed_out_once_and_only_to_whom_it_fits(made: dict[str, DrawableFigure]) -> None:
    assert ready.take_figure(ParticipantInfo("aiko", "Aiko", "builtin", 1.65)) is None
    assert ready.take_figure(ParticipantInfo("aiko", "Aiko", "builtin:person=aiko", HEIGHT)) is None
    assert ready.take_figure(AIKO) is made["aiko"]
    assert ready.take_figure(AIKO) is None


def test_an_avatar_that_cannot_be_had_keeps_nobody_else_from_being_made(made: dict[str, DrawableFigure]) -> None:
    assert set(made) == {"aiko"}
    assert ready.take_figure(ParticipantInfo("carla", "carla", "missing.vrm", 1.75)) is None


def test_a_room_made_ahead_is_the_room_that_would_be_made(made: dict[str, DrawableFigure]) -> None:
    panels, furniture = ready.take_room(CONFERENCE.room.seats)
    again, furniture_again = ready.take_room(CONFERENCE.room.seats)
    assert furniture is not furniture_again
    assert np.array_equal(furniture.tint, furniture_again.tint)
    assert all(np.array_equal(a.texture, b.texture) for a, b in zip(panels, again, strict=True))


@pytest.mark.gl
def test_the_first_picture_shows_those_made_ahead_and_no_stand_ins(made: dict[str, DrawableFigure]) -> None:
    studio = SceneRenderer(View(160, 90, "room", ""), CONFERENCE.room.seats, load=lambda about: pytest.fail("loaded"))
    try:
        studio.render(Instant(0, (PersonNow(AIKO, standing(), Timing(0, 0, 0, False)),)))
        assert studio.stand_ins == 0
        assert studio._cast["aiko"].shape is made["aiko"]
    finally:
        studio.close()
