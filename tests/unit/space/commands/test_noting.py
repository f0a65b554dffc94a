"""Sticky notes: they are written, stick upright where they are let go of, go along with what they stick to, and are taken again."""

from __future__ import annotations

import numpy as np
import pytest
from talking import ROOM, Talk, done, refused, stands
from test_led_by_mouse import Drag

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.messages.commands import message_of
from vistel.messages.commands_read import action_of
from vistel.messages.world.encoder import WorldEncoder
from vistel.space.actions import Copy, Delete, Move, PutUpBoard, Redo, Undo, WriteNote
from vistel.space.arguments import Which
from vistel.space.boards.board import Face, face_of
from vistel.space.commands.noting import MOST_NOTES, MOST_OF_ONE
from vistel.space.commands.phrase import read
from vistel.space.inputs import PropInput
from vistel.space.notes.note import MOST_TEXT, THICK
from vistel.space.room import HALF_WIDTH, TABLE_HEIGHT
from vistel.space.things.things import identity
from vistel.space.world import World
from vistel.speech.grammar_file import load_grammar
from vistel.speech.meaning import asked_for
from vistel.v1.command_pb2 import Command
from vistel.v1.world_pb2 import WorldState
from vistel.wire.world.decoder import WorldDecoder

TILTED = np.array([0.3, 0.1, 0.2, 0.9]) / np.sqrt(0.95)
MIDDLE = np.array([[1800.0, 1200.0]])


def face(talk: Talk, board: str) -> Face:
    """Of a board, in the room."""
    own = face_of(talk.thing(board))
    assert own is not None
    return own.posed(talk.place(board), talk.play.thing(board).rotation)


def turn(talk: Talk, note: str) -> np.ndarray:
    return matrix_from_quaternion(talk.play.thing(note).rotation)


@pytest.mark.parametrize("turned", [(0.1, 0.6, 0.1, 0.79), (0.7, 0.0, 0.0, 0.7), (0.0, 1.0, 0.0, 0.0)])
def test_however_it_was_turned_it_sticks_to_the_side_on_which_it_was_let_go_of(turned: tuple[float, ...]) -> None:
    talk = Talk()
    (board,) = done(talk.say(PutUpBoard()))
    talk.wait(90)
    for off, lies in ((0.03, THICK), (-0.06, -0.024 - THICK)):
        (note,) = done(talk.say(WriteNote(f"{off}")))
        done(talk.say(Move(Which(note), face(talk, board).place(MIDDLE, np.array([off]))[0], np.array(turned))))
        talk.wait(3)
        assert face(talk, board).on_grid(talk.place(note))[2] == pytest.approx(lies, abs=1.5e-3)


def stuck_on_board(talk: Talk) -> tuple[str, str]:
    """A board, and a note that was let go of 4 cm before its middle, askew."""
    (board,) = done(talk.say(PutUpBoard()))
    talk.wait(90)
    (note,) = done(talk.say(WriteNote("buy milk")))
    there = face(talk, board).place(MIDDLE, np.array([0.04]))[0]
    done(talk.say(Move(Which(note), there, TILTED)))
    return board, note


def test_its_text_is_its_name_and_it_lies_before_the_writer_to_be_read_by_them() -> None:
    talk = Talk()
    (note,) = done(talk.say(read("note Buy a  Pint of the milk")))
    talk.wait(60)
    assert talk.thing(note).name == "Buy a Pint of the milk"
    assert note.startswith("note-ann-")
    assert talk.place(note)[1] == pytest.approx(TABLE_HEIGHT + THICK, abs=1e-3)
    up, front = turn(talk, note)[:, 1], turn(talk, note)[:, 2]
    assert front == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert up[2] == pytest.approx(1.0, abs=0.02), "Ann looks along +Z"
    assert done(talk.say(read("delete the pint"))) == (note,), "who reads a note can speak of it"


