"""How any Polhemus tracker is started, whatever state it was left in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Generic, TypeVar

from vistel.devices.identify import identify
from vistel.devices.registry import kind_of
from vistel.protocol import polhemus
from vistel.protocol.tracker_frames import PolhemusDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import DeviceError, Link, NoAnswerError
from vistel_services.devices.probe import at_any_speed, refuse_others, who_answers

R = TypeVar("R")
W = TypeVar("W")
T = TypeVar("T")

RESTART_S = 10.0


class PolhemusDriver(ABC, Generic[R, W]):
    """Brings a unit to stream position and quaternion of the wanted stations in binary centimetres.

    R: its replies; W: its identification. stations: role ("head", ...) to station. Never sends the commands that
    overwrite what a site has saved in its unit (`W`, `^K`).
    """

    topic = BY_NAME["tracker"]
    stop: bytes
    beat = None
    stream: bytes
    """Makes it send records, again and again."""
    restart: bytes
    """Back to its saved state; silent for up to ten seconds."""

    def __init__(
        self,
        name: str,
        decoder: PolhemusDecoder[R],
        kind: str,
        stations: Mapping[str, int],
        hemisphere: tuple[float, float, float],
        baud: int,
        answer_s: float,
    ) -> None:
        """kind: the name of its kind. answer_s: it answers within this time [s]."""
        self.name = name
        self.decoder = decoder
        self.stations = dict(stations)
        self.hemisphere = hemisphere
        self.baud = baud
        self.kind = kind_of("tracker", kind)
        self._answer_s = answer_s
        self._met = False

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        who = await self._meet(link)
        missing = await self.configure(link)
        link.send(self.stream)
        seen = link.frames
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, 2 * self._answer_s) is None:
            raise NoAnswerError("answers and sends no records")
        about = f"{self.about(who)}, {len(self.stations) - len(missing)} receivers"
        return about + (f"; no receiver for {', '.join(missing)}" if missing else "") + self.warning

    @property
    def warning(self) -> str:
        """What is wrong and does not keep it from working, after a semicolon."""
        return ""

    @abstractmethod
    def about(self, who: W) -> str:
        """A line for a person."""

    @abstractmethod
    async def ask_who(self, link: Link) -> W | None:
        """The identification of a unit that has been silenced; None without an answer."""

    @abstractmethod
    async def silence(self, link: Link) -> None:
        """Stop it, and wait until it is quiet."""

    @abstractmethod
    async def configure(self, link: Link) -> list[str]:
        """Stations, record, hemisphere, units. Returns the roles whose receiver is not plugged in."""

    @abstractmethod
    def refusal(self, reply: R) -> str | None:
        """The error in the reply to a refused command; None for any other reply."""

    async def _meet(self, link: Link) -> W:
        """Make it answer, at any speed."""
        found = await at_any_speed(link, (self.baud, self.baud), self._greet)
        # A unit that has answered before and is silent now has stalled; one that sends bytes without sense has another speed.
        if found is None and (not self._met or link.recent):
            found = await at_any_speed(link, [b for b in polhemus.BAUD_RATES if b != self.baud], self._greet)
        if found is not None:
            (self.baud, who), self._met = found, True
            return who
        self._met = False
        link.set_baud(self.baud)
        refuse_others(await who_answers(link), self.kind)
        link.send(self.restart)
        for _ in range(round(RESTART_S / self._answer_s)):
            if (who := await self._greet(link)) is not None:
                return who
        raise NoAnswerError(f"nothing answers like {self.kind.title}; check power, cable and its speed switches")

    async def _greet(self, link: Link) -> W | None:
        """Silence it, then ask who it is. Raises DeviceError when something else answers."""
        link.recent.clear()
        await self.silence(link)
        self.decoder.take_replies()
        who = await self.ask_who(link)
        if who is None:
            refuse_others(identify(bytes(link.recent)), self.kind)
        return who

    async def reply(
        self, link: Link, read: Callable[[R], T | None], question: bytes, *, strict: bool = True, within_s: float = 0.0
    ) -> T | None:
        """The first reply to `question` that `read` understands. Raises DeviceError when a command was refused and `strict`."""
        link.send(question)

        def look() -> T | None:
            found: T | None = None
            for reply in self.decoder.take_replies():
                if strict and (refusal := self.refusal(reply)) is not None:
                    raise DeviceError(refusal)
                found = found if found is not None else read(reply)
            return found

        return await link.wait_for(look, within_s or self._answer_s)
