"""Starts a LIBERTY or PATRIOT, whatever state it was left in, and turns what it says into messages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

from vistel.protocol import liberty, polhemus
from vistel.protocol.identify import identify
from vistel.protocol.liberty import LibertyParser, Reply
from vistel.protocol.polhemus import Record
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver
from vistel.wire.topics import BY_NAME
from vistel_services.device import DeviceError, Link, NoAnswerError
from vistel_services.probe import who_answers

T = TypeVar("T")

_ANSWER_S = 0.5
_RESTART_S = 10.0
_OWN_NAMES = {"liberty": "a Polhemus LIBERTY", "patriot": "a Polhemus PATRIOT"}
_STALE_NS = 1_000_000_000


class LibertyDecoder:
    """A TrackerFrame per record, holding the newest pose of each station; a station silent for a second leaves it."""

    def __init__(self, device: str, baud: int = 115200) -> None:
        self.device = device
        self._parser = LibertyParser(baud)
        self._newest: dict[int, TrackerReceiver] = {}

    @property
    def bytes_skipped(self) -> int:
        return self._parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        """Messages completed by bytes that were read at `t_ns`; the header's time is the newest measurement's."""
        return [self._frame(record) for record in self._parser.feed(data, t_ns)]

    def take_replies(self) -> list[Reply]:
        """Answers to commands since the last call."""
        return self._parser.take_replies()

    def _frame(self, record: Record) -> TrackerFrame:
        # The letters tell of weak or too strong signals; how much, only the unit's manual of its firmware says.
        health = TrackerReceiver.HEALTH_UNTRUSTED if record.error else TrackerReceiver.HEALTH_GOOD
        receiver = TrackerReceiver(
            station=record.station, health=health, error=record.error, t_ns=max(0, record.t_ns)
        )
        p, q = receiver.position, receiver.rotation
        p.x, p.y, p.z = record.position
        q.x, q.y, q.z, q.w = record.rotation
        self._newest[record.station] = receiver
        frame = TrackerFrame(device=self.device)
        frame.header.t_ns = receiver.t_ns
        frame.receivers.extend(
            r for _, r in sorted(self._newest.items()) if r.t_ns > receiver.t_ns - _STALE_NS
        )
        return frame


class LibertyDriver:
    """Brings a unit to stream position and quaternion of the wanted stations in binary centimetres.

    model: "liberty" or "patriot"; stations: role ("head", ...) to station. Never saves anything in the unit.
    """

    topic = BY_NAME["tracker"]
    stop = liberty.STOP

    def __init__(
        self, name: str, model: str, stations: Mapping[str, int], hemisphere: tuple[float, float, float],
        baud: int = 115200,
    ) -> None:  # fmt: skip
        self.name = name
        self.decoder = LibertyDecoder(name, baud)
        self._model = model
        self._stations = dict(stations)
        self._hemisphere = hemisphere
        self._baud = baud
        self._met = False

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        who = await self._meet(link)
        missing = await self._configure(link)
        link.send(liberty.STREAM)
        seen = link.frames
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, 2 * _ANSWER_S) is None:
            raise NoAnswerError("answers and sends no records")
        about = f"{who}, {len(self._stations) - len(missing)} receivers"
        return about + (f"; no receiver for {', '.join(missing)}" if missing else "")

    async def _meet(self, link: Link) -> str:
        """Make it answer, at whatever speed it is set to; its own words about itself."""
        others = () if self._met else tuple(b for b in polhemus.BAUD_RATES if b != self._baud)
        for baud in (self._baud, self._baud, *others):
            link.set_baud(baud)
            if (who := await self._greet(link)) is not None:
                self._baud, self._met = baud, True
                return who
        self._met = False
        link.set_baud(self._baud)
        self._refuse_others(await who_answers(link))
        link.send(liberty.REINITIALISE)
        for _ in range(round(_RESTART_S / _ANSWER_S)):
            if (who := await self._greet(link)) is not None:
                return who
        raise NoAnswerError(f"nothing answers like a {self._model.upper()}; check power, cable and its speed")

    async def _greet(self, link: Link) -> str | None:
        """Silence it, then ask who it is."""
        link.recent.clear()
        link.send(liberty.WAKE + liberty.STOP)
        await link.quiet(0.05, 0.4)
        self.decoder.take_replies()
        link.send(liberty.BINARY + liberty.WHO)
        who = await self._reply(link, lambda r: (r.model, text) if (text := liberty.parse_who(r)) else None)
        self._refuse_others(identify(bytes(link.recent)) if who is None else _OWN_NAMES[who[0]])
        return None if who is None else who[1]

    def _refuse_others(self, name: str | None) -> None:
        if name not in (None, _OWN_NAMES[self._model]):
            raise DeviceError(f"{name} answers on this port; a {self._model.upper()} was expected")

    async def _configure(self, link: Link) -> list[str]:
        """Stations, record, hemisphere, units, rate. Returns the roles whose receiver is not plugged in."""
        known = await self._reply(link, liberty.parse_stations, liberty.QUERY_STATIONS)
        detected, active = known or (frozenset(self._stations.values()), frozenset[int]())
        wanted = set(self._stations.values())
        for station in sorted(wanted):
            link.send(liberty.enable_station(station, True))
            link.send(liberty.output_list(station) + polhemus.hemisphere(station, self._hemisphere))
            # Its answer tells that what went before is done; a unit that does not answer is given the same time.
            await self._obeyed(link)
        for station in sorted(active - wanted):
            link.send(liberty.enable_station(station, False))
        link.send(liberty.CENTIMETRES + (liberty.RATE_120_HZ if self._model == "liberty" else b""))
        await self._obeyed(link)
        return [role for role, station in self._stations.items() if station not in detected]

    async def _obeyed(self, link: Link) -> None:
        await self._reply(link, liberty.parse_stations, liberty.QUERY_STATIONS, refusal=True)

    async def _reply(
        self, link: Link, read: Callable[[Reply], T | None], question: bytes = b"", *, refusal: bool = False
    ) -> T | None:
        """The first reply that `read` understands. Raises DeviceError when a command was refused and `refusal`."""
        if question:
            link.send(question)

        def look() -> T | None:
            found: T | None = None
            for reply in self.decoder.take_replies():
                if refusal and reply.error:
                    raise DeviceError(f"refuses the command {chr(reply.command)!r} with error {reply.error}")
                found = found if found is not None else read(reply)
            return found

        return await link.wait_for(look, _ANSWER_S)
