"""Voices: processor time of twenty people who talk at once, what lost packets do to a voice, directions beside formulas."""

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.row import Row, at_most
from vistel.arrays import F32
from vistel.audio.delay_policy import Policy
from vistel.audio.hrtf import EAR_ANGLE, response
from vistel.audio.levels import Meter
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Encoder, version
from vistel.audio.received_voices import ReceivedVoices
from vistel.audio.spatial import HEAD_RADIUS, SOUND_SPEED, Head, source_direction
from vistel.audio.spatial_mode import SpatialMode
from vistel.v1.audio_pb2 import Voice
from vistel.v1.service_pb2 import ImageDelay
from vistel_sim.microphone import babble

TALKERS, SECONDS = 20, 10
LOSS = 0.10
START_NS = 1_000_000_000_000
DELAY_NS, JITTER_NS = 20_000_000, 30_000_000
QUIET = 0.12
"""Of a held vowel's root mean square: below it, there is a gap."""


def run() -> Iterator[Row]:
    speech = babble(3)
    packets, lookahead_ns = _packets(np.resize(0.2 * speech, SECONDS * RATE))
    for spatial in ("pan", "hrtf"):
        case = f"{TALKERS} talkers at once, spatial = {spatial}, {version()}"
        share = _mixed(packets, lookahead_ns, TALKERS, 0.0, 1, spatial)[0]
        yield Row("audio", case, "processor time", "% of a core", 100 * share, target=at_most(20))
    yield from _ears()
    share = _spoken(np.resize(0.2 * speech, SECONDS * RATE))
    case = "one microphone that never rests"
    yield Row("audio", case, "processor time", "% of a core", 100 * share)
    vowel = np.asarray(0.2 * np.sin(2 * np.pi * 140.0 * np.arange(SECONDS * RATE) / RATE), np.float32)
    vowel += np.asarray(0.1 * np.sin(2 * np.pi * 280.0 * np.arange(SECONDS * RATE) / RATE), np.float32)
    held, lookahead_ns = _packets(vowel)
    for loss, what in ((LOSS, "random loss"), (2 * LOSS, "random loss")):
        gaps = [_longest_gap(_mixed(held, lookahead_ns, 1, loss, seed)[1]) for seed in range(5)]
        case = f"{100 * loss:.0f} % {what}, {JITTER_NS // 1_000_000} ms jitter, 5 x {SECONDS} s of a held vowel"
        yield Row("audio", case, "longest gap", "ms", max(gaps), target=at_most(60) if loss == LOSS else None)


def _packets(pcm: F32) -> tuple[list[bytes], int]:
    encoder, meter = Encoder(), Meter()
    out: list[bytes] = []
    for begin in range(0, len(pcm), FRAME):
        frame = pcm[begin : begin + FRAME]
        level = meter.measure(frame)
        message = Voice(opus=encoder.encode(frame), level_db=level.rms_db, talking=level.talking)
        message.header.t_ns = START_NS + begin // FRAME * FRAME_NS - encoder.lookahead_ns
        out.append(message.SerializeToString())
    return out, encoder.lookahead_ns


def _spoken(pcm: F32) -> float:
    """Share of a core that metering, encoding and packing take."""
    began = time.process_time()
    _packets(pcm)
    return (time.process_time() - began) / (len(pcm) / RATE)


def _mixed(
    packets: list[bytes], lookahead_ns: int, talkers: int, loss: float, seed: int, spatial: SpatialMode = "pan"
) -> tuple[float, F32]:
    """Share of a core, and what is heard (n, 2)."""
    rng = np.random.default_rng(seed)
    arriving = sorted(
        (START_NS + k * FRAME_NS + FRAME_NS + DELAY_NS + int(rng.integers(JITTER_NS)), name, payload)
        for name in range(talkers)
        for k, payload in enumerate(packets)
        if rng.random() >= loss
    )
    voices = ReceivedVoices(Policy(), frozenset(), spatial)
    listener = Head(np.zeros(3), np.eye(3))
    angles = np.linspace(-2.5, 2.5, talkers)
    around = [Head(1.5 * np.array([np.sin(a), 0.0, np.cos(a)]), np.eye(3)) for a in angles]
    voices.directions = {f"p{i}": source_direction(listener, head) for i, head in enumerate(around)}
    delays = ImageDelay(site="tokyo")
    for i in range(talkers):
        delays.streams.add(participant=f"p{i}", delay_s=0.13)
    out: list[F32] = []
    at = 0
    began = time.process_time()
    for block in range(len(packets)):
        now_ns = START_NS + block * FRAME_NS
        while at < len(arriving) and arriving[at][0] <= now_ns:
            received_ns, name, payload = arriving[at]
            voices.receive(f"p{name}", Voice.FromString(payload), received_ns)
            at += 1
        if block % 25 == 0:
            delays.header.t_ns = now_ns
            voices.receive_image_delay(delays)
        mixed = voices.mix(now_ns, float(now_ns), 0.0)
        out.append(np.zeros((FRAME, 2), np.float32) if mixed is None else mixed)
    return (time.process_time() - began) / (len(packets) * FRAME_NS * 1e-9), np.concatenate(out)


def _way(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """To a point of a sphere of radius 1 so far round from the source, straight or along its surface, from the centre's."""
    off = np.abs((angle + np.pi) % (2.0 * np.pi) - np.pi)
    return np.where(off < np.pi / 2.0, -np.cos(off), off - np.pi / 2.0)


def _ears() -> Iterator[Row]:
    """The model head against the formulas of the literature, at directions all round."""
    azimuths = np.radians(np.arange(15.0, 166.0, 15.0))
    heads = np.array([response(float(a), 0.0, pinna=False) for a in azimuths])
    frequency = np.fft.rfftfreq(2 * heads.shape[2] - 2, 1.0 / RATE)
    audible = (frequency > 0.0) & (frequency < 16_000.0)
    frequency = frequency[audible]
    ratio = heads[:, 0, audible] / heads[:, 1, audible]
    late = np.unwrap(np.angle(ratio), axis=1) / (2.0 * np.pi * frequency)
    radius_s = HEAD_RADIUS / SOUND_SPEED
    kuhn = 3.0 * radius_s * np.sin(azimuths)
    woodworth = radius_s * (_way(azimuths + EAR_ANGLE) - _way(azimuths - EAR_ANGLE))
    low, high = (int(np.argmin(np.abs(frequency - f))) for f in (300.0, 10_000.0))
    case = "interaural delay, 15 to 165 degrees to the left"
    for at, name, theory in ((low, "300 Hz against 3 a/c sin (Kuhn 1977)", kuhn), (high, "10 kHz against Woodworth", woodworth)):
        error = 1e6 * float(np.max(np.abs(late[:, at] - theory)))
        yield Row("audio", case, f"largest difference, {name}", "us", error, target=at_most(50))
    for f in (500.0, 2000.0, 4000.0, 8000.0):
        level = 20.0 * np.log10(np.abs(ratio[:, int(np.argmin(np.abs(frequency - f)))]))
        yield Row("audio", "interaural level, 15 to 165 degrees to the left", f"largest at {f:.0f} Hz", "dB", float(level.max()))


def _longest_gap(heard: F32) -> float:
    """Milliseconds for which the voice is all but gone, without beginning and end."""
    power = np.convolve(heard[:, 0].astype(np.float64) ** 2, np.ones(240) / 240, "same")[RATE:-RATE]
    quiet = power < QUIET**2 * np.median(power)
    edges = np.flatnonzero(np.concatenate(([True], ~quiet, [True])))
    return float(np.max(np.diff(edges)) - 1) / RATE * 1e3
