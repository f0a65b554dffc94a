"""A simulated microphone: a participant's voice, from the motion source that moves their body, into a named pipe.

The pipe carries 16-bit samples, mono, 48 kHz, in blocks of 20 ms, each written at its end. Speech is babble (vowels that glide
into one another) at the loudness that the motion source gives, or sentences. When hands meet, there is a clap.
"""

import contextlib
import fcntl
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from vistel.arrays import F32
from vistel.wire.clock import Clock
from vistel_sim.faults import DeviceFaults, Fault
from vistel_sim.sentences import Sentences

RATE = 48_000
"""Samples a second."""
BLOCK = 960
"""Samples in a block of 20 ms."""
_BLOCK_NS = 20_000_000
"""Length of a block [ns]."""
_LATE_NS = 500_000_000
"""A machine that is later than this skips blocks [ns]."""
_PIPE_BYTES = 16384
"""Size of the pipe, a sixth of a second: a reader that is late misses sound."""
_LOOP_S = 2.4
"""Length of the babble that is repeated [s]."""
_NOISE = 2e-4
"""Root mean square of the room's noise (full scale: 1)."""
_LOUD = 0.22
"""Root mean square of the babble (full scale: 1)."""
_CLAP_S = 0.03
"""Length of a clap [s]."""
_VOWELS = ((730, 1090, 2440), (270, 2290, 3010), (570, 840, 2410), (300, 870, 2240), (530, 1840, 2480), (640, 1190, 2390))
"""Formants of vowels [Hz] (Peterson and Barney 1952, men)."""
_PEAKS = ((1.0, 90.0), (0.6, 110.0), (0.25, 160.0))
"""Height and half width [Hz] of each formant."""

Loudness = Callable[[float], float]
"""t [s] -> 0 to 1."""
Claps = Callable[[float, float], Sequence[float]]
"""start, end [s] -> times of claps between them."""


def babble(seed: int) -> F32:
    """(n,) samples of a voice that glides through vowels; a loop without a seam."""
    rng = np.random.default_rng(seed)
    n = int(_LOOP_S * RATE)
    t = np.arange(n) / RATE
    periods = round(float(rng.uniform(95.0, 215.0)) * _LOOP_S)
    wobble = 0.35 * np.sin(2 * np.pi * 2 * t / _LOOP_S + rng.uniform(0, 6)) + 0.12 * np.sin(2 * np.pi * 7 * t / _LOOP_S)
    phase = 2.0 * np.pi * periods * t / _LOOP_S + 2.0 * wobble
    pitch = periods / _LOOP_S
    size = 1.0 if pitch < 150.0 else 1.16
    stops = 12
    targets = np.array([_VOWELS[i] for i in rng.integers(len(_VOWELS), size=stops)]) * size
    at = t / _LOOP_S * stops
    first = at.astype(int)
    u = np.clip((at - first - 0.6) / 0.4, 0.0, 1.0)[:, None]
    formants = targets[first % stops] * (1.0 - u) + targets[(first + 1) % stops] * u
    out = np.zeros(n)
    for k in range(1, min(40, int(5000.0 / pitch))):
        f = k * pitch
        amplitude = sum(g / (1.0 + ((f - formants[:, i]) / w) ** 2) for i, (g, w) in enumerate(_PEAKS))
        out += (amplitude + 0.02) / np.sqrt(k) * np.sin(k * phase)
    return np.asarray(out / np.sqrt(np.mean(out**2)), np.float32)


def clap() -> F32:
    """(n,) samples of a clap: a burst of 10 to 20 ms."""
    n = int(_CLAP_S * RATE)
    t = np.arange(n) / RATE
    noise = np.random.default_rng(7).standard_normal(n)
    body = np.sin(2 * np.pi * 1150.0 * t) + 0.6 * np.sin(2 * np.pi * 2300.0 * t + 1.0)
    out = (0.7 * noise + body) * np.exp(-t / 0.006)
    return np.asarray(0.8 * out / np.max(np.abs(out)), np.float32)


