"""Everybody's voices as they are heard at one site."""

from __future__ import annotations

import logging
from collections.abc import Mapping

from vistel.arrays import F32
from vistel.audio.binaural import Binaural
from vistel.audio.delay_policy import MARGIN_S, Policy, Target
from vistel.audio.levels import SILENT_DB
from vistel.audio.mixer import Mixing, Panning
from vistel.audio.need import Need
from vistel.audio.opus import FRAME, FRAME_NS
from vistel.audio.spatial import Place
from vistel.audio.stream import VoiceStream
from vistel.audio.ways import Spatial
from vistel.v1.audio_pb2 import SoundStatus, Voice
from vistel.v1.service_pb2 import ImageDelay

log = logging.getLogger("vistel.audio")

_HEARD_NS = 400_000_000
"""After a frame that somebody spoke in they are shown as talking so long."""


class Talker:
    """One voice."""

    def __init__(self, policy: Policy) -> None:
        self.stream = VoiceStream()
        self.need = Need()
        self.target = Target(policy)
        self.wanted_s = 0.0
        self.level_db = SILENT_DB
        self._talked: list[int] = []

    def hear(self, message: Voice, received_ns: int) -> None:
        """A frame has come."""
        t_ns = message.header.t_ns
        regained = self.stream.push(t_ns, message.opus, message.earlier)
        for back in ([0] if message.opus else []) + regained:
            # What comes only with its successors is waited for like what comes late.
            self.need.observe(received_ns - t_ns + back * FRAME_NS, received_ns)
        if message.opus:
            self.level_db = message.level_db
            if message.talking:
                self._talked.append(t_ns)

    def needed_s(self, output_s: float) -> float:
        """The least delay at which nearly all frames are in time for the mixing that is heard `output_s` later."""
        return self.need.transit_ns * 1e-9 + MARGIN_S + output_s if self.need.known else 0.0

    def talking(self, heard_ns: float) -> bool:
        """Whether speech of theirs is heard at the moment (not when it was said)."""
        capture_ns = heard_ns - self.wanted_s * 1e9
        while len(self._talked) > 1 and self._talked[1] <= capture_ns:
            self._talked.pop(0)
        return bool(self._talked) and self._talked[0] <= capture_ns < self._talked[0] + _HEARD_NS


class Hearing:
    """Voices in, blocks for two ears out."""

    def __init__(self, policy: Policy, own: frozenset[str], spatial: Spatial = "pan") -> None:
        """own: participants of this site, whom nobody here needs to hear through a loudspeaker."""
        self._policy, self._own = policy, own
        self._talkers: dict[str, Talker] = {}
        self._mixing: Mixing = Binaural() if spatial == "hrtf" else Panning()
        self.places: Mapping[str, Place | None] = {}

    def hear_voice(self, participant: str, message: Voice, received_ns: int) -> None:
        """A frame of somebody's voice."""
        if participant in self._own:
            return
        talker = self._talkers.get(participant)
        if talker is None:
            talker = self._talkers[participant] = Talker(self._policy)
            log.info("event=voice participant=%s", participant)
        talker.hear(message, received_ns)

    def hear_image(self, message: ImageDelay) -> None:
        """How late this site's pictures are."""
        for stream in message.streams:
            talker = self._talkers.get(stream.participant)
            if talker is not None:
                talker.target.hear_image(message.header.t_ns, stream.delay_s)

    def mix(self, now_ns: int, heard_ns: float, output_s: float) -> F32 | None:
        """(FRAME, 2) to be heard from `heard_ns` on, `output_s` after it is handed over; None: silence."""
        voices: dict[str, F32] = {}
        for name, talker in self._talkers.items():
            speaking = talker.stream.delay_ns is not None
            talker.wanted_s = talker.target.wanted_s(now_ns, talker.needed_s(output_s), speaking=speaking)
            block = talker.stream.read(heard_ns, FRAME, talker.wanted_s * 1e9)
            if block is not None:
                voices[name] = block
        return self._mixing.mix(voices, self.places)

    def spare_s(self, now_ns: int, output_s: float) -> float | None:
        """How much of the wanted delay is common to all and not needed for the network; None: nobody is there."""
        fixed_s = self._policy.fixed_s
        spare = [
            max(0.0, ((t.target.image_s(now_ns) or 0.0) if fixed_s is None else fixed_s) - t.needed_s(output_s))
            for t in self._talkers.values()
            if t.need.known
        ]
        return min(spare) if spare else None

    def fill(self, message: SoundStatus, now_ns: int, heard_ns: float, output_s: float) -> None:
        """Say how each voice is doing. output_s: the least from handing over to the ear, without what is only held back
        there: pictures would wait for that too, and voices for the pictures, on and on."""
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
        """Who is heard speaking."""
        return frozenset(name for name, talker in self._talkers.items() if talker.talking(heard_ns))
