"""Things in a row, things that nobody is shown."""

from __future__ import annotations

import numpy as np
import pytest
from talking import Talk, done, refused
from test_world_steps import BATON

from vistel.messages.world.encoder import WorldEncoder
from vistel.space import actions as ask
from vistel.space.arguments import THIS, Shown, Which
from vistel.space.room import TABLE_HEIGHT
from vistel.space.world import World
from vistel.wire.world.decoder import SnapshotBuilder, WorldDecoder

SOME = ("box", "can", "cone", "tile")


def row(talk: Talk, names: tuple[str, ...]) -> np.ndarray:
    return np.array([talk.place(n)[[0, 2]] for n in names])


def test_all_things_of_the_table_stand_in_a_row_and_are_put_back() -> None:
    talk = Talk()
    talk.wait(5)
    names = ("ball", "box", "can", "cone", "ring", "tile", BATON)
    before = row(talk, names)
    moved = done(talk.say(ask.Align(Which(every=True))))
    assert set(moved) == set(names)
    talk.wait(120)
    after = row(talk, names)
    assert np.ptp(after, axis=0).min() < 0.015, "they do not stand on one line"
    spread = np.sort(after[:, int(np.argmax(np.ptp(after, axis=0)))])
    assert np.diff(spread).min() > 0.03, "they stand in one another"
    assert all(talk.place(n)[1] > TABLE_HEIGHT - 0.01 for n in names), "one fell off the table"
    done(talk.say(ask.Undo()))
    talk.wait(120)
    assert row(talk, names) == pytest.approx(before, abs=0.02)


def test_those_that_are_selected_are_lined_up_in_their_order_and_others_stay() -> None:
    talk = Talk()
    for _ in SOME:
        done(talk.say(ask.Create("ball", 0.02)))
    balls = tuple(s.id for s in talk.play.views[-1].states if s.id.startswith("ball-"))
    done(talk.say(ask.Move(Which(balls[0]), np.array([0.0, TABLE_HEIGHT + 0.021, 0.3]), np.array([0, 0, 0, 1.0]))))
    done(talk.say(ask.Select(Which(shape="ball", every=True))))
    others = row(talk, SOME)
    assert set(done(talk.say(ask.Align(THIS)))) == {*balls, "ball"}
    talk.wait(120)
    assert np.ptp(row(talk, (*balls, "ball")), axis=0).min() < 0.02
    assert row(talk, SOME) == pytest.approx(others, abs=0.01)


def test_one_thing_stands_in_no_row_and_what_is_fixed_in_none() -> None:
    talk = Talk()
    assert "one thing alone" in refused(talk.say(ask.Align(Which("box"))))
    assert "fixed" in refused(talk.say(ask.Align(Which(shape="chair", every=True))))


def test_a_hidden_thing_is_published_as_such_also_to_who_comes_late_and_stays_where_it_is() -> None:
    talk = Talk()
    encoder, backlog, hears = WorldEncoder(), SnapshotBuilder(), WorldDecoder()

    def step(action: ask.Action | None = None) -> None:
        done(talk.say(action)) if action else talk.wait(1)
        said = encoder.encode(talk.play.views[-1])
        if said.whole is not None:
            backlog.key(said.whole)
            hears.begin(backlog.snapshot())
        if said.state is not None:
            backlog.add(said.state)
            hears.read(said.state)

    step()
    before = talk.place("box").copy()
    step(ask.Hide(Which("box")))
    step()
    late = WorldDecoder()
    late.begin(backlog.snapshot())
    assert hears.now.things["box"].hidden
    assert late.now.things["box"].hidden
    assert not late.now.things["can"].hidden
    assert talk.place("box") == pytest.approx(before, abs=1e-3)
    step(ask.Show())
    step()
    assert not hears.now.things["box"].hidden
    again = World.restore(talk.play.world.snapshot())
    assert again.snapshot() == talk.play.world.snapshot()


def test_what_is_hidden_is_not_meant_where_something_seen_is() -> None:
    talk = Talk()
    (made,) = done(talk.say(ask.Create("ball")))
    done(talk.say(ask.Hide(Which("ball"))))
    assert done(talk.say(ask.Select(Which(shape="ball")))) == (made,)
    assert "ball" not in done(talk.say(ask.Select(Which(every=True))))
    assert "hidden already" in refused(talk.say(ask.Hide(Which("ball"))))
    assert done(talk.say(ask.Show(Which(shape="ball")))) == ("ball",)
    assert "nothing is hidden" in refused(talk.say(ask.Show(Which(shape="ball"))))


def test_hiding_is_taken_back_and_show_without_a_word_shows_all() -> None:
    talk = Talk()
    done(talk.say(ask.Hide(Which("box"))))
    assert done(talk.say(ask.Undo())) == ("box",)
    assert not talk.thing("box").hidden
    done(talk.say(ask.Redo()))
    done(talk.say(ask.Hide(Which("can"))))
    assert "no tile" in refused(talk.say(ask.Show(Which(shape="tile"))))
    assert set(done(talk.say(ask.Show()))) == {"box", "can"}
    assert refused(talk.say(ask.Hide(Which(shape="table"))))
    assert refused(talk.say(ask.Show(Which(shown=Shown.POINTED))))
