"""Panels: pages are put up where everybody sees them, turned, and taken away; what cannot be is refused in one line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from talking import ROOM, Talk, done, refused, stands

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.messages.commands import message_of
from vistel.messages.commands_read import action_of
from vistel.messages.world.encode import thing_message
from vistel.render.stage.world_view import thing_of
from vistel.space.actions import Delete, MoveBy, Present, PutAway, Scale, TurnPage, Undo
from vistel.space.arguments import THIS, Towards, Which
from vistel.space.commands.create import MOST_ID
from vistel.space.commands.panel import MOST_PAGES
from vistel.space.commands.phrase import read
from vistel.space.commands.presenting import MOST_LIVE, MOST_OF_ONE
from vistel.space.things.json_values import from_thing, to_thing
from vistel.space.world import World

PAGES = tuple(f"{n:032x}" for n in range(3))
SLIDES = Present(PAGES, 16 / 9, "slides")


def put_up(talk: Talk, action: Present = SLIDES, who: str = "ann") -> str:
    (panel,) = done(talk.say(action, who))
    return panel


def shown(talk: Talk, panel: str) -> str:
    return talk.thing(panel).looks[0].model


def test_a_panel_stands_by_itself_apart_from_seats_turned_to_the_table() -> None:
    talk = Talk()
    panel = put_up(talk)
    talk.wait(240)
    x, y, z = talk.place(panel)
    away = math.hypot(x, z)
    assert away > 1.4
    assert all(math.dist((x, z), (s.position[0], s.position[2])) > 0.7 for s in ROOM.seats)
    turned = matrix_from_quaternion(talk.play.thing(panel).rotation)
    assert float(turned[:, 2] @ np.array([-x, 0.0, -z])) / away > 0.99, "its front faces the middle"
    assert turned[1, 1] > 0.9999, "it does not lean"
    assert y == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize(
    ("title", "names"),
    [("slides", ("slides", "slides-2", "slides-3")), ("Q3 results", ("q3-results", "q3-results-2")), ("", ("panel", "panel-2"))],
)
def test_a_panel_is_called_after_its_title_and_found_by_that(title: str, names: tuple[str, ...]) -> None:
    talk = Talk()
    assert tuple(put_up(talk, Present(PAGES, 1.5, title)) for _ in names) == names
    for name in names:
        assert done(talk.say(TurnPage(Which(name=name.replace("-", " ")), by=1.0))) == (name,)


@pytest.mark.parametrize("gone", [PutAway(), Delete(Which(name="panel"))], ids=["put away", "deleted"])
def test_a_panel_that_went_leaves_its_name_to_the_next_and_comes_back_once_that_has_gone(gone: PutAway | Delete) -> None:
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.9, 0.0, -1.5)})
    put_up(talk)
    done(talk.say(TurnPage(by=1.0), "ann"))
    done(talk.say(gone, "ann"))
    assert put_up(talk, SLIDES, "ben") == "slides"
    assert "there is another slides by now" in refused(talk.say(Undo(), "ann"))
    done(talk.say(Undo(), "ben"))
    assert done(talk.say(Undo(), "ann")) == ("slides",)
    assert shown(talk, "slides") == PAGES[1]


def test_a_title_without_latin_letters_is_a_name_and_a_long_one_makes_a_short_id() -> None:
    talk = Talk()
    assert put_up(talk, Present(PAGES, 1.5, "ball")) == "ball-2", "the room has a ball"
    done(talk.say(PutAway(Which("ball-2"))))
    assert [put_up(talk, Present(PAGES, 1.5, title)) for title in ("結果", "概要", "x" * 60)] == ["panel", "panel-2", "x" * MOST_ID]
    assert done(talk.say(TurnPage(Which(name="概要"), by=1.0))) == ("panel-2",)
    assert [talk.thing(panel).name for panel in ("panel", "panel-2")] == ["結果", "概要"]


def test_a_panel_with_the_name_of_a_thing_is_meant_only_where_a_panel_is_asked_for() -> None:
    talk = Talk()
    panel = put_up(talk, Present(PAGES, 1.5, "ball"))
    assert done(talk.say(Scale(Which(name="ball"), 1.2))) == ("ball",)
    assert done(talk.say(TurnPage(Which(name="ball"), by=1.0))) == (panel,)
    assert done(talk.say(Scale(Which(name="panel"), 1.2))) == (panel,)
    done(talk.say(Delete(Which(thing="ball"))))
    assert done(talk.say(Scale(Which(name="ball"), 1.2))) == (panel,), "there is no other ball now"


@pytest.mark.parametrize("count", [1, 2, 3])
def test_it_stands_where_those_who_are_there_see_it(count: int) -> None:
    names = ("ann", "ben", "cas")[:count]
    talk = Talk(*names)
    postures = {name: stands(s.position[0], s.position[2], s.heading) for name, s in zip(names, ROOM.seats, strict=False)}
    talk.play.step(postures)
    place = talk.place(put_up(talk))
    turns: list[float] = []
    for seat in ROOM.seats[:count]:
        x, _, z = place - seat.position
        turns.append(abs(math.remainder(math.atan2(x, z) - seat.heading, 2.0 * math.pi)))
    assert min(turns) < math.radians(30.0), "somebody has it before them"
    assert max(turns) < math.radians(100.0), "and nobody behind them"


def test_pages_are_turned_by_one_and_by_number_and_end_at_the_ends() -> None:
    talk = Talk()
    panel = put_up(talk)
    assert shown(talk, panel) == PAGES[0]
    done(talk.say(TurnPage(by=1.0)))
    assert shown(talk, panel) == PAGES[1]
    done(talk.say(TurnPage(page=3.0)))
    assert shown(talk, panel) == PAGES[2]
    assert "it has 3, and shows page 3" in refused(talk.say(TurnPage(by=1.0)))
    done(talk.say(TurnPage(by=-2.0)))
    assert refused(talk.say(TurnPage(by=-1.0))).startswith("no such page of the panel ")
    done(talk.say(Undo()))
    assert shown(talk, panel) == PAGES[2]


def test_pages_are_turned_by_lines_that_people_type() -> None:
    talk = Talk()
    panel = put_up(talk)
    for line, page in (("next page", 1), ("page 3", 2), ("previous page", 1), ("next page slides", 2)):
        done(talk.say(read(line)))
        assert shown(talk, panel) == PAGES[page], line
    assert done(talk.say(read("put away slides"))) == (panel,)


def test_it_is_a_thing_like_others_and_keeps_its_pages() -> None:
    talk = Talk()
    panel = put_up(talk)
    wide = talk.thing(panel).looks[0].matrix[0, 0]
    done(talk.say(Scale(Which(name="panel"), 1.4)))
    assert talk.thing(panel).looks[0].matrix[0, 0] == pytest.approx(1.4 * wide)
    before = talk.place(panel).copy()
    done(talk.say(MoveBy(Which(name="slides"), Towards.AHEAD, 0.3)))
    talk.wait(120)
    assert np.linalg.norm(talk.place(panel) - before) == pytest.approx(0.3, abs=0.02)
    done(talk.say(TurnPage(by=1.0)))
    assert shown(talk, panel) == PAGES[1]
    assert talk.thing(panel).looks[0].matrix[0, 0] == pytest.approx(1.4 * wide)


def test_this_is_ones_own_newest_panel_else_the_newest_of_all() -> None:
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.9, 0.0, -1.5)})
    first = put_up(talk, Present(PAGES, 1.0, "a"), "ann")
    second = put_up(talk, Present(PAGES, 1.0, "b"), "ben")
    assert done(talk.say(TurnPage(by=1.0), "ann")) == (first,)
    assert done(talk.say(PutAway(), "ann")) == (first,)
    assert done(talk.say(TurnPage(by=1.0), "ann")) == (second,)
    assert done(talk.say(PutAway(Which(name="b")), "ben")) == (second,)
    assert refused(talk.say(TurnPage(by=1.0), "ben")) == "nobody shows anything; put something up first"


def test_several_panels_stand_apart() -> None:
    talk = Talk()
    places = [talk.place(put_up(talk)).copy() for _ in range(3)]
    assert min(math.dist(a, b) for n, a in enumerate(places) for b in places[:n]) > 1.65


@pytest.mark.parametrize(
    ("action", "why"),
    [
        (Present((), 1.0), "1 to 100 pages"),
        (Present(PAGES * MOST_PAGES, 1.0), "1 to 100 pages"),
        (Present(("../../etc/passwd",), 1.0), "32 hexadecimal digits"),
        (Present(PAGES, 0.0), "times as wide as high"),
        (Present(PAGES, math.inf), "not finite"),
        (TurnPage(Which(name="ball"), by=1.0), "shows no pages"),
        (TurnPage(by=math.nan), "not finite"),
        (TurnPage(by=1e300), "no such page"),
    ],
)
def test_what_cannot_be_shown_is_refused(action: Present | TurnPage, why: str) -> None:
    talk = Talk()
    if isinstance(action, TurnPage):
        put_up(talk)
    assert why in refused(talk.say(action))


def test_nobody_fills_the_room_with_panels() -> None:
    talk = Talk()
    for _ in range(MOST_OF_ONE):
        put_up(talk, Present(PAGES, 0.2))
    assert "put one away first" in refused(talk.say(SLIDES))
    done(talk.say(Delete(Which(name="panel-3"))))
    put_up(talk, Present(PAGES, 0.2))


def test_a_title_is_one_short_line() -> None:
    talk = Talk()
    panel = put_up(talk, Present(PAGES, 1.0, "a\n\x1b[31m" + "b" * 500))
    name = talk.thing(panel).name
    assert name.isprintable() and len(name) <= 60


def test_messages_and_snapshots_keep_what_a_panel_shows() -> None:
    talk = Talk()
    panel = put_up(talk)
    done(talk.say(TurnPage(by=1.0)))
    thing = talk.thing(panel)
    assert to_thing(from_thing(thing)).pages == thing.pages
    assert thing_of(thing_message(thing)).pages == thing.pages
    for action in (SLIDES, TurnPage(Which(name="x"), by=-1.0), TurnPage(page=4.0), PutAway(THIS)):
        assert action_of(message_of(action, "1", "ann")) == action
    with pytest.raises(ValueError, match="page"):
        to_thing(from_thing(thing) | {"pages": [list(PAGES), 3, "ann"]})


def test_a_room_that_is_restored_goes_on_the_same_to_the_bit() -> None:
    talk = Talk()
    panel = put_up(talk)
    done(talk.say(TurnPage(by=1.0)))
    again = World.restore(talk.play.world.snapshot())
    for action in (TurnPage(by=1.0), MoveBy(Which(panel), Towards.AHEAD, 0.2), PutAway()):
        talk.say(action)
        again.step(talk.play.inputs[-1])
        assert again.snapshot() == talk.play.world.snapshot()


def test_a_live_panel_has_one_page_says_so_everywhere_and_there_is_one_of_each_participant_and_a_few_in_the_room() -> None:
    live = Present(PAGES[:1], 1.6, "Screen of Ann", live=True)
    assert action_of(message_of(live, "1", "ann")) == live
    others = [f"guest-{n}" for n in range(MOST_LIVE)]
    talk = Talk("ann", *others)
    talk.play.step({name: stands(0.9, 0.3 * n - 0.5, -1.5) for n, name in enumerate(others)})
    first = put_up(talk, live)
    pages = talk.thing(first).pages
    assert pages is not None and (pages.by, pages.live) == ("ann", True)
    for again in (to_thing(from_thing(talk.thing(first))), thing_of(thing_message(talk.thing(first)))):
        assert again.pages == pages
    plain = to_thing(from_thing(talk.thing(put_up(talk))))
    assert plain.pages is not None and not plain.pages.live
    second = put_up(talk, live)
    assert {first, second} & {t.id for t in talk.play.views[-1].things} == {second}, "the new one is in its place"
    assert "one page" in refused(talk.say(Present(PAGES, 1.6, "", live=True)))
    assert "no such page" in refused(talk.say(TurnPage(Which(second), by=1.0)))
    for name in others[:-1]:
        put_up(talk, live, name)
    assert "live already" in refused(talk.say(live, others[-1]))
    done(talk.say(PutAway(Which(second))))
    put_up(talk, live, others[-1])


def test_live_panels_go_with_those_who_leave_and_are_in_no_room_that_is_resumed() -> None:
    live = Present(PAGES[:1], 1.6, "Screen", live=True)
    talk = Talk("ann", "ben", "carla")
    talk.play.step({name: stands(0.9, 0.4 * n, -1.5) for n, name in enumerate(("ben", "carla"))})
    slides, first = put_up(talk), put_up(talk, live)
    (second, third) = (put_up(talk, live, name) for name in ("ben", "carla"))
    again = World.restore(talk.play.world.snapshot())
    talk.play.step({}, left=("ann", "carla"))
    assert {slides, first, second, third} & {t.id for t in talk.play.views[-1].things} == {slides, second}
    again.step(talk.play.inputs[-1])
    assert again.snapshot() == talk.play.world.snapshot()
    talk.wait(3)
    later = World.restore(talk.play.world.snapshot()).resumed(ROOM, 10**12)
    assert {slides, second} & {t.id for t in later.things_now} == {slides}
