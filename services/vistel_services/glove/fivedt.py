"""Starts 5DT Data Gloves, as far as there is anything to start."""

from vistel.devices.registry import kind_of
from vistel.protocol import fivedt
from vistel.protocol.glove_frames import FiveDtDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import DeviceError, Link, NoAnswerError
from vistel_services.devices.probe import refuse_others, who_answers

_HEARD_S = 2.0
_ANSWER_S = 0.5


class FiveDtDriver:
    """Waits for a glove that talks by itself; asks a Data Glove 5 to."""

    topic = BY_NAME["glove"]
    beat = None

    def __init__(self, kind: str, decoder: FiveDtDecoder, *, right: bool, sensors: int) -> None:
        self.name = decoder.device
        self.stop = fivedt.HELLO if kind == "5dt_5" else b""
        self.decoder = decoder
        self._kind = kind_of("glove", kind)
        self._right = right
        self._sensors = sensors

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        self.decoder.says_right = None
        if self._kind.name == "5dt_5":
            await self._ask(link)
        seen = link.frames
        if await link.wait_for(lambda: self._heard(link, seen), _HEARD_S) is None:
            refuse_others(await who_answers(link), self._kind)
            raise NoAnswerError(f"nothing talks like {self._kind.title}; check power and cable")
        if self.decoder.says_right not in (None, self._right):
            here, wanted = ("right", "left") if self.decoder.says_right else ("left", "right")
            raise DeviceError(f"a {here} glove is plugged in where the {wanted} one was expected; swap the ports")
        return f"{self._kind.title.removeprefix('a ')} with {self._sensors} sensors"

    def _heard(self, link: Link, seen: int) -> bool | None:
        wrong = self.decoder.says_right not in (None, self._right)
        return True if link.frames > seen or wrong else None

    async def _ask(self, link: Link) -> None:
        self.decoder.answered_hello()
        for _ in range(2):
            link.send(fivedt.HELLO)
            if await link.wait_for(lambda: self.decoder.answered_hello() or None, _ANSWER_S):
                break
        link.send(fivedt.INFO)
        await link.quiet(0.1, _ANSWER_S)
        link.send(fivedt.STREAM)
