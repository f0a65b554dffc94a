"""Loudspeakers: a sound card, a file, none."""

from __future__ import annotations

import logging
import threading
import wave
from collections import deque
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from vistel.arrays import F32
from vistel.audio.capture import SoundDeviceError
from vistel.audio.cards import Card, CardOpener, find_card, sound_cards
from vistel.audio.device_clock import DeviceClock
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.wire.clock import Clock

log = logging.getLogger("vistel.audio")

_AHEAD_BLOCKS = 3
"""Blocks queued for the sound card: the loop may be late by so much."""
_BEHIND_NS = 1_000_000_000
_RETRY_NS = 3_000_000_000
_REOPEN_NS = 200_000_000
"""Pause after it was lost: perhaps it was closed only for a search of sound cards."""


class Output(Protocol):
    """An open loudspeaker."""

    about: str
    latency_ns: int
    """From `put` to playback, about."""

    def due(self, now_ns: int) -> float | None:
        """When the next block will be played [ns], if it is to be put now; else None. Raises SoundDeviceError if the device is
        gone."""
        ...

    def put(self, block: F32 | None) -> None:
        """(FRAME, 2); None: silence."""
        ...

    def close(self) -> None: ...


class PacedOutput:
    """No loudspeaker: blocks are due in real time, and dropped."""

    about = "none"
    latency_ns = 0

    def __init__(self) -> None:
        self._next_ns: int | None = None

    def due(self, now_ns: int) -> float | None:
        if self._next_ns is None or now_ns - self._next_ns > _BEHIND_NS:
            self._next_ns = now_ns // FRAME_NS * FRAME_NS
        return float(self._next_ns) if self._next_ns <= now_ns else None

    def put(self, block: F32 | None) -> None:
        assert self._next_ns is not None
        self._next_ns += FRAME_NS

    def close(self) -> None:
        pass


class WavOutput(PacedOutput):
    """A WAV file, 16 bit, stereo."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.about = str(path)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = wave.open(str(path), "wb")  # noqa: SIM115  closed with the output
        except OSError as e:
            raise SoundDeviceError(f"{path}: cannot be written: {e.strerror}") from e
        self._file.setnchannels(2)
        self._file.setsampwidth(2)
        self._file.setframerate(RATE)

    def put(self, block: F32 | None) -> None:
        super().put(block)
        sound = np.zeros((FRAME, 2), "<i2") if block is None else np.rint(block * 32767.0).astype("<i2")
        try:
            self._file.writeframesraw(sound.tobytes())
        except OSError as e:
            raise SoundDeviceError(f"{self.about}: cannot be written: {e.strerror}") from e

    def close(self) -> None:
        try:
            self._file.close()
        except OSError as e:
            log.error("event=sound_file_not_closed path=%s reason=%r", self.about, str(e))


class CardOutput(Card):
    """A sound card at 48 kHz, fed from PortAudio's thread. Its drift is measured; the jitter buffers follow it."""

    def __init__(self, name: str, clock: Clock) -> None:
        super().__init__("loudspeaker")
        self._conference = clock
        self._clock = DeviceClock(RATE)
        self._queue: deque[F32] = deque()
        self._lock = threading.Lock()
        self._played = 0
        self.missed = 0
        self.open_with(lambda: self._open(name), clock.now_ns())

    def _open(self, name: str) -> None:
        portaudio = sound_cards()
        device = find_card(name, "output")
        try:
            self._stream = portaudio.OutputStream(
                device=device, channels=2, samplerate=RATE, blocksize=FRAME, dtype="float32", latency="low", callback=self._fill
            )
            self.about = str(portaudio.query_devices(device, "output")["name"])
            self._device_ns = round(float(self._stream.latency) * 1e9)
            self._stream.start()
        except Exception as e:  # PortAudio's errors have no common ancestor over its versions
            raise SoundDeviceError(f"{name}: the loudspeaker cannot be opened: {e}") from e
        self.latency_ns = self._device_ns + _AHEAD_BLOCKS * FRAME_NS

    def _fill(self, out: F32, frames: int, time: Any, status: Any) -> None:
        with self._lock:
            block = self._queue.popleft() if self._queue else None
            if block is None:
                self.missed += 1
            self._played += frames
            ahead = float(time.outputBufferDacTime) - float(time.currentTime)
            ahead_ns = round(ahead * 1e9) if 0.0 < ahead < 1.0 else self._device_ns
            self._clock.observe(self._played - frames, self._conference.now_ns() + ahead_ns)
        out[:] = 0.0 if block is None or len(block) != frames else block

    def due(self, now_ns: int) -> float | None:
        self.check()
        with self._lock:
            if self._played == 0 or len(self._queue) >= _AHEAD_BLOCKS:
                return None
            return self._clock.time_ns(self._played + len(self._queue) * FRAME)

    def put(self, block: F32 | None) -> None:
        with self._lock:
            self._queue.append(np.zeros((FRAME, 2), np.float32) if block is None else block)


class Loudspeaker:
    """The configured output; while it is missing, blocks are dropped in real time, and it is tried again."""

    def __init__(self, wanted: str, clock: Clock) -> None:
        self.detail = ""
        self._wanted, self._clock = wanted, clock
        self._output: Output = PacedOutput()
        self._retry_ns = 0 if wanted != "none" else None
        self._opener = CardOpener(lambda: CardOutput(wanted, clock))

    @property
    def about(self) -> str:
        """What plays the sound, for people."""
        return self._output.about

    @property
    def latency_ns(self) -> int:
        """As Output."""
        return self._output.latency_ns

    def due(self, now_ns: int) -> float | None:
        """As Output."""
        if self._retry_ns is not None and now_ns >= self._retry_ns:
            self._open(now_ns)
        try:
            return self._output.due(now_ns)
        except SoundDeviceError as e:
            self._lost(str(e), now_ns)
            return self._output.due(now_ns)

    def put(self, block: F32 | None) -> None:
        """As Output."""
        try:
            self._output.put(block)
        except SoundDeviceError as e:
            self._lost(str(e), self._clock.now_ns())

    def close(self) -> None:
        """As Output."""
        self._opener.close()
        self._output.close()

    def _open(self, now_ns: int) -> None:
        try:
            found = WavOutput(Path(self._wanted)) if self._wanted.lower().endswith(".wav") else self._opener.poll()
        except SoundDeviceError as e:
            if str(e) != self.detail:
                log.warning("event=no_loudspeaker reason=%r retry_s=%.0f", str(e), _RETRY_NS * 1e-9)
            self.detail, self._retry_ns = str(e), now_ns + _RETRY_NS
            return
        if found is None:
            return
        self._output = found
        self.detail, self._retry_ns = "", None
        log.info("event=loudspeaker output=%r latency_ms=%.0f", self.about, self.latency_ns * 1e-6)

    def _lost(self, reason: str, now_ns: int) -> None:
        log.warning("event=loudspeaker_lost reason=%r", reason)
        self._output.close()
        self._output = PacedOutput()
        self.detail, self._retry_ns = reason, now_ns + _REOPEN_NS
