"""How a line that is being typed can go on."""

from dataclasses import dataclass

from vistel.space.arguments import Which
from vistel.space.command_description import Command, Length, Typed
from vistel.space.commands.phrase import UNITS, choices_of, parameters_of, typed_lines

MOST = 12
"""Words that are offered at once."""


@dataclass(frozen=True)
class Completion:
    """words: each can stand in place of the line's last word; thing: whether the name of a thing can."""

    words: tuple[str, ...]
    thing: bool


def completion(line: str) -> Completion:
    """How a line can go on: its last word, or the next one where it ends with a space."""
    words = line.lower().split()
    last = words.pop() if words and not line[-1].isspace() else ""
    offered: list[str] = []
    thing = False
    for command, typed in typed_lines():
        verb = typed.verb.split()
        if len(words) < len(verb):
            offered += [verb[len(words)]] if verb[: len(words)] == words else []
        elif words[: len(verb)] == verb:
            more, named = _after_verb(command, typed, words[len(verb) :])
            offered += more
            thing |= named
    return Completion(tuple(w for w in dict.fromkeys(offered) if w.startswith(last) and w != last)[:MOST], thing)


def _after_verb(command: Command, typed: Typed, said: list[str]) -> tuple[list[str], bool]:
    """What can follow the words that were said after a verb, and whether the name of a thing can."""
    offered = [token for token in typed.rest if token.islower() and token not in said]
    parameters = [parameter for parameter, _ in parameters_of(command, typed.rest)]
    if said and said[-1].replace(".", "", 1).isdecimal():
        return [*(UNITS if any(p.kind is Length for p in parameters) else ()), *offered], False
    for parameter in parameters:
        choices = choices_of(parameter)
        offered += () if said and said[-1] in choices else choices  # before it they may be part of a thing's name
    return offered, any(p.kind is Which for p in parameters)
