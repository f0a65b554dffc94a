"""Publishing a participant from a program: who they are, and their postures."""

from vistel.figure.posture.posture import Posture
from vistel.messages.postures import sample_of
from vistel.v1.motion_pb2 import Participant
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.motion.publication import MotionPublication
from vistel.wire.topics import BY_NAME


class ParticipantPublisher:
    """Announces a participant of the bus's site and publishes their postures."""

    def __init__(
        self, bus: Bus, clock: Clock, participant: str, display_name: str, avatar: str, height_m: float, *, crowded: bool
    ) -> None:
        self._clock = clock
        self._motion = MotionPublication(bus, participant, crowded=crowded)
        about = Participant(participant=participant, site=bus.site, display_name=display_name, avatar=avatar, height_m=height_m)
        about.header.t_ns = clock.now_ns()
        about.header.source = f"{bus.site}/program"
        bus.publish(BY_NAME["participant"], participant=participant).put(about)
        bus.announce(f"participant-{participant}")

    def put(self, posture: Posture, t_ns: int | None = None) -> None:
        """Publish a posture. t_ns: conference time of its capture; default: now. Call it at up to 60 Hz; times must rise."""
        t_ns = self._clock.now_ns() if t_ns is None else t_ns
        face = None if posture.face is None else posture.face.reshape(-1)
        sample = sample_of(posture, self._motion.next_seq, t_ns, gaze=posture.gaze, face=face, lids=posture.lids)
        self._motion.put(sample)
