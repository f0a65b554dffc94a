"""From a CyberGlove's bytes to messages."""

from __future__ import annotations

from vistel.protocol.cyberglove import SENSORS, STATUS_PLUGGED, Answer, CyberGloveParser
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
        return self._parser.bytes_skipped

    @property
    def sensors(self) -> int:
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
