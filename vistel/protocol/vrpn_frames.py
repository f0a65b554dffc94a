"""From a VRPN server's bytes to messages.

A tracker's sensors are stations counted from 1; a glove's analog channels are a 5DT glove's sensors, its buttons contacts of
pinch gloves.
"""

import struct

from vistel.protocol import pinch
from vistel.protocol.fivedt import HIGHEST, SLOTS, SLOTS_5
from vistel.protocol.fivedt_calibration import FiveDtCalibration
from vistel.protocol.tracker_frames import Stations
from vistel.protocol.vrpn import AnalogReport, ButtonReport, PongReport, PoseReport, Report, VrpnParser
from vistel.v1.device_pb2 import GloveFrame, TrackerFrame

_FIRST_CHANNEL = {8: 1}
"""VRPN's driver of the Data Glove 5 has eight channels and begins at the second."""
_WORDS = struct.Struct(">16H")


class VrpnTrackerDecoder:
    """A TrackerFrame per measurement of the wanted device, with the newest pose of each station."""

    def __init__(self, device: str, tracker: str) -> None:
        """`tracker`: its name at the server; empty takes any."""
        self.parser = VrpnParser()
        self._tracker = tracker
        self._stations = Stations(device)

    @property
    def bytes_skipped(self) -> int:
        """Bytes so far that were part of no record."""
        return self.parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        """The messages of bytes read at `t_ns`: one for reports that a server sent together, until a station comes again."""
        frames: list[TrackerFrame] = []
        together: set[int] = set()
        for r in self.parser.feed(data, t_ns):
            if not isinstance(r, PoseReport) or self._tracker not in ("", r.device):
                continue
            if r.sensor in together:
                frames.append(self._stations.message(t_ns))
                together.clear()
            together.add(r.sensor)
            self._stations.take(r.sensor + 1, (r.position, r.rotation), r.t_ns)
        return [*frames, self._stations.message(t_ns)] if together else frames


class VrpnGloveDecoder:
    """A GloveFrame whenever the glove reports a change or answers a ping: VRPN reports changes only."""

    def __init__(self, device: str, glove: str, *, right: bool, sensors: int, calibration: FiveDtCalibration | None) -> None:
        """`glove`: its name at the server; empty takes any. calibration: None for a pinch glove."""
        self.device = device
        self.right = right
        self.parser = VrpnParser()
        self._glove = glove
        self._sensors = sensors
        self._calibration = calibration
        self._slots: tuple[int, ...] | None = None
        self._touching: set[int] = set()

    @property
    def bytes_skipped(self) -> int:
        """Bytes so far that were part of no record."""
        return self.parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[GloveFrame]:
        """The message of bytes read at `t_ns`: one for a whole burst of reports, as a server sends one for each channel."""
        reports = [r for r in self.parser.feed(data, t_ns) if self._glove in ("", r.device)]
        about_it = [self._take(r) for r in reports]
        return [self._frame(t_ns)] if any(about_it) and (self._calibration is None or self._slots is not None) else []

    def _take(self, report: Report) -> bool:
        """Whether the report is about this glove."""
        if isinstance(report, AnalogReport):
            self._slots = _slots(report.channels, self._sensors)
        elif isinstance(report, ButtonReport):
            first = 0 if self.right else pinch.CONTACTS
            for button, pressed in report.pressed.items():
                if 0 <= button - first < pinch.CONTACTS:
                    (self._touching.add if pressed else self._touching.discard)(button - first)
        return isinstance(report, AnalogReport | ButtonReport | PongReport)

    def _frame(self, t_ns: int) -> GloveFrame:
        if self._calibration is None or self._slots is None:
            raw = bytes(k in self._touching for k in range(pinch.CONTACTS))
            frame = GloveFrame(device=self.device, right=self.right, raw=raw, angles=pinch.angles(self._touching))
        else:
            angles = self._calibration.angles(self._slots, self._sensors)
            frame = GloveFrame(device=self.device, right=self.right, raw=_WORDS.pack(*self._slots), angles=angles)
        frame.header.t_ns = max(0, t_ns)
        return frame


def _slots(channels: tuple[float, ...], sensors: int) -> tuple[int, ...] | None:
    """The 16 slots of a 5DT glove from its channels: shares of its range, or counts; None for too few of them."""
    channels = channels[_FIRST_CHANNEL.get(len(channels), 0) :]
    names = SLOTS_5 if sensors == len(SLOTS_5) else SLOTS
    if len(channels) < len(names):
        return None
    scale = 1.0 if max(channels[: len(names)]) > 1.0 else HIGHEST + 1.0
    counts = {n: min(HIGHEST, max(0, round(scale * v))) for n, v in zip(names, channels, strict=False)}
    return (*(counts.get(n, 0) for n in SLOTS), 0, 0)
