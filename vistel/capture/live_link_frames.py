"""From the packets of a phone with Live Link Face to messages."""

from vistel.figure.face.marks import Expressions
from vistel.protocol.live_link_face import CHANNELS, LiveLinkParser
from vistel.v1.device_pb2 import FaceFrame

_BLINKS = [CHANNELS.index(name) for name in ("eyeBlinkLeft", "eyeBlinkRight")]


class LiveLinkDecoder:
    """A FaceFrame for each packet with a face in it."""

    def __init__(self, device: str) -> None:
        self.device = device
        self._parser = LiveLinkParser()
        self._expressions = Expressions(CHANNELS)

    @property
    def bytes_skipped(self) -> int:
        """Bytes so far that were part of no record."""
        return self._parser.bytes_skipped

    @property
    def subject(self) -> str:
        """What the phone calls itself."""
        return self._parser.subject

    def feed(self, data: bytes, t_ns: int) -> list[FaceFrame]:
        """The message of a packet read at `t_ns`."""
        out: list[FaceFrame] = []
        for packet in self._parser.feed(data, t_ns):
            if packet.values:
                frame = FaceFrame(
                    device=self.device,
                    marks=self._expressions.marks(packet.values).ravel().tolist(),
                    gaze=self._expressions.gaze(packet.values).tolist(),
                    channels=packet.values,
                    lids=[1.0 - min(1.0, max(0.0, packet.values[k])) for k in _BLINKS],
                )
                frame.header.t_ns = max(0, t_ns)
                out.append(frame)
        return out
