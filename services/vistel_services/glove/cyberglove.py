"""Starts a CyberGlove, whatever state it was left in."""

from __future__ import annotations

from vistel.devices.identify import identify
from vistel.devices.registry import kind_of
from vistel.protocol import cyberglove
from vistel.protocol.cyberglove import MASKS, Answer
from vistel.protocol.glove_calibration import GloveCalibration
from vistel.protocol.glove_frames import CyberGloveDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import DeviceError, Link, NoAnswerError
from vistel_services.devices.probe import at_any_speed, refuse_others, who_answers

RATE_HZ = 60.0
_KIND = kind_of("glove", "cyberglove")
_ANSWER_S = 0.5
_RESTART_S = 3.0
_BAUD_RATES = (115200, 38400, 19200, 9600)


class CyberGloveDriver:
    """Brings a glove to stream all its sensors and the status byte at 60 Hz."""

    topic = BY_NAME["glove"]
    stop = cyberglove.STOP
    beat = None

    def __init__(self, name: str, *, right: bool, sensors: int, calibration: GloveCalibration, baud: int = 115200) -> None:
        self.name = name
        self.decoder = CyberGloveDecoder(name, right=right, sensors=sensors, calibration=calibration, baud=baud)
        self._right = right
        self._expected = sensors
        self._baud = baud
        self._met = False

    async def start(self, link: Link) -> str:
        """See `Driver.start` (CyberGlove guide, start-up)."""
        await self._meet(link)
        sensors = await self._ask(link, cyberglove.QUERY_SENSORS)
        count = sensors.data[0] if sensors is not None and sensors.data else self._expected
        if count not in MASKS:
            raise DeviceError(f"reports {count} sensors; gloves with 18 and 22 are known")
        side = await self._ask(link, cyberglove.QUERY_RIGHT)
        if side is not None and side.data and bool(side.data[0]) != self._right:
            here, wanted = ("right", "left") if side.data[0] else ("left", "right")
            raise DeviceError(f"a {here} glove is plugged in where the {wanted} one was expected; swap the ports")
        mask = await self._ask(link, cyberglove.QUERY_MASK)
        for command in (
            cyberglove.set_mask(mask.data if mask is not None else MASKS[count]),
            cyberglove.set_count(count),
            cyberglove.FILTER_ON,
            cyberglove.STATUS_ON,
            cyberglove.TIMESTAMP_OFF,
        ):
            await self._ask(link, command, command[:1].decode())
        await self._ask(link, cyberglove.set_rate(RATE_HZ), "")
        seen = link.frames
        link.send(cyberglove.STREAM)
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, 1.0) is None:
            raise NoAnswerError("answers and sends no samples")
        note = "" if count == self._expected else f"; the conference file says {self._expected}"
        return f"CyberGlove with {count} sensors{note}"

    async def _meet(self, link: Link) -> None:
        """Make it answer, restarting it if need be, at whatever speed it is set to."""
        others = () if self._met else tuple(b for b in _BAUD_RATES if b != self._baud)
        found = await at_any_speed(link, (self._baud, self._baud, *others), self._greet)
        if found is not None:
            self._baud, state = found
        else:
            link.set_baud(self._baud)
            refuse_others(await who_answers(link), _KIND)
            link.send(cyberglove.RESTART)
            await self._wait(link, "^R", _RESTART_S)
            state = await self._greet(link)
        self._met = state is not None
        if state is None:
            raise NoAnswerError("nothing answers like a CyberGlove; check power, cable and its speed switch")
        if not state & 2:
            raise DeviceError("its interface answers and no glove is plugged in there")
        if not state & 1:
            link.send(cyberglove.RESTART)
            await self._wait(link, "^R", _RESTART_S)

    async def _greet(self, link: Link) -> int | None:
        """Silence it, then ask for its state."""
        link.recent.clear()
        link.send(cyberglove.STOP)
        await link.quiet(0.05, 0.4)
        state = await self._ask(link, cyberglove.QUERY_STATE)
        if state is None:
            refuse_others(identify(bytes(link.recent)), _KIND)
        return state.data[0] if state is not None and state.data else None

    async def _ask(self, link: Link, command: bytes, name: str | None = None) -> Answer | None:
        self.decoder.take_answers()
        link.send(command)
        return await self._wait(link, command.decode("ascii") if name is None else name, _ANSWER_S)

    async def _wait(self, link: Link, name: str, timeout_s: float) -> Answer | None:
        def look() -> Answer | None:
            return next((a for a in self.decoder.take_answers() if a.name == name), None)

        return await link.wait_for(look, timeout_s)
