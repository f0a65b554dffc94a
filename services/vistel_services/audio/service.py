"""The audio service: every 20 ms microphones are read and voices mixed."""

from __future__ import annotations

import logging

from prometheus_client import Counter, Gauge

from vistel.arrays import F32
from vistel.audio.capture import MicrophoneCapture
from vistel.audio.microphone_switches import PAGE, MicrophoneSwitches
from vistel.audio.opus import FRAME_NS, Encoder, version
from vistel.audio.received_voices import ReceivedVoices
from vistel.session.microphone_controls import MicrophoneControls
from vistel.v1.audio_pb2 import Sound, SoundStatus
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.audio.config import Config
from vistel_services.audio.heads import Heads
from vistel_services.audio.inputs import InputOpener
from vistel_services.audio.outputs import Loudspeaker
from vistel_services.audio.unit import DelayUnit
from vistel_services.audio.voice_sender import VoiceSender
from vistel_services.audio.voice_subscriptions import VoiceSubscriptions

log = logging.getLogger("vistel.audio")

_KNOWN = Gauge("vistel_audio_acoustic_delay_known", "1 while the delay after the sound card is known", ["site"])
_MOUTH_TO_EAR = Gauge("vistel_audio_mouth_to_ear_seconds", "Time from capture to ear", ["site", "participant"])
_TARGET = Gauge("vistel_audio_target_delay_seconds", "Wanted time from capture to ear", ["site", "participant"])
_SKEW = Gauge("vistel_audio_skew_seconds", "Time from a picture to its voice", ["site", "participant"])
_CONCEALED = Counter("vistel_audio_concealed_frames_total", "Frames concealed, lost or late", ["site", "participant"])

_REPORT_NS = 250_000_000
_DIRECTIONS_NS = 200_000_000
_STREAM_BITRATE = 64_000


