"""TOML files of people: every fault is one line that names file, line and key, and guesses what was meant."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vistel.toml.file import parsed, read
from vistel.toml.places import Place, lines_of

ROOT = Path(__file__).parents[2]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class Ball(Table):
    kind: Literal["ball"]
    radius: Annotated[float, Field(gt=0)]


class Bar(Table):
    kind: Literal["bar"]
    length: float
    ends: tuple[int, int] = (0, 0)


class Person(Table):
    name: str
    height: float = 1.7
    awake: bool = True
    seat: int | Literal["any"] = "any"

    @model_validator(mode="after")
    def _no_giants(self) -> Person:
        if self.height > 3:
            raise ValueError("height: nobody is so tall")
        return self


class File(Table):
    people: dict[str, Person] = {}
    things: list[Annotated[Ball | Bar, Field(discriminator="kind")]] = []


def places(value: Any, at: Place = ()) -> Iterator[Place]:
    if at:
        yield at
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(inner, (*at, key))


@pytest.mark.parametrize("path", sorted((*ROOT.glob("examples/**/*.toml"), *ROOT.glob("vistel/**/*.toml"))), ids=lambda p: p.stem)
def test_every_key_of_our_own_files_is_found_on_its_line(path: Path) -> None:
    text = path.read_text("utf-8")
    lines = lines_of(text)
    assert set(lines) == set(places(tomllib.loads(text)))
    written = text.splitlines()
    assert all(str(place[-1]) in written[line - 1] for place, line in lines.items() if isinstance(place[-1], str))


def test_keys_are_found_in_every_way_to_write_them() -> None:
    text = '''a.b = 1 # [c]
"q r" = """
[no]
x = 1"""
list = [ # one
  [1, 2],
  { x = "]" , y = [3] },
]
[t.u]
v = '#'
[[t.w]]
[[t.w]]
k = 2020-01-01 10:00:00
[t.w.deep]
e = 1.5
[[t.w.more]]
f = 1'''
    lines = lines_of(text)
    assert set(lines) == set(places(tomllib.loads(text)))
    assert lines["a", "b"] == 1 and lines["list", 1, "y", 0] == 7 and lines["t", "u", "v"] == 10
    assert (lines["t", "w", 1], lines["t", "w", 1, "deep", "e"], lines["t", "w", 1, "more", 0, "f"]) == (12, 15, 17)


FAULTS = [
    ("[people.aiko]\nname = 'a'\nseat = 1.5", "f.toml:3: people.aiko.seat: is 1.5, expected a whole number, or 'any'"),
    ("people = 1\npeople = 2", "f.toml:2: not valid TOML: Cannot overwrite a value (at its end); this key stands here twice"),
    ("[people.aiko]\nname = 'a'\nheigth = 1.6", "f.toml:3: people.aiko.heigth: unknown key; did you mean height?"),
    ("[people.aiko]\nnmae = 'a'", "f.toml:2: people.aiko.nmae: unknown key; did you mean name?"),
    ("[people.aiko]\nname = 'a'\nxyz = 1", "f.toml:3: people.aiko.xyz: unknown key; expected one of name, height, awake, seat"),
    (
        "[people.aiko]\nname = 'a'\nthings = []",
        "f.toml:3: people.aiko.things: unknown key here; it belongs above the first table of the file",
    ),
    ("[people.aiko]\nheight = 1.6", "f.toml:1: people.aiko.name: is missing"),
    ("[people.aiko]\nname = 'a'\nheight = 'x'", "f.toml:3: people.aiko.height: is 'x', expected a number"),
    ("[people.aiko]\nname = 'a'\nheight = nan", "f.toml:3: people.aiko.height: is nan, expected a finite number"),
    ("[people.aiko]\nname = 'a'\nheight = 4", "f.toml:3: people.aiko.height: nobody is so tall"),
    ("[people.aiko]\nname = 3", 'f.toml:2: people.aiko.name: is 3, expected text in quotes, "like this"'),
    ("[people.aiko]\nname = 'a'\nawake = 'maybe'", "f.toml:3: people.aiko.awake: is 'maybe', expected true or false"),
    ("people = 1", "f.toml:1: people: is 1, expected a table"),
    ("[things]\nx = 1", "f.toml:1: things: expected a list, [like, this]"),
    ("[[things]]\nkind = 'bal'", "f.toml:2: things[0].kind: is 'bal', expected one of ball, bar; did you mean ball?"),
    ("[[things]]\nradius = 1", "f.toml:1: things[0].kind: is missing"),
    ("\n[[things]]\nkind = 'ball'\nraduis = 1", "f.toml:4: things[0].raduis: unknown key; did you mean radius?"),
    ("[[things]]\nkind = 'ball'\nradius = 0", "f.toml:3: things[0].radius: is 0, expected more than 0"),
    ("[[things]]\nkind = 'bar'\nlength = 1\nends = [1]", "f.toml:4: things[0].ends[1]: is missing"),
    ("[[things]]\nkind = 'bar'\nlength = 1\nends = [1, 2.5]", "f.toml:4: things[0].ends[1]: is 2.5, expected a whole number"),
    ("a = 1\nb = x\n", 'f.toml:2: not valid TOML: Invalid value (column 5); text stands in quotes, "like this"'),
    ("a = " + 10_000 * "[", "f.toml: not valid TOML: nested too deep"),
]


@pytest.mark.parametrize(("text", "said"), FAULTS, ids=[said for _, said in FAULTS])
def test_a_fault_is_one_line_with_file_line_key_and_what_was_expected(text: str, said: str) -> None:
    with pytest.raises(ValueError) as error:
        parsed(text, Path("f.toml"), ValueError).checked(File, ValueError)
    assert str(error.value) == said


def test_all_faults_are_reported_at_once() -> None:
    with pytest.raises(ValueError) as error:
        parsed("people = 1\nthings = 2\nmore = 3", Path("f.toml"), ValueError).checked(File, ValueError)
    assert [line.partition(": ")[0] for line in str(error.value).splitlines()] == ["f.toml:1", "f.toml:2", "f.toml:3"]


def test_a_mark_with_which_some_editors_begin_a_file_is_no_fault(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"\xef\xbb\xbfa = 1\r\n")
    assert read(tmp_path / "x", ValueError).tables == {"a": 1}


def test_a_file_that_is_no_text_or_not_there_is_reported_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"a = '\xff'")
    with pytest.raises(ValueError, match=r"x:1: is no UTF-8 text; save the file as UTF-8$"):
        read(tmp_path / "x", ValueError)
    with pytest.raises(ValueError, match=r"no: cannot be read: No such file or directory$"):
        read(tmp_path / "no", ValueError)