def test_it_is_said_in_both_languages_and_then_written_on() -> None:
    grammar, faults = load_grammar()
    assert faults == []
    for text in ("new note", "あたらしいふせん", "新しい付箋"):
        said = grammar.read(text)
        assert said is not None and asked_for(said.means) == WriteNote(), text
    talk = Talk("ann", "ben")
    talk.play.step({"ben": stands(0.0, 0.9, np.pi)})
    (blank,) = done(talk.say(WriteNote()))
    assert talk.thing(blank).name == "note"
    (other,) = done(talk.say(WriteNote("mine"), "ben"))
    assert other != blank, "nobody writes on a blank note of somebody else"
    assert done(talk.say(WriteNote("milk"))) == (blank,)
    assert talk.thing(blank).name == "milk"
    done(talk.say(Undo()))
    assert talk.thing(blank).name == "note"


def test_let_go_of_near_a_board_it_sticks_to_its_front_upright() -> None:
    talk = Talk()
    board, note = stuck_on_board(talk)
    stood = talk.place(board).copy()
    talk.wait(120)
    assert talk.place(board) == pytest.approx(stood, abs=1e-4), "paper pushes no board away"
    x, y, off = face(talk, board).on_grid(talk.place(note))
    assert (x, y) == pytest.approx((1800.0, 1200.0), abs=30.0)
    assert off == pytest.approx(THICK, abs=1.5e-3)
    assert turn(talk, note)[:, 2] == pytest.approx(face(talk, board).normal, abs=1e-3)
    assert turn(talk, note)[1, 1] > 0.999
    assert talk.play.thing(note).resting


def test_it_goes_along_with_the_board_and_falls_when_that_is_taken_away() -> None:
    talk = Talk()
    board, note = stuck_on_board(talk)
    talk.wait(30)
    before = face(talk, board).on_grid(talk.place(note))
    done(talk.say(read(f"move {board} right 20 cm")))
    talk.wait(240)
    assert face(talk, board).on_grid(talk.place(note)) == pytest.approx(before, abs=0.5)
    done(talk.say(Move(Which(board), talk.place(board) + np.array([0.1, 0.0, 0.1]), talk.play.thing(board).rotation)))
    talk.wait(30)
    assert face(talk, board).on_grid(talk.place(note)) == pytest.approx(before, abs=8.0), "at once as well; the board settles"
    done(talk.say(Delete(Which(board))))
    talk.wait(180)
    assert talk.place(note)[1] < 0.3


