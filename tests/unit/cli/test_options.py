"""Options of the command: one meaning, one spelling."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import typer

from vistel_cli.lazy import every_command
from vistel_cli.main import app

OPTIONS = [
    (path, p)
    for path, command in every_command(typer.main.get_command(app), "vistel")
    for p in command.params
    if p.param_type_name == "option" and p.name != "help"
]
OTHER_SPELLINGS = {
    "--output": "--out",
    "--router": "--hub",
    "--bus": "--hub",
    "--duration": "--seconds",
    "--time": "--seconds",
    "--for": "--seconds",
    "--begin": "--from",
    "--start": "--from",
    "--end": "--to",
    "--overwrite": "--force",
    "--yes": "--anyway",
    "--who": "--as",
    "--participant": "--as",
    "--rate": "--fps",
    "--lang": "--language",
    "--smooth": "--supersample",
    "--details": "--verbose",
    "--as-json": "--json",
}


TO_SOMEBODY = [("--to", "to", "vistel chat")]
"""A line is written to somebody: the word is that of every mail, and no command has a span of time and a reader."""


def spelling(option: Any) -> str:
    return "/".join(sorted(option.opts + option.secondary_opts))


def several(pairs: list[tuple[str, str, str]]) -> dict[str, dict[str, list[str]]]:
    """Of (key, value, where): the keys with several values, and where each of these is."""
    found: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for key, value, where in pairs:
        found[key][value].append(where)
    return {key: dict(values) for key, values in found.items() if len(values) > 1}


def test_one_meaning_has_one_spelling() -> None:
    """What is one parameter in the code is one option, with the same short form everywhere."""
    assert several([(p.name, spelling(p), path) for path, p in OPTIONS]) == {}


def test_one_spelling_has_one_meaning() -> None:
    pairs = [(s, p.name, path) for path, p in OPTIONS for s in p.opts]
    assert several([pair for pair in pairs if pair not in TO_SOMEBODY]) == {}
    assert set(TO_SOMEBODY) <= set(pairs)


def test_no_option_has_a_spelling_that_another_one_has_for_its_meaning() -> None:
    assert [(path, s, OTHER_SPELLINGS[s]) for path, p in OPTIONS for s in p.opts if s in OTHER_SPELLINGS] == []


def test_what_is_off_has_no_option_to_turn_it_off() -> None:
    assert [(path, p.name) for path, p in OPTIONS if p.secondary_opts and p.default is False] == []
