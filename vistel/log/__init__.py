"""Recorded conferences: open a log and walk through it.

    with vistel.log.open("out/latest/conference.mcap") as log:
        for t, posture in log.postures("ben"):
            print(t, posture.dofs[0])

Times are seconds of conference time since the log's first message.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from vistel.figure.posture.posture import Posture
from vistel.messages.postures import posture_of
from vistel.session.room_view import RoomView, view_of
from vistel.wire.log import LogError, LogReader, LogRecord
from vistel.wire.motion import MotionDecoder
from vistel.wire.topics import BY_NAME, Topic
from vistel.wire.world import recorded

if TYPE_CHECKING:
    from vistel.render.still import Picture

__all__ = ["Log", "LogError", "Recorded", "open"]


WHOLE_S = 12.0
"""The whole room stands in a log at least so often, even of a busy machine [s]."""


class Recorded(NamedTuple):
    """A message of a log. t: seconds since the log's first message. topic: a name of docs/reference/topics.md. names: what the
    key says, such as site and participant. message: a protobuf message of the topic's type."""

    t: float
    topic: str
    names: dict[str, str]
    message: Any


class Log:
    """A log, whole or damaged: what is whole is read, `damage` has a line for everything that is not."""

    def __init__(self, path: str | Path) -> None:
        """Raises LogError (one line) when `path` is absent or not a log."""
        self._reader = LogReader(Path(path))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """A log holds no file open between two calls; `with` is there for those who expect it."""

    @property
    def path(self) -> Path:
        """The log's file."""
        return self._reader.path

    @property
    def duration(self) -> float:
        """From the first message to the last, seconds."""
        return self._reader.length_s

    @property
    def begin_ns(self) -> int:
        """Conference time of the first message, nanoseconds: the zero of every `t`."""
        return self._reader.begin_ns

    @property
    def conference(self) -> dict[str, Any]:
        """The conference file as data; empty where the log holds none."""
        return self._reader.conference or {}

    @property
    def participants(self) -> list[str]:
        """Names of the participants in the conference file, in its order."""
        sites = self.conference.get("sites", [])
        return [str(p["name"]) for site in sites for p in site.get("participants", [])]

    @property
    def channels(self) -> list[tuple[Topic, dict[str, str]]]:
        """The topic of each channel, and what its key says, in the order of their names."""
        return [found for _, found in sorted(self._reader.keys.items())]

    def check_participant(self, name: str) -> None:
        """Raises ValueError, one line, for a participant whom the conference file does not know."""
        if self.participants and name not in self.participants:
            raise ValueError(f"{self.path}: no participant is called {name!r}; there are {', '.join(self.participants)}")

    @property
    def share_read(self) -> float:
        """How far into the log reading has come, 0 to 1."""
        return self._reader.share_read

    @property
    def damage(self) -> list[str]:
        """A line for every fault found so far."""
        return list(self._reader.damage)

    def messages(self, *topics: str, begin: float = 0.0, end: float | None = None, **names: str) -> Iterator[Recorded]:
        """Messages in the order they arrived, from `begin` (included) to `end` (excluded) [s]. topics: their names; none: all.
        names: what their keys must say, such as participant="ben".

        Starts at once from any time. Raises ValueError for a topic that does not exist.
        """
        for record in self.records(*topics, begin=begin, end=end, **names):
            yield Recorded(self._seconds(record.log_ns), record.topic.name, record.names, record.message)

    def records(self, *topics: str, begin: float = 0.0, end: float | None = None, **names: str) -> Iterator[LogRecord]:
        """As `messages`, with key, size and times as in the file."""
        unknown = [name for name in topics if name not in BY_NAME]
        if unknown:
            raise ValueError(f"no topic is called {unknown[0]!r}; there are {', '.join(BY_NAME)}")
        yield from self._reader.records(topics or None, self._ns(begin), None if end is None else self._ns(end), **names)

    def postures(self, participant: str, begin: float = 0.0, end: float | None = None) -> Iterator[tuple[float, Posture]]:
        """Everything a participant did: times of capture and postures.

        Raises ValueError for a participant whom the conference file does not know.
        """
        self.check_participant(participant)
        decoder = MotionDecoder()
        # A frame may need a full one before it, which comes at least every 0.4 s.
        until, from_ns = None if end is None else self._ns(end), self._ns(begin)
        for record in self._reader.records(("motion",), self._ns(max(0.0, begin - 1.0)), until, participant=participant):
            frame = decoder.open(record.message)
            if frame is not None and record.log_ns >= from_ns:
                sample = frame.sample()
                if frame.intact:
                    yield self._seconds(sample.t_ns), posture_of(sample)

    def rooms(self, begin: float = 0.0, end: float | None = None) -> Iterator[tuple[float, RoomView]]:
        """The room at every step of the world, as far as the log tells it."""
        world = recorded.RecordedWorld()
        until = None if end is None else self._ns(end)
        for record in self._reader.records(recorded.TOPICS, self._ns(max(0.0, begin - WHOLE_S)), until):
            for now in world.take(record):
                t = self._seconds(now.t_ns)
                if t >= begin:
                    yield t, view_of(now)

    def picture(self, at: float, site: str | None = None, size: Sequence[int] = (640, 480)) -> Picture:
        """What a site saw at a time [s]: the first site of the conference file unless one is named.

        Raises ValueError for a time outside the log or an unknown site, `NoOpenGlError` where nothing can be drawn.
        """
        from vistel.render.film.moment import moment  # whoever only reads numbers needs no OpenGL

        if not 0.0 <= at <= self.duration:
            raise ValueError(f"{self.path}: {at:g} s is outside the log, which lasts {self.duration:.1f} s")
        return moment(self._reader, self._ns(at), site, (size[0], size[1]))

    def _ns(self, t: float) -> int:
        return self._reader.begin_ns + round(t * 1e9)

    def _seconds(self, t_ns: int) -> float:
        return (t_ns - self._reader.begin_ns) * 1e-9


def open(path: str | Path) -> Log:
    """Open a log. Raises LogError (one line) when `path` is absent or not a log."""
    return Log(path)
