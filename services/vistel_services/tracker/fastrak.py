"""Starts a FASTRAK, whatever state it was left in (manual, start-up and command reference)."""

from __future__ import annotations

from collections.abc import Mapping

from vistel.protocol import fastrak, polhemus
from vistel.protocol.fastrak import Reply, Status
from vistel.protocol.tracker_frames import FastrakDecoder
from vistel_services.devices.device import DeviceError, Link
from vistel_services.tracker.polhemus import PolhemusDriver

_SLOWEST_BAUD = 57600
_ANSWER_S = 1.0
_CONFIRM_S = 0.3


class FastrakDriver(PolhemusDriver[Reply, Status]):
    """Stations 1..4. first_station: added to their numbers in messages; above 0 it is the second of two units and is synchronised
    with the first."""

    stop = fastrak.STOP
    stream = fastrak.STREAM
    restart = fastrak.REINITIALISE

    def __init__(
        self,
        name: str,
        stations: Mapping[str, int],
        hemisphere: tuple[float, float, float],
        baud: int = 115200,
        *,
        first_station: int = 0,
    ) -> None:
        decoder = FastrakDecoder(name, baud, first_station)
        super().__init__(name, decoder, "fastrak", stations, hemisphere, baud, _ANSWER_S)
        self._second = first_station > 0

    @property
    def warning(self) -> str:
        if self.baud >= _SLOWEST_BAUD:
            return ""
        return f"; {self.baud} baud is too slow for every record, set its switches to 115200"

    def about(self, who: Status) -> str:
        return f"FASTRAK {who.firmware} {who.identification}"

    def refusal(self, reply: Reply) -> str | None:
        return f"refuses a command: {reply.text.strip()}" if reply.command == "E" else None

    async def silence(self, link: Link) -> None:
        link.send(b"\r" + fastrak.STOP)
        await link.quiet(0.05, 0.4)

    async def ask_who(self, link: Link) -> Status | None:
        return await self.reply(link, fastrak.parse_status, fastrak.STATUS)

    async def configure(self, link: Link) -> list[str]:
        on = await self.reply(link, fastrak.parse_stations, fastrak.QUERY_STATIONS, within_s=_CONFIRM_S) or (True,) * 4
        wanted = set(self.stations.values())
        for station in (1, 2, 3, 4):
            if station in wanted:
                link.send(fastrak.enable_station(station, True))
                link.send(fastrak.output_list(station))
                link.send(polhemus.hemisphere(station, self.hemisphere))
            elif on[station - 1]:
                link.send(fastrak.enable_station(station, False))
            # Its answer shows that the commands before are done; a unit that does not answer is given the same time.
            await self.reply(link, fastrak.parse_stations, fastrak.QUERY_STATIONS, within_s=_CONFIRM_S)
        if self._second:
            link.send(fastrak.EXTERNAL_SYNC)
        link.send(fastrak.STYLUS_REPORTS_ONLY + fastrak.CENTIMETRES + fastrak.BINARY)
        status = await self.reply(link, fastrak.parse_status, fastrak.STATUS)
        if status is not None and not (status.binary and status.centimetres):
            raise DeviceError("stays in text or inches after the command for binary centimetres")
        return [role for role, station in self.stations.items() if not on[station - 1]]
