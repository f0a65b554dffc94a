"""Voices: processor time of twenty talkers heard at once and of one site of three, and what loss does to a voice."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.row import Row, machine
from vistel.audio.delay_policy import Policy
from vistel.audio.levels import Meter
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Encoder, version
from vistel.audio.spatial import Head, heard_from
from vistel.v1.audio_pb2 import Voice
from vistel.v1.service_pb2 import ImageDelay
from vistel_services.audio.hearing import Hearing
from vistel_sim.talker import babble

F32 = NDArray[np.float32]

TALKERS, SECONDS = 20, 10
LOSS = 0.10
START_NS = 1_000_000_000_000
DELAY_NS, JITTER_NS = 20_000_000, 30_000_000
QUIET = 0.12
"""Of a held vowel's root mean square: below it, there is a gap."""


def run() -> Iterator[Row]:
    """One row after the other."""
    where = machine()
    speech = babble(3)
    packets, lookahead_ns = _packets(np.resize(0.2 * speech, SECONDS * RATE))
    case = f"{TALKERS} talkers at once, spatialised, {version()}"
    share = _mixed(packets, lookahead_ns, TALKERS, 0.0, 1)[0]
    yield Row("audio", case, "processor time", "% of a core", 100 * share, None, None, None, "<= 20", share <= 0.20, where)
    share = _spoken(np.resize(0.2 * speech, SECONDS * RATE))
    case = "one microphone that never rests"
    yield Row("audio", case, "processor time", "% of a core", 100 * share, None, None, None, None, None, where)
    vowel = np.asarray(0.2 * np.sin(2 * np.pi * 140.0 * np.arange(SECONDS * RATE) / RATE), np.float32)
    vowel += np.asarray(0.1 * np.sin(2 * np.pi * 280.0 * np.arange(SECONDS * RATE) / RATE), np.float32)
    held, lookahead_ns = _packets(vowel)
    for loss, what in ((LOSS, "random loss"), (2 * LOSS, "random loss")):
        gaps = [_longest_gap(_mixed(held, lookahead_ns, 1, loss, seed)[1]) for seed in range(5)]
        case = f"{100 * loss:.0f} % {what}, {JITTER_NS // 1_000_000} ms jitter, 5 x {SECONDS} s of a held vowel"
        target, met = ("<= 60", max(gaps) <= 60.0) if loss == LOSS else (None, None)
        yield Row("audio", case, "longest gap", "ms", max(gaps), None, None, None, target, met, where)


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


def _mixed(packets: list[bytes], lookahead_ns: int, talkers: int, loss: float, seed: int) -> tuple[float, F32]:
    """Share of a core, and what is heard (n, 2)."""
    rng = np.random.default_rng(seed)
    arriving = sorted(
        (START_NS + k * FRAME_NS + FRAME_NS + DELAY_NS + int(rng.integers(JITTER_NS)), name, payload)
        for name in range(talkers) for k, payload in enumerate(packets) if rng.random() >= loss
    )  # fmt: skip
    hearing = Hearing("tokyo", Policy(), frozenset())
    listener = Head(np.zeros(3), np.eye(3))
    angles = np.linspace(-2.5, 2.5, talkers)
    hearing.ears = {
        f"p{i}": heard_from(listener, Head(1.5 * np.array([np.sin(a), 0.0, np.cos(a)]), np.eye(3))) for i, a in enumerate(angles)
    }
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
            hearing.hear_voice(f"p{name}", Voice.FromString(payload), received_ns)
            at += 1
        if block % 25 == 0:
            delays.header.t_ns = now_ns
            hearing.hear_image(delays)
        mixed = hearing.mix(now_ns, float(now_ns), 0.0)
        out.append(np.zeros((FRAME, 2), np.float32) if mixed is None else mixed)
    return (time.process_time() - began) / (len(packets) * FRAME_NS * 1e-9), np.concatenate(out)


def _longest_gap(heard: F32) -> float:
    """Milliseconds for which the voice is all but gone, without beginning and end."""
    power = np.convolve(heard[:, 0].astype(np.float64) ** 2, np.ones(240) / 240, "same")[RATE:-RATE]
    quiet = power < QUIET**2 * np.median(power)
    edges = np.flatnonzero(np.concatenate(([True], ~quiet, [True])))
    return float(np.max(np.diff(edges)) - 1) / RATE * 1e3
