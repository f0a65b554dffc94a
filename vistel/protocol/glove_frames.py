"""From the bytes of CyberGloves and 5DT gloves to messages."""

import struct

from vistel.protocol import fivedt
from vistel.protocol.cyberglove import SENSORS, STATUS_PLUGGED, Answer, CyberGloveParser
from vistel.protocol.fivedt import Glove5Parser, Glove16Parser, ReportParser, Sample, UltraParser
from vistel.protocol.fivedt_calibration import FiveDtCalibration
from vistel.protocol.glove_calibration import GloveCalibration
from vistel.v1.device_pb2 import GloveFrame


class CyberGloveDecoder:
    """A GloveFrame per sample, with raw counts and calibrated angles.

    How many sensors there are is corrected by the glove's own answer, live and in a replay of recorded bytes.
    Samples taken while the glove was unplugged from its interface are dropped.
    """

    def __init__(self, device: str, *, right: bool, sensors: int, calibration: GloveCalibration, baud: int = 115200) -> None:
        self.device = device
        self.right = right
        self._calibration = calibration
        self._parser = CyberGloveParser(sensors, baud=baud)
        self._answers: list[Answer] = []

    @property
    def bytes_skipped(self) -> int:
        """Bytes so far that were part of no record."""
        return self._parser.bytes_skipped

    @property
    def sensors(self) -> int:
        """How many the glove has."""
        return self._parser.sensors

    def feed(self, data: bytes, t_ns: int) -> list[GloveFrame]:
        """Messages completed by bytes that were read at `t_ns`."""
        samples = self._parser.feed(data, t_ns)
        for answer in self._parser.take_answers():
            if answer.name in ("?S", "?N") and len(answer.data) == 1 and answer.data[0] in SENSORS:
                self._parser.sensors = answer.data[0]
            self._answers.append(answer)
        del self._answers[:-64]
        frames: list[GloveFrame] = []
        for s in samples:
            if s.error or (s.status is not None and not s.status & STATUS_PLUGGED):
                continue
            frame = GloveFrame(device=self.device, right=self.right, raw=s.values, angles=self._calibration.angles(s.values))
            frame.header.t_ns = max(0, s.t_ns)
            frames.append(frame)
        return frames

    def take_answers(self) -> list[Answer]:
        """Answers to commands since the last call."""
        answers, self._answers = self._answers, []
        return answers


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
        """Bytes so far that were part of no record."""
        return self._parser.bytes_skipped

    def answered_hello(self) -> bool:
        """Whether a Data Glove 5 has answered a greeting since this was last asked."""
        return self._five is not None and self._five.answered_hello()

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
