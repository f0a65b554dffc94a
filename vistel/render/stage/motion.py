"""From the compact motion on the wire to postures."""

from functools import cached_property

from vistel.figure.posture.posture import Posture, interpolate
from vistel.messages.postures import posture_of
from vistel.render.stage.prediction import predicted
from vistel.v1 import motion_pb2
from vistel.wire.motion import ListFrame, MotionDecoder, MotionFrame


class ReceivedPosture:
    """A posture that is worked out when it is needed: most of what arrives lies between two pictures."""

    def __init__(self, frame: MotionFrame | ListFrame) -> None:
        self._frame = frame

    @cached_property
    def posture(self) -> Posture:
        """The posture."""
        return posture_of(self._frame.sample())


class InterpolatedPosture:
    """The posture between two others."""

    def __init__(self, a: "ShownPosture", b: "ShownPosture", u: float) -> None:
        self.posture = interpolate(a.posture, b.posture, u)


class PredictedPosture:
    """The posture after the newest one."""

    def __init__(self, before: "ShownPosture", newest: "ShownPosture", span_s: float, ahead_s: float) -> None:
        self.posture = predicted(before.posture, newest.posture, span_s, ahead_s)


ShownPosture = ReceivedPosture | InterpolatedPosture | PredictedPosture
"""However it came about."""


class MotionReader:
    """Decodes one participant's stream."""

    def __init__(self) -> None:
        self._decoder = MotionDecoder()

    def read(self, message: motion_pb2.Motion) -> list[tuple[int, ReceivedPosture]]:
        """Capture times and postures, oldest first: of the message, and of lost ones that it repeats. None when the key
        frame it refers to was lost or it is broken."""
        newest = self._decoder.open(message)
        frames = [*self._decoder.recovered(), *([] if newest is None else [newest])]
        return [(frame.t_ns, ReceivedPosture(frame)) for frame in frames]