class SimulatedVoice:
    """The sound at a participant's microphone, block after block."""

    def __init__(self, loudness: Loudness, claps: Claps, seed: int, sentences: Sentences | None = None) -> None:
        """sentences: spoken instead of babble."""
        self._loudness, self._claps, self._sentences = loudness, claps, sentences
        self._babble = babble(seed)
        self._clap = clap()
        rng = np.random.default_rng((seed, 1))
        self._noise = np.asarray(_NOISE * rng.standard_normal(RATE), np.float32)

    def block(self, number: int) -> F32:
        """(BLOCK,) samples of the block with this number, -1 to 1."""
        begin = number * BLOCK
        start_s, end_s = begin / RATE, (begin + BLOCK) / RATE
        out = self._noise[np.arange(begin, begin + BLOCK) % len(self._noise)]
        a, b = self._loudness(start_s), self._loudness(end_s)
        if self._sentences is not None:
            out += self._sentences.between(begin, begin + BLOCK)
        elif a > 0.0 or b > 0.0:
            out += (
                np.linspace(_LOUD * a, _LOUD * b, BLOCK, dtype=np.float32)
                * self._babble[np.arange(begin, begin + BLOCK) % len(self._babble)]
            )
        for met_s in self._claps(start_s - _CLAP_S, end_s):
            at = round(met_s * RATE) - begin
            low, high = max(0, at), min(BLOCK, at + len(self._clap))
            if low < high:
                out[low:high] += self._clap[low - at : high - at]
        return np.clip(out, -1.0, 1.0)


class SimulatedMicrophone:
    """A named pipe at `path` while it is plugged in.

    Faults: stall (no samples), unplug (the pipe is gone), saturation (over-driven), garbage (noise), black (silence).
    """

    def __init__(self, name: str, voice: SimulatedVoice, path: Path, faults: Iterable[Fault] = (), *, seed: int = 0) -> None:
        self.name = name
        self._voice, self._path = voice, path
        self._rng = np.random.default_rng(seed)
        self._faults = DeviceFaults(faults, name, self._rng)
        self._file: int | None = None

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults; none: no faults."""
        self._faults.replace(faults)

    def put(self, number: int) -> None:
        """Write the block with this number, at its end."""
        t_s = (number + 1) * BLOCK / RATE
        if self._faults.active("unplug", t_s):
            self.unplug()
            return
        if self._file is None:
            self._plug()
        if self._faults.active("stall", t_s):
            return
        sound = self._voice.block(number)
        if self._faults.active("black", t_s):
            sound = np.zeros_like(sound)
        if self._faults.active("saturation", t_s):
            sound = np.clip(30.0 * sound, -1.0, 1.0)
        if self._faults.active("garbage", t_s):
            sound = self._rng.uniform(-1.0, 1.0, BLOCK).astype(np.float32)
        assert self._file is not None
        with contextlib.suppress(BlockingIOError):
            os.write(self._file, np.rint(sound * 32767.0).astype("<i2").tobytes())

    def unplug(self) -> None:
        if self._file is not None:
            self._path.unlink(missing_ok=True)
            os.close(self._file)
            self._file = None

    def _plug(self) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._path.unlink(missing_ok=True)
        os.mkfifo(self._path)
        # Open for reading and writing, so that it neither waits for a reader nor breaks without one.
        self._file = os.open(self._path, os.O_RDWR | os.O_NONBLOCK)
        if hasattr(fcntl, "F_SETPIPE_SZ"):
            fcntl.fcntl(self._file, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)


async def run_microphones(microphones: Sequence[SimulatedMicrophone], clock: Clock, start_ns: int) -> None:
    """Run all until cancelled; block 0 begins at `start_ns`."""
    number = 0
    try:
        while microphones:
            over_ns = start_ns + (number + 1) * _BLOCK_NS
            await clock.sleep_until_ns(over_ns)
            if clock.now_ns() - over_ns > _LATE_NS:
                number = (clock.now_ns() - start_ns) // _BLOCK_NS - 1
            for microphone in microphones:
                microphone.put(number)
            number += 1
    finally:
        for microphone in microphones:
            microphone.unplug()
