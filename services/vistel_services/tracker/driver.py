"""Starts a FASTRAK, whatever state it was left in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

from vistel.protocol import fastrak, polhemus
from vistel.protocol.fastrak import Reply, Status
from vistel.protocol.identify import identify
from vistel.wire.topics import BY_NAME
from vistel_services.device import DeviceError, Link, NoAnswerError
from vistel_services.probe import who_answers
from vistel_services.tracker.decoder import FastrakDecoder

T = TypeVar("T")

_SLOWEST_BAUD = 57600
_OWN_NAME = "a Polhemus FASTRAK"
_ANSWER_S = 1.0
_CONFIRM_S = 0.3
_RESTART_S = 10.0


class FastrakDriver:
    """Brings a unit to stream position and quaternion of the wanted stations in binary centimetres.

    stations: role ("head", ...) to station 1..4. second: of two units, which keeps to the beat of the first. Never
    sends the commands that overwrite what a site has saved in
    its unit (`W`, `^K`).
    """

    topic = BY_NAME["tracker"]
    stop = fastrak.STOP

    def __init__(
        self, name: str, stations: Mapping[str, int], hemisphere: tuple[float, float, float], baud: int = 115200,
        *, second: bool = False,
    ) -> None:  # fmt: skip
        self.name = name
        self.decoder = FastrakDecoder(name, baud, 4 if second else 0)
        self._second = second
        self._stations = dict(stations)
        self._hemisphere = hemisphere
        self._baud = baud
        self._met = False

    async def start(self, link: Link) -> str:
        """See `Driver.start` (manual, start-up and command reference)."""
        status = await self._meet(link)
        missing = await self._configure(link)
        link.send(fastrak.STREAM)
        seen = link.frames
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, _ANSWER_S) is None:
            raise NoAnswerError("answers and sends no records")
        about = f"FASTRAK {status.firmware} {status.identification}, {len(self._stations) - len(missing)} receivers"
        if missing:
            about += f"; no receiver for {', '.join(missing)}"
        if self._baud < _SLOWEST_BAUD:
            about += f"; {self._baud} baud is too slow for every record, set its switches to 115200"
        return about

    async def _meet(self, link: Link) -> Status:
        """Make it answer, at whatever speed it is set to."""
        others = () if self._met else tuple(b for b in polhemus.BAUD_RATES if b != self._baud)
        for baud in (self._baud, self._baud, *others):
            link.set_baud(baud)
            if (status := await self._greet(link)) is not None:
                self._baud, self._met = baud, True
                return status
        self._met = False
        link.set_baud(self._baud)
        _refuse_others(await who_answers(link))
        link.send(fastrak.REINITIALISE)
        for _ in range(round(_RESTART_S / _ANSWER_S)):
            if (status := await self._greet(link)) is not None:
                return status
        raise NoAnswerError("nothing answers like a FASTRAK; check power, cable and its speed switches")

    async def _greet(self, link: Link) -> Status | None:
        """Silence it, then ask how it is."""
        link.recent.clear()
        link.send(b"\r" + fastrak.STOP)
        await link.quiet(0.05, 0.4)
        self.decoder.take_replies()
        link.send(fastrak.STATUS)
        status = await self._reply(link, fastrak.parse_status, _ANSWER_S)
        if status is None:
            _refuse_others(identify(bytes(link.recent)))
        return status

    async def _configure(self, link: Link) -> list[str]:
        """Stations, record, hemisphere, units. Returns the roles whose receiver is not plugged in."""
        link.send(fastrak.QUERY_STATIONS)
        on = await self._reply(link, fastrak.parse_stations, _CONFIRM_S) or (True,) * 4
        wanted = set(self._stations.values())
        for station in (1, 2, 3, 4):
            if station in wanted:
                link.send(fastrak.enable_station(station, True))
                link.send(fastrak.output_list(station))
                link.send(polhemus.hemisphere(station, self._hemisphere))
            elif on[station - 1]:
                link.send(fastrak.enable_station(station, False))
            # Its answer tells that what went before is done; a unit that does not answer is given the same time.
            link.send(fastrak.QUERY_STATIONS)
            await self._reply(link, fastrak.parse_stations, _CONFIRM_S)
        if self._second:
            link.send(fastrak.EXTERNAL_SYNC)
        link.send(fastrak.STYLUS_REPORTS_ONLY + fastrak.CENTIMETRES + fastrak.BINARY + fastrak.STATUS)
        status = await self._reply(link, fastrak.parse_status, _ANSWER_S)
        if status is not None and not (status.binary and status.centimetres):
            raise DeviceError("stays in text or inches when told to send binary centimetres")
        return [role for role, station in self._stations.items() if not on[station - 1]]

    async def _reply(self, link: Link, read: Callable[[Reply], T | None], timeout_s: float) -> T | None:
        """The first reply that `read` understands. Raises DeviceError when a command was refused."""

        def look() -> T | None:
            found: T | None = None
            for reply in self.decoder.take_replies():
                if reply.command == "E":
                    raise DeviceError(f"refuses a command: {reply.text.strip()}")
                found = found if found is not None else read(reply)
            return found

        return await link.wait_for(look, timeout_s)


def _refuse_others(name: str | None) -> None:
    if name not in (None, _OWN_NAME):
        raise DeviceError(f"{name} answers on this port; a FASTRAK was expected")