def test_it_sticks_to_a_wall_to_the_table_from_above_and_to_another_note() -> None:
    talk = Talk()
    (first,), (second,) = (done(talk.say(WriteNote(text))) for text in ("one", "two"))
    done(talk.say(Move(Which(first), np.array([3.98, 1.3, 0.2]), TILTED)))
    talk.wait(2)
    assert talk.place(first)[0] == pytest.approx(HALF_WIDTH - THICK, abs=1e-3)
    assert turn(talk, first)[:, 2] == pytest.approx([-1.0, 0.0, 0.0], abs=1e-6)
    assert turn(talk, first)[:, 1] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    done(talk.say(Move(Which(second), np.array([3.96, 1.32, 0.22]), identity())))
    talk.wait(2)
    assert talk.place(second)[0] == pytest.approx(HALF_WIDTH - 3 * THICK, abs=2e-3), "it covers the other one"
    done(talk.say(Move(Which(second), np.array([0.0, TABLE_HEIGHT + 0.05, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))))
    talk.wait(2)
    assert turn(talk, second)[:, 2] == pytest.approx([0.0, 1.0, 0.0], abs=1e-3), "its text is up"


def test_far_from_everything_it_falls() -> None:
    talk = Talk()
    (note,) = done(talk.say(WriteNote("leaf")))
    done(talk.say(Move(Which(note), np.array([2.0, 1.5, 0.0]), identity())))
    talk.wait(12)
    assert talk.place(note)[1] < 1.4


class Led(Drag):
    """As a mouse leads a note."""

    def lead_note(self, note: str, place: np.ndarray, let_go: bool = False) -> None:
        t_ns = (self.k + 1) * 16_666_667
        self.put(PropInput(note, place, identity(), t_ns, np.zeros(3), np.zeros(3), "ann", let_go))


def test_it_is_taken_from_where_it_sticks_and_stuck_again() -> None:
    play = Led()
    (note,) = done(play.say(WriteNote("milk")))
    for place in (np.array([3.9, 1.4, 0.0]), np.array([0.0, 1.4, 3.9])):
        for _ in range(5):
            play.lead_note(note, place)
        assert play.thing(note).position == pytest.approx(place, abs=1e-6), "while it is led, it does not stick"
        wall = place * (4.0 / 3.9) * np.array([1.0, 3.9 / 4.0, 1.0])
        play.lead_note(note, wall, let_go=True)
        play.put()
        assert max(play.thing(note).position[[0, 2]]) == pytest.approx(HALF_WIDTH - THICK, abs=1e-3)


def test_limits_of_text_and_number_are_told_in_one_line() -> None:
    talk = Talk(*(names := tuple(f"p{n}" for n in range(5))))
    talk.play.step({who: stands(0.4 * n - 0.8, -0.9, 0.0) for n, who in enumerate(names)})
    assert refused(talk.say(WriteNote("x" * (MOST_TEXT + 1)), "p0")) == f"a note has room for {MOST_TEXT} letters, not 121"
    refusals = set[str]()
    for who in names:
        made = 0
        for _ in range(MOST_OF_ONE + 1):
            outcome = talk.say(WriteNote("x" * MOST_TEXT), who)
            talk.wait(20)
            made += outcome.done
            refusals |= {outcome.reason} - {""}
        assert made == (MOST_OF_ONE if who != "p4" else 0)
    assert refusals == {
        f"you have {MOST_OF_ONE} notes in the room; delete one first",
        f"the room has {MOST_NOTES} notes; delete one first",
    }
    assert "you have" in refused(talk.say(Copy(Which("note-p0-2")), "p0")), "nor by copying"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("a\nb\tc", "a b c"),
        ("\u202ekcab\u202c", "kcab"),
        ("\x1b[31mred", "[31mred"),
        ("<b>&amp;</b>", "<b>&amp;</b>"),
        ("\x00", "note"),
    ],
)
def test_what_cannot_be_printed_is_not_on_it(text: str, shown: str) -> None:
    talk = Talk()
    (note,) = done(talk.say(WriteNote(text)))
    assert talk.thing(note).name == shown


def test_it_goes_through_its_message_and_to_a_site_that_comes_late_and_every_run_is_the_same() -> None:
    sent = Command.FromString(message_of(WriteNote("牛乳"), "1", "ann").SerializeToString())
    assert action_of(sent) == WriteNote("牛乳")
    talk, encoder = Talk(), WorldEncoder()
    board, note = stuck_on_board(talk)
    done(talk.say(WriteNote("牛乳" * (MOST_TEXT // 2))))
    talk.wait(70)
    done(talk.say(Undo()))
    done(talk.say(Redo()))
    for view in talk.play.views:
        encoder.encode(view)
    late, snapshot = WorldDecoder(), encoder.snapshot(words=False)
    assert snapshot is not None
    late.read(WorldState.FromString(snapshot.SerializeToString()))
    names = {t.id: t.name for t in late.now.things.values()}
    assert names[note] == "buy milk" and "牛乳" * (MOST_TEXT // 2) in names.values()
    again, half = World(ROOM), len(talk.play.inputs) // 2
    for n, inputs in enumerate(talk.play.inputs):
        again.step(inputs)
        if n == half:
            again = World.restore(again.snapshot())
    assert again.snapshot() == talk.play.world.snapshot()
    assert board in {t.id for t in again.things_now}
