"""5DT Data Gloves: from bytes to messages, and the little there is to start."""

from __future__ import annotations

import struct

from vistel.devices.registry import kind_of
from vistel.protocol import fivedt
from vistel.protocol.fivedt import Glove5Parser, Glove16Parser, ReportParser, Sample, UltraParser
from vistel.protocol.fivedt_calibration import FiveDtCalibration
from vistel.v1.device_pb2 import GloveFrame
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import DeviceError, Link, NoAnswerError
from vistel_services.devices.probe import refuse_others, who_answers

_HEARD_S = 2.0
_ANSWER_S = 0.5


def highest_of(kind: str) -> int:
    """The highest count of a sensor of a glove of this kind: a Data Glove 5 has a byte for each, the others have 12 bits."""
    return 255 if kind == "5dt_5" else fivedt.HIGHEST


class FiveDtDecoder:
    """A GloveFrame per sample, with raw counts and calibrated angles.

    kind: as in the conference file; reports: its bytes are HID reports; port: which glove of a wireless kit.
    """

    def __init__(
        self, device: str, kind: str, *, right: bool, sensors: int, calibration: FiveDtCalibration, baud: int, reports: bool = False
    ) -> None:
        self.device = device
        self.right = right
        self.says_right: bool | None = None
        """Whether the glove reports that it is a right one; None before it has."""
        self._sensors = sensors
        self._calibration = calibration
        self._five = Glove5Parser(baud) if kind == "5dt_5" else None
        self._parser = self._five or (
            ReportParser() if reports else UltraParser(baud) if kind == "5dt_ultra" else Glove16Parser(baud)
        )

    @property
    def bytes_skipped(self) -> int:
        return self._parser.bytes_skipped

    def took_greeting(self) -> bool:
        """Whether a Data Glove 5 has answered a greeting since this was last asked."""
        return self._five is not None and self._five.took_greeting()

    def feed(self, data: bytes, t_ns: int) -> list[GloveFrame]:
        """Messages completed by bytes that were read at `t_ns`. Samples of the other hand's glove are left out."""
        return [self._frame(s) for s in self._parser.feed(data, t_ns) if self._mine(s)]

    def _mine(self, sample: Sample) -> bool:
        if sample.right is not None:
            self.says_right = sample.right
        return sample.right in (None, self.right)

    def _frame(self, s: Sample) -> GloveFrame:
        raw = bytes(s.values) if len(s.values) == 5 else struct.pack(f">{len(s.values)}H", *s.values)
        angles = self._calibration.angles(s.values, self._sensors)
        frame = GloveFrame(device=self.device, right=self.right, raw=raw, angles=angles)
        frame.header.t_ns = max(0, s.t_ns)
        return frame


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
        self.decoder.took_greeting()
        for _ in range(2):
            link.send(fivedt.HELLO)
            if await link.wait_for(lambda: self.decoder.took_greeting() or None, _ANSWER_S):
                break
        link.send(fivedt.INFO)
        await link.quiet(0.1, _ANSWER_S)
        link.send(fivedt.STREAM)
