"""Starts a LIBERTY or PATRIOT, whatever state it was left in."""

from __future__ import annotations

from collections.abc import Mapping

from vistel.devices.registry import kind_of
from vistel.protocol import liberty, polhemus
from vistel.protocol.liberty import Reply
from vistel.protocol.tracker_frames import LibertyDecoder
from vistel_services.devices.device import Link
from vistel_services.devices.probe import refuse_others
from vistel_services.tracker.polhemus import PolhemusDriver

_ANSWER_S = 0.5
"""A unit answers within this time [s]."""


class LibertyDriver(PolhemusDriver[Reply, str]):
    """model: "liberty" or "patriot"."""

    stop = liberty.STOP
    stream = liberty.STREAM
    restart = liberty.REINITIALISE

    def __init__(
        self, name: str, model: str, stations: Mapping[str, int], hemisphere: tuple[float, float, float], baud: int = 115200
    ) -> None:
        super().__init__(name, LibertyDecoder(name, baud), model, stations, hemisphere, baud, _ANSWER_S)
        self._model = model

    def about(self, who: str) -> str:
        return who

    def refusal(self, reply: Reply) -> str | None:
        return f"refuses the command {chr(reply.command)!r} with error {reply.error}" if reply.error else None

    async def silence(self, link: Link) -> None:
        link.send(liberty.WAKE + liberty.STOP)
        await link.quiet(0.05, 0.4)

    async def ask_who(self, link: Link) -> str | None:
        answer = await self.reply(
            link, lambda r: (r.model, text) if (text := liberty.parse_who(r)) else None, liberty.BINARY + liberty.WHO, strict=False
        )
        if answer is None:
            return None
        refuse_others(kind_of("tracker", answer[0]), self.kind)
        return answer[1]

    async def configure(self, link: Link) -> list[str]:
        known = await self.reply(link, liberty.parse_stations, liberty.QUERY_STATIONS, strict=False)
        detected, active = known or (frozenset(self.stations.values()), frozenset[int]())
        wanted = set(self.stations.values())
        for station in sorted(wanted):
            link.send(liberty.enable_station(station, True))
            link.send(liberty.output_list(station) + polhemus.hemisphere(station, self.hemisphere))
            # Its answer shows that the commands before are done; a unit that does not answer is given the same time.
            await self.reply(link, liberty.parse_stations, liberty.QUERY_STATIONS)
        for station in sorted(active - wanted):
            link.send(liberty.enable_station(station, False))
        link.send(liberty.CENTIMETRES + (liberty.RATE_120_HZ if self._model == "liberty" else b""))
        await self.reply(link, liberty.parse_stations, liberty.QUERY_STATIONS)
        return [role for role, station in self.stations.items() if station not in detected]
