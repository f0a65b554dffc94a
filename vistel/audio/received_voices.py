"""The voices that a site receives, mixed for its listener."""

from __future__ import annotations

import logging
from collections.abc import Mapping

from vistel.arrays import F32
from vistel.audio.binaural import BinauralMixer
from vistel.audio.delay_policy import MARGIN_S, Policy, TargetDelay, Way
from vistel.audio.levels import SILENT_DB
from vistel.audio.mixer import Mixer, PanningMixer
from vistel.audio.opus import FRAME, FRAME_NS
from vistel.audio.spatial import SourceDirection
from vistel.audio.spatial_mode import SpatialMode
from vistel.audio.stream import VoiceStream
from vistel.audio.transit import TransitEstimate
from vistel.v1.audio_pb2 import SoundStatus, Voice
from vistel.v1.service_pb2 import ImageDelay

log = logging.getLogger("vistel.audio")

_TALKING_NS = 400_000_000
"""For so long after a frame with speech its participant is shown as talking."""


class Talker:
    """One received voice."""

    def __init__(self, policy: Policy) -> None:
        self.stream = VoiceStream()
        self.transit = TransitEstimate()
        self.target = TargetDelay(policy)
        self.wanted_s = 0.0
        self.level_db = SILENT_DB
        self._talked: list[int] = []

    def receive(self, message: Voice, received_ns: int) -> None:
        """Take a message that arrived at `received_ns`."""
        t_ns = message.header.t_ns
        recovered = self.stream.push(t_ns, message.opus, message.earlier)
        for back in ([0] if message.opus else []) + recovered:
            # A frame recovered from a later message counts as a late one.
            self.transit.observe(received_ns - t_ns + back * FRAME_NS, received_ns)
        if message.opus:
            self.level_db = message.level_db
            if message.talking:
                self._talked.append(t_ns)

    def needed_s(self, output_s: float) -> float:
        """The least delay [s] at which nearly all frames are in time for a mix that is heard `output_s` later."""
        return self.transit.transit_ns * 1e-9 + MARGIN_S + output_s if self.transit.known else 0.0

    def talking(self, heard_ns: float) -> bool:
        """Whether their speech is being heard now."""
        capture_ns = heard_ns - self.wanted_s * 1e9
        while len(self._talked) > 1 and self._talked[1] <= capture_ns:
            self._talked.pop(0)
        return bool(self._talked) and self._talked[0] <= capture_ns < self._talked[0] + _TALKING_NS


class ReceivedVoices:
    """Voice messages in, stereo blocks out."""

    def __init__(self, policy: Policy, own: frozenset[str], spatial: SpatialMode = "pan") -> None:
        """own: participants of this site, whose voices are not played."""
        self._policy, self._own = policy, own
        self._talkers: dict[str, Talker] = {}
        self._mixer: Mixer = BinauralMixer() if spatial == "hrtf" else PanningMixer()
        self.directions: Mapping[str, SourceDirection | None] = {}

    def receive(self, participant: str, message: Voice, received_ns: int) -> None:
        """Take a message of a participant's voice."""
        if participant in self._own:
            return
        talker = self._talkers.get(participant)
        if talker is None:
            talker = self._talkers[participant] = Talker(self._policy)
            log.info("event=voice participant=%s", participant)
        talker.receive(message, received_ns)

    def receive_image_delay(self, message: ImageDelay) -> None:
        """Take the delays of this site's pictures."""
        for stream in message.streams:
            talker = self._talkers.get(stream.participant)
            if talker is not None:
                t_ns, drawing_s = message.header.t_ns, message.frame_time_s
                if stream.playout_s or stream.towards_s:
                    talker.target.receive_image_delay(t_ns, drawing_s, Way(stream.playout_s, stream.towards_s, stream.rate))
                else:  # of a release that does not tell
                    talker.target.receive_image_delay(t_ns, stream.delay_s)

    def mix(self, now_ns: int, heard_ns: float, output_s: float) -> F32 | None:
        """(FRAME, 2) to be heard from `heard_ns` on, `output_s` after it is put out; None: silence."""
        voices: dict[str, F32] = {}
        for name, talker in self._talkers.items():
            speaking = talker.stream.delay_ns is not None
            talker.wanted_s = talker.target.wanted_s(now_ns, talker.needed_s(output_s), speaking=speaking)
            block = talker.stream.read(heard_ns, FRAME, talker.wanted_s * 1e9)
            if block is not None:
                voices[name] = block
        return self._mixer.mix(voices, self.directions)

    def spare_s(self, now_ns: int, output_s: float) -> float | None:
        """Delay that all voices have beyond what the network needs [s]; None: no voices."""
        fixed_s = self._policy.fixed_s
        spare = [
            max(0.0, ((t.target.image_s(now_ns) or 0.0) if fixed_s is None else fixed_s) - t.needed_s(output_s))
            for t in self._talkers.values()
            if t.transit.known
        ]
        return min(spare) if spare else None

    def fill(self, message: SoundStatus, now_ns: int, heard_ns: float, output_s: float) -> None:
        """Add the status of each voice. output_s: least delay of the output, without that which is set at a delay unit:
        pictures would wait for that too, and voices for the pictures, without end."""
        for name, talker in self._talkers.items():
            counters = talker.stream.counters
            image_s = talker.target.image_s(now_ns)
            actual_s = talker.stream.delay_ns
            actual_s = talker.wanted_s if actual_s is None else actual_s * 1e-9
            skew_s = None if image_s is None else actual_s - image_s
            talking = talker.talking(heard_ns)
            message.streams.add(
                participant=name,
                target_s=talker.wanted_s,
                actual_s=actual_s,
                image_s=image_s,
                skew_s=skew_s,
                needed_s=talker.needed_s(output_s),
                talking=talking,
                level_db=talker.level_db if talking else SILENT_DB,
                drift_ppm=talker.stream.drift_ppm,
                frames=counters.played + counters.recovered + counters.concealed,
                concealed=counters.concealed,
            )

    def talking(self, heard_ns: float) -> frozenset[str]:
        """Participants whose speech is being heard."""
        return frozenset(name for name, talker in self._talkers.items() if talker.talking(heard_ns))
