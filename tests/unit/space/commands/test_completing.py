"""How lines that are being typed go on."""

from __future__ import annotations

import pytest

from vistel.space.commands.completing import MOST, completion
from vistel.space.commands.phrase import read, typed_lines


@pytest.mark.parametrize(
    ("line", "words", "thing"),
    [
        ("be", ("bend",), False),
        ("bend ", (), True),
        ("Move the ball l", ("left",), True),
        ("move the ball left 10 ", ("m", "cm", "mm"), False),
        ("new ", ("board",), False),
        ("attach the box t", ("to",), True),
        ("create red b", ("ball", "box", "bar"), False),
        ("paint the ball red", (), True),
        ("paint the red baton bl", ("blue", "black"), True),
        ("fly ", (), False),
        ("  ", completion("").words, False),
    ],
)
def test_a_line_goes_on_with_what_may_follow(line: str, words: tuple[str, ...], thing: bool) -> None:
    found = completion(line)
    assert (found.words, found.thing) == (words, thing)


def test_every_verb_is_offered_from_its_letters_and_few_at_once() -> None:
    for _, typed in typed_lines():
        verb = typed.verb.split()
        assert verb[0] in completion(verb[0][:-1]).words or len(completion(verb[0][:-1]).words) == MOST
        assert len(verb) == 1 or verb[1] in completion(f"{verb[0]} ").words
    assert len(completion("").words) == MOST


def test_what_is_offered_makes_a_line_that_is_read() -> None:
    line = ""
    for begin in ("pai", "the can gre"):
        line = f"{line}{begin}"
        line = f"{line[: line.rfind(' ') + 1]}{completion(line).words[0]} "
    assert line == "paint the can green " and read(line)
