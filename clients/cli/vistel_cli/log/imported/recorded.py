"""What a file that was recorded elsewhere becomes, whatever its kind."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from vistel.conference.model import Conference
from vistel.wire.topics import Topic

NAME = "imported"
"""Of the conference."""
SITE = "elsewhere"
"""Of everybody."""

Messages = Iterator[tuple[Topic, str, Any, int]]
"""Topics, keys, messages and their conference times [ns]."""


@dataclass(frozen=True)
class Assumed:
    """What is assumed of a file's numbers where it does not state it itself. height: of people [m]; unit, up: None: what is usual
    for the kind of file; clock: of times; frames: of a bag, the frame of each sensor."""

    height: float
    unit: str | None = None
    up: str | None = None
    clock: str = "s"
    frames: dict[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True)
class Film:
    """Pictures that become a file beside the log. name: what is added to the log's name; write: writes them, given the file and the
    log's beginning [s after the file's], and returns one line for a person."""

    name: str
    write: Callable[[Path, float], str]


@dataclass
class Recorded:
    """A file: how long it is [s], its people as in a conference file, what it says of them given the conference and the time of its
    beginning [ns], whether that is to be solved, the room's props, and its films."""

    seconds: float
    people: list[dict[str, Any]]
    messages: Callable[[Conference, int], Messages]
    solved: bool = False
    props: list[str] = field(default_factory=list[str])
    films: list[Film] = field(default_factory=list[Film])
