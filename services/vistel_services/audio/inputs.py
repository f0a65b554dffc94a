"""Microphones: a sound card, a recording, a pipe."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import stat
import threading
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F32
from vistel.audio.capture import Input, SoundDeviceError
from vistel.audio.cards import Card, CardOpener, find_card, sound_cards
from vistel.audio.opus import RATE
from vistel.audio.recording import read_recording
from vistel.wire.clock import Clock

log = logging.getLogger("vistel.audio")

_PIPE_BYTES = 65536
_QUEUED_MOST = 200
"""Blocks of a pipe that are kept until taken."""


class InputOpener:
    """Opens a microphone: `source` as in the conference file."""

    def __init__(self, source: str, clock: Clock) -> None:
        self._source, self._clock = source, clock
        self._card = CardOpener(lambda: CardInput(source, clock))

    def poll(self) -> Input | None:
        """The open microphone; None while its card is being opened. Raises SoundDeviceError."""
        path = Path(self._source)
        try:
            pipe = stat.S_ISFIFO(path.stat().st_mode)
        except (OSError, ValueError):
            pipe = False
        if pipe:
            return PipeInput(path, self._clock)
        if path.is_file():
            return RecordingInput(path, self._clock)
        if path.is_absolute():
            raise SoundDeviceError(f"{self._source}: does not exist (yet)")
        return self._card.poll()

    def close(self) -> None:
        """A card that is still being opened is closed."""
        self._card.close()


class PipeInput:
    """16-bit samples, mono, 48 kHz, from a named pipe. Their capture time is that of their arrival.

    With an event loop they are read as soon as they arrive: `take`, every 20 ms, would find them up to 20 ms late.
    """

    def __init__(self, path: Path, clock: Clock) -> None:
        self.about, self.rate_hz = f"pipe {path.name}", float(RATE)
        self._path, self._clock = path, clock
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as e:
            raise SoundDeviceError(f"{path}: cannot be opened: {e.strerror}") from e
        self._odd = b""
        self._blocks: list[tuple[F32, int]] = []
        try:
            self._loop: asyncio.AbstractEventLoop | None = asyncio.get_running_loop()
        except RuntimeError:
            self._loop = None
        self._awaited = False
        if self._loop is not None:  # nobody knows when what is in the pipe was captured
            with contextlib.suppress(OSError):
                os.read(self._file, _PIPE_BYTES)
            self._await(True)

    def take(self) -> list[tuple[F32, int]]:
        try:
            data = self._read()
        except BlockingIOError:
            self._await(True)
        except OSError as e:
            raise SoundDeviceError(f"{self._path}: {e.strerror}") from e
        else:
            if data:
                self._await(True)
            else:
                self._check_there()
        out, self._blocks = self._blocks, []
        return out

    def close(self) -> None:
        self._await(False)
        os.close(self._file)

    def _read(self) -> bytes:
        data = os.read(self._file, _PIPE_BYTES)
        if data:
            whole = self._odd + data
            self._odd = whole[len(whole) // 2 * 2 :]
            samples = np.frombuffer(whole, "<i2", len(whole) // 2).astype(np.float32) / 32768.0
            self._blocks.append((samples, self._clock.now_ns()))
            del self._blocks[:-_QUEUED_MOST]
        return data

    def _readable(self) -> None:
        try:
            data = self._read()
        except OSError:  # `take` raises it
            data = b""
        if not data:
            self._await(False)  # no writer: the pipe would stay readable for ever

    def _await(self, awaited: bool) -> None:
        if self._loop is not None and awaited != self._awaited:
            self._awaited = awaited
            if awaited:
                self._loop.add_reader(self._file, self._readable)
            else:
                self._loop.remove_reader(self._file)

    def _check_there(self) -> None:
        """Raises SoundDeviceError if the pipe is gone or was made anew under the same name."""
        try:
            same = os.fstat(self._file).st_ino == self._path.stat().st_ino
        except OSError:
            same = False
        if not same:
            raise SoundDeviceError(f"{self._path}: the pipe is gone")


class RecordingInput:
    """A sound file, in real time, again and again."""

    def __init__(self, path: Path, clock: Clock) -> None:
        self._samples, self.rate_hz = read_recording(path)
        self.about = f"recording {path.name}"
        self._clock = clock
        self._start_ns = clock.now_ns()
        self._count = 0

    def take(self) -> list[tuple[F32, int]]:
        now_ns = self._clock.now_ns()
        due = int((now_ns - self._start_ns) * 1e-9 * self.rate_hz)
        if due <= self._count:
            return []
        begin = max(self._count, due - int(self.rate_hz))  # at most one second after a long pause
        at = np.arange(begin, due) % len(self._samples)
        seen_ns = self._start_ns + round(due / self.rate_hz * 1e9)
        self._count = due
        return [(self._samples[at], seen_ns)]

    def close(self) -> None:
        pass


class CardInput(Card):
    """A sound card, read in PortAudio's thread; at 48 kHz or, if it refuses that, at its own rate.

    keep_s: how much is kept until taken. Blocks may have any length; some drivers hand over a second at once.
    """

    def __init__(self, name: str, clock: Clock, keep_s: float = 2.0) -> None:
        super().__init__("microphone")
        self._clock, self._keep_s = clock, keep_s
        self._blocks: deque[tuple[F32, int]] = deque()
        self._waiting = 0
        self._lock = threading.Lock()
        self.open_with(lambda: self._open(name), clock.now_ns())

    def _open(self, name: str) -> None:
        portaudio = sound_cards()
        device = find_card(name, "input")
        try:
            known = portaudio.query_devices(device, "input")
            rate = float(RATE)
            try:
                portaudio.check_input_settings(device=device, channels=1, samplerate=rate, dtype="float32")
            except Exception:
                rate = float(known["default_samplerate"])
            self.about, self.rate_hz = str(known["name"]), rate
            self._stream = portaudio.InputStream(
                device=device, channels=1, samplerate=rate, dtype="float32", latency="low", callback=self._receive
            )
            self._latency_ns = round(float(self._stream.latency) * 1e9)
            self._stream.start()
        except Exception as e:
            raise SoundDeviceError(f"{name}: the microphone cannot be opened: {e}") from e

    def _receive(self, data: F32, frames: int, time: Any, status: Any) -> None:
        captured = float(time.currentTime) - float(time.inputBufferAdcTime)
        # Some drivers give no times; the stream's latency is the best estimate then.
        age_ns = round(captured * 1e9) if 0.0 < captured < 1.0 else self._latency_ns
        end_ns = self._clock.now_ns() - age_ns + round(frames / self.rate_hz * 1e9)
        with self._lock:
            self._blocks.append((data[:, 0].copy(), end_ns))
            self._waiting += frames
            while self._waiting > self._keep_s * self.rate_hz and len(self._blocks) > 1:
                self._waiting -= len(self._blocks.popleft()[0])

    def take(self) -> list[tuple[F32, int]]:
        self.check()
        with self._lock:
            out = list(self._blocks)
            self._blocks.clear()
            self._waiting = 0
        return out
