"""Where each key of a TOML text stands."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, cast

Place = tuple[str | int, ...]
"""A key or an element of a list: ("sites", 0, "name")."""

_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"""+'  # text over several lines
    r"|'''.*?'''+"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|\n|[\[\]{}=,.]|[^\s\[\]{}=,.\#\"']+",
    re.S,
)
_NAME = re.compile(r"[\w-]+")


def lines_of(text: str) -> dict[Place, int]:
    """The line of every key and of every element of a list, counted from 1. text: valid TOML."""
    return _Scan(text).run()


def written(place: Place) -> str:
    """A place as text: sites[0].name."""
    out = ""
    for part in place:
        out += f"[{part}]" if isinstance(part, int) else f".{part}" if out else part
    return out


def named(text: str) -> Place:
    """The place with which a text such as "sites[0].name: is missing" begins; () if it begins with none."""
    place: list[str | int] = []
    key, colon, _ = text.partition(": ")
    for part in key.split(".") if colon else ():
        name, *indices = part.split("[")
        if not _NAME.fullmatch(name) or not all(i.endswith("]") and i[:-1].isdigit() for i in indices):
            return ()
        place += [name, *(int(i[:-1]) for i in indices)]
    return tuple(place)


def value_at(tables: Mapping[str, Any], place: Place) -> Any:
    """What stands at a place. Raises LookupError."""
    at: Any = tables
    for part in place:
        if isinstance(part, int):
            if not isinstance(at, Sequence) or isinstance(at, str):
                raise LookupError(place)
            at = cast("Sequence[Any]", at)[part]
        else:
            if not isinstance(at, Mapping):
                raise LookupError(place)
            at = cast("Mapping[str, Any]", at)[part]
    return at


class _Scan:
    def __init__(self, text: str) -> None:
        self._tokens = [t for t in _TOKEN.finditer(text) if not t[0].startswith("#")]
        self._text, self._at = text, 0
        self._line, self._counted = 1, 0
        self._lines: dict[Place, int] = {}
        self._rows: dict[Place, int] = {}
        """Index of the last table of each list of tables."""

    def run(self) -> dict[Place, int]:
        table: Place = ()
        while self._at < len(self._tokens):
            if self._next() == "\n":
                self._at += 1
            elif self._next() == "[":
                table = self._header()
            else:
                self._pair(table)
        return self._lines

    def _next(self) -> str:
        return self._tokens[self._at][0] if self._at < len(self._tokens) else ""

    def _note(self, place: Place) -> None:
        """`place` stands at the next token."""
        start = self._tokens[min(self._at, len(self._tokens) - 1)].start()
        self._line += self._text.count("\n", self._counted, start)
        self._counted = start
        self._lines.setdefault(place, self._line)

    def _keys(self, table: Place, end: str) -> Place:
        """Notes the keys up to `end`, which is passed over."""
        place = table
        while self._next() not in (end, ""):
            if self._next() != ".":
                place = (*place, self._next().strip("\"'"))
                self._note(place)
                if end == "]" and place in self._rows and self._tokens[self._at + 1][0] != "]":
                    place = (*place, self._rows[place])
            self._at += 1
        self._at += 1
        return place

    def _header(self) -> Place:
        self._at += 1
        many = self._next() == "["
        self._at += many
        begin = self._at
        place = self._keys((), "]")
        if many:
            self._at, after = begin, self._at + 1
            self._rows[place] = self._rows.get(place, -1) + 1
            place = (*place, self._rows[place])
            self._note(place)
            self._at = after
        elif place in self._rows:
            place = (*place, self._rows[place])
        return place

    def _pair(self, table: Place) -> None:
        self._value(self._keys(table, "="))

    def _value(self, place: Place) -> None:
        opened = self._next()
        if opened in ("[", "{"):
            self._at += 1
            count = 0
            while self._next() not in ("]", "}", ""):
                if self._next() in ("\n", ","):
                    self._at += 1
                elif opened == "{":
                    self._pair(place)
                else:
                    self._note((*place, count))
                    self._value((*place, count))
                    count += 1
            self._at += 1
            return
        while self._next() not in ("\n", ",", "]", "}", ""):
            self._at += 1
