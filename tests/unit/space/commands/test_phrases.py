"""Commands as lines of a console, and as messages."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_commands import ANYTHING

from vistel.messages.commands import message_of
from vistel.messages.commands_read import action_of
from vistel.space import actions as ask
from vistel.space.actions import Action
from vistel.space.arguments import THIS, Along, Shown, Towards, Where, Which
from vistel.space.command_description import COMMANDS
from vistel.space.commands.names import COLOURS
from vistel.space.commands.phrase import PhraseError, read, usage
from vistel.v1.command_pb2 import TOWARDS_UP, Command, CreateThing, DentThing, MoveThingBy


@pytest.mark.parametrize(
    ("line", "action"),
    [
        ("move this left 10 cm", ask.MoveBy(THIS, Towards.LEFT, 0.1)),
        ("move the yellow ball up", ask.MoveBy(Which(name="yellow ball"), Towards.UP, 0.1)),
        ("move box-2 ahead 0.25", ask.MoveBy(Which(name="box-2"), Towards.AHEAD, 0.25)),
        ("put that there", ask.Place(Which(shown=Shown.POINTED), Where.POINTED)),
        ("turn the can 90 degrees across", ask.Turn(Which(name="can"), 0.5 * math.pi, Along.ACROSS)),
        ("scale ball 2", ask.Scale(Which(name="ball"), 2.0)),
        ("taller box", ask.Scale(Which(name="box"), 1.5, Along.UP)),
        ("bend red baton 40", ask.Bend(Which(name="red baton"), math.radians(40))),
        ("straighten it", ask.Bend(THIS, 0.0)),
        ("paint all red things blue", ask.Paint(Which(name="red", every=True), COLOURS["blue"])),
        ("create green ring 8 cm here", ask.Create("ring", 0.04, COLOURS["green"])),
        ("create a ball there", ask.Create("ball", 0.04, None, Where.POINTED)),
        ("attach the ball to the blue box", ask.Attach(Which(name="ball"), Which(name="blue box"))),
        ("select nothing", ask.Select(nothing=True)),
        ("take held ball", ask.Grip(Which(name="ball", shown=Shown.HELD))),
        ("release", ask.Release()),
        ("undo", ask.Undo()),
        ("sharpen the cone", ask.Sharpen(Which(name="cone"), 0.6)),
        ("round box", ask.Sharpen(Which(name="box"), -0.6)),
        ("dent it", ask.Dent(THIS)),
        ("align all balls", ask.Align(Which(name="balls", every=True))),
        ("hide that", ask.Hide(Which(shown=Shown.POINTED))),
        ("show", ask.Show()),
    ],
)
def test_a_line_is_read_as_what_it_says(line: str, action: Action) -> None:
    assert read(line) == action


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("", "expected a command"),
        ("fly", "no command 'fly'"),
        ("move ball", "which way"),
        ("bend ball", "degrees"),
        ("paint ball octarine", "what colour"),
        ("create sphinx", "create what"),
        ("attach ball", "to what"),
        ("scale ball much", "what factor"),
    ],
)
def test_what_is_no_command_is_reported_with_what_was_expected(line: str, said: str) -> None:
    with pytest.raises(PhraseError, match=said):
        read(line)


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        read(text)
    except PhraseError as e:
        assert "\n" not in str(e)


def test_every_verb_is_in_the_list_of_commands() -> None:
    listed = {word for word in usage().replace("|", " ").split() if word.islower()}
    typed = [typed.verb for command in COMMANDS.values() for typed in command.typed]
    assert len(typed) > 35
    assert {word for verb in typed for word in verb.split()} <= listed


@given(ANYTHING)
def test_what_is_asked_comes_through_its_message_unchanged(action: Action) -> None:
    sent = message_of(action, "1", "ann")
    got = action_of(Command.FromString(sent.SerializeToString()))
    assert type(got) is type(action)
    with np.errstate(over="ignore"):
        for f in fields(action):
            a, b = getattr(action, f.name), getattr(got, f.name)
            if isinstance(a, np.ndarray):
                assert np.array_equal(a.astype(np.float32), b.astype(np.float32), equal_nan=True)
            else:
                assert a == b or (isinstance(a, float) and math.isnan(a) and math.isnan(b))


def test_a_number_that_is_absent_takes_the_default_and_zero_is_zero() -> None:
    """Logs of older versions leave out what is usual."""
    assert action_of(Command(move_by=MoveThingBy(towards=TOWARDS_UP))) == ask.MoveBy(THIS, Towards.UP, 0.1)
    assert action_of(Command(move_by=MoveThingBy(towards=TOWARDS_UP, distance=0.0))) == ask.MoveBy(THIS, Towards.UP, 0.0)
    assert action_of(Command(create=CreateThing(shape="ball"))) == ask.Create("ball", 0.04, None)
    assert action_of(Command(create=CreateThing(shape="ball", size=0.0, colour=0))) == ask.Create("ball", 0.0, 0)
    assert action_of(Command(dent=DentThing())) == ask.Dent(THIS, 0.3)
    assert action_of(Command(dent=DentThing(depth=0.0))) == ask.Dent(THIS, 0.0)