async def run_audio(config: Config, bus: Bus, clock: Clock) -> None:
    """Runs until cancelled."""
    log.info("event=sound codec=%r policy=%r microphones=%d", version(), str(config.policy), len(config.microphones))
    site = _Site(config, bus, clock)
    try:
        while True:
            now_ns = clock.now_ns()
            site.round(now_ns)
            await clock.sleep_until_ns((now_ns // FRAME_NS + 1) * FRAME_NS)
    finally:
        site.close()


class _Stream:
    """Publishes the mix, for the site's video and for listeners elsewhere."""

    def __init__(self, publication: Publication) -> None:
        self._publication = publication
        self._encoder = Encoder(2, _STREAM_BITRATE, voice=False, complexity=0, dtx=False)
        self._sounding = False

    def put(self, heard_ns: float, block: F32 | None) -> None:
        """Publish a block that is heard from `heard_ns` on."""
        if block is None and not self._sounding:
            return
        message = Sound(opus=b"" if block is None else self._encoder.encode(block))
        message.header.t_ns = round(heard_ns) - self._encoder.lookahead_ns
        self._sounding = block is not None
        self._publication.put(message)


class _Site:
    """The sound of one site."""

    def __init__(self, config: Config, bus: Bus, clock: Clock) -> None:
        self._config = config
        wanted = {m.participant: m.push_to_talk for m in config.microphones} | dict.fromkeys(config.pages, False)
        self._switches = MicrophoneSwitches(wanted, config.memory)
        self._senders = [
            VoiceSender(
                m.participant,
                MicrophoneCapture(m.participant, InputOpener(m.source, clock)),
                bus.publish(BY_NAME["voice"], participant=m.participant),
                config.bitrate,
                self._switches[m.participant],
                bus.uplink,
                config.repeats,
                bus.publish(BY_NAME["voice_level"], participant=m.participant) if config.crowd else None,
            )
            for m in config.microphones
        ]
        self._voices_received = ReceivedVoices(config.policy, frozenset(m.participant for m in config.microphones), config.spatial)
        self._loudspeaker = Loudspeaker(config.loudspeaker, clock)
        self._stream = _Stream(bus.publish(BY_NAME["sound"])) if config.stream else None
        self._status = bus.publish(BY_NAME["sound_status"])
        self._voices = VoiceSubscriptions(bus, config.crowd, [m.participant for m in config.microphones])
        self._replies = bus.subscribe(BY_NAME["spoken_reply"], queue_all=True, polled=True, site=config.site)
        self._images = bus.subscribe(BY_NAME["image_delay"], polled=True, site=config.site)
        self._controls = MicrophoneControls(bus, config.site, self._switches)
        self._heads = Heads(bus, config.listener, config.crowd) if config.spatial != "off" else None
        self._unit = DelayUnit(bus, config.delay_unit, config.site) if config.delay_unit else None
        self._directions_ns = self._report_ns = 0
        self._heard_ns = 0.0
        self._concealed = dict[str, int]()
        self._shown: frozenset[str] = frozenset()

    def round(self, now_ns: int) -> None:
        """One round, every 20 ms."""
        self._take()
        for sender in self._senders:
            sender.step(now_ns)
        while (played_ns := self._loudspeaker.due(now_ns)) is not None:
            self._play(now_ns, played_ns)
        if self._heads is not None and now_ns - self._directions_ns >= _DIRECTIONS_NS:
            self._directions_ns = now_ns
            self._voices_received.directions = self._heads.directions()
        self._voices.choose(self._heads.far if self._heads is not None else {}, now_ns)
        talking = self._voices_received.talking(self._heard_ns)
        if now_ns - self._report_ns >= _REPORT_NS or talking != self._shown:
            self._report_ns, self._shown = now_ns, talking
            self._report(now_ns)

    @property
    def _after_s(self) -> float:
        """From playback to the ear, as far as known [s]."""
        unit_s = (self._unit.acoustic_s or 0.0) if self._unit is not None else 0.0
        return self._config.latency_s + unit_s

    def _play(self, now_ns: int, played_ns: float) -> None:
        self._heard_ns = played_ns + self._after_s * 1e9
        output_s = max(0.0, (self._heard_ns - now_ns) * 1e-9)
        block = self._voices_received.mix(now_ns, self._heard_ns, output_s)
        self._loudspeaker.put(block)
        if self._stream is not None:
            self._stream.put(self._heard_ns, block)

    def _take(self) -> None:
        for sample in self._voices.take():
            self._voices_received.receive(sample.names["participant"], sample.message, sample.received_ns)
        for sample in self._replies.take():
            self._voices_received.receive(f"reply-to-{sample.names['participant']}", sample.message, sample.received_ns)
        for sample in self._images.take():
            self._voices_received.receive_image_delay(sample.message)
        self._controls.take()
        if self._unit is not None:
            self._unit.take()

    def _report(self, now_ns: int) -> None:
        output_s = max(0.0, (self._loudspeaker.latency_ns * 1e-9) + self._after_s)
        least_s = output_s
        if self._unit is not None:
            least_s += self._unit.latency_s - (self._unit.acoustic_s or 0.0)
            self._unit.request(self._voices_received.spare_s(now_ns, least_s), now_ns)
        message = SoundStatus(
            site=self._config.site,
            policy=str(self._config.policy),
            loudspeaker=self._loudspeaker.about,
            loudspeaker_detail=self._loudspeaker.detail,
            output_s=output_s,
            acoustic_known=self._unit is None or self._unit.acoustic_s is not None,
        )
        message.header.t_ns = now_ns
        self._voices_received.fill(message, now_ns, self._heard_ns, least_s)
        for sender in self._senders:
            sender.fill(message.microphones.add(), now_ns)
        for name in self._config.pages:  # the service of guests does what the switch says
            message.microphones.add(participant=name, source=PAGE, open=True, muted=not self._switches[name].open)
        _KNOWN.labels(self._config.site).set(float(message.acoustic_known))
        self._measure(message)
        self._status.put(message)

    def _measure(self, message: SoundStatus) -> None:
        for voice in message.streams:
            whose = self._config.site, voice.participant
            _TARGET.labels(*whose).set(voice.target_s)
            _MOUTH_TO_EAR.labels(*whose).set(voice.actual_s)
            _CONCEALED.labels(*whose).inc(voice.concealed - self._concealed.get(voice.participant, 0))
            self._concealed[voice.participant] = voice.concealed
            if voice.HasField("skew_s"):
                _SKEW.labels(*whose).set(voice.skew_s)

    def close(self) -> None:
        """Close devices and subscriptions."""
        for sender in self._senders:
            sender.close()
        self._loudspeaker.close()
        for subscription in (self._voices, self._replies, self._images, self._controls):
            subscription.close()
        if self._heads is not None:
            self._heads.close()
        if self._unit is not None:
            self._unit.close()
