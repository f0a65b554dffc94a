"""The samples of a microphone, on its own clock and at its own rate, to frames of 20 ms of conference time."""

import logging
import math
from typing import Protocol

import numpy as np

from vistel.arrays import F32
from vistel.audio.device_clock import DeviceClock
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.audio.resample import reach, sinc_resample
from vistel.audio.sample_buffer import SampleBuffer

log = logging.getLogger("vistel.audio")

_RETRY_NS = 1_000_000_000
_REOPEN_NS = 200_000_000
"""Pause after it was lost: perhaps it was closed only for a search of sound cards."""
_SILENT_NS = 1_000_000_000
_TOLERANCE_S = 0.0005
"""Below this error, samples of a device at 48 kHz are not resampled [s]."""
_JUMP_S = 0.06
"""A larger error means that samples are missing: it is corrected at once [s]."""
_SPEED_CHANGE = 0.002
"""Largest change of speed while the error is small."""
_FASTER_CHANGE = 0.01
"""Largest change of speed while the error is above `_FAR_S`."""
_FAR_S = 0.005
_SLIP_S = 0.002
"""In silence a larger error is corrected at once [s]."""
_SILENT = 0.003
"""Root mean square below which there is silence; full scale is 1."""
_MOST_FRAMES = 25


class SoundDeviceError(Exception):
    """A microphone or loudspeaker cannot be used now; one line for a person."""


class Input(Protocol):
    """An open microphone."""

    about: str
    rate_hz: float

    def take(self) -> list[tuple[F32, int]]:
        """New blocks: samples (n,), and the time by which they had been captured [ns]. Raises SoundDeviceError if the device
        is gone."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class Opener(Protocol):
    """Opens a microphone."""

    def poll(self) -> Input | None:
        """The open microphone; None while it is being opened. Raises SoundDeviceError. Never waits."""
        ...

    def close(self) -> None:
        """Close what is still being opened."""
        ...


class MicrophoneCapture:
    """Opens a microphone, reopens it when it was lost, and cuts its samples into frames."""

    def __init__(self, name: str, opener: Opener) -> None:
        self.detail = "not opened yet"
        self.about = ""
        self._name, self._opener = name, opener
        self._input: Input | None = None
        self._retry_ns = 0
        self._arrived_ns = 0
        self._buffer = SampleBuffer()
        self._clock = DeviceClock(RATE)
        self._position: float | None = None
        self._next_ns = 0

    @property
    def is_open(self) -> bool:
        """Whether samples arrive."""
        return self._input is not None and not self.detail

    @property
    def rate_hz(self) -> float:
        """Measured sample rate of the device."""
        return self._clock.rate_hz * (1.0 + self._clock.drift_ppm * 1e-6)

    def frames(self, now_ns: int) -> list[tuple[int, F32]]:
        """New frames: capture time of the first sample [ns], and (FRAME,) samples."""
        if self._input is None and now_ns >= self._retry_ns:
            self._open(now_ns)
        if self._input is None:
            return []
        try:
            blocks = self._input.take()
        except SoundDeviceError as e:
            self._lost(str(e), now_ns)
            return []
        for samples, seen_ns in blocks:
            self._append(samples, seen_ns)
        if blocks:
            self._arrived_ns, self.detail = now_ns, ""
        elif now_ns - self._arrived_ns > _SILENT_NS and not self.detail:
            self.detail = f"{self.about}: no samples come"
            self._restart()
            log.warning("event=microphone_silent participant=%s source=%r", self._name, self.about)
        return self._cut_frames()

    def close(self) -> None:
        """Close the microphone."""
        self._opener.close()
        if self._input is not None:
            self._input.close()
            self._input = None

    def _open(self, now_ns: int) -> None:
        try:
            self._input = self._opener.poll()
        except SoundDeviceError as e:
            if str(e) != self.detail:
                log.warning("event=no_microphone participant=%s reason=%r retry_s=%.0f", self._name, str(e), _RETRY_NS * 1e-9)
            self.detail, self._retry_ns = str(e), now_ns + _RETRY_NS
            return
        if self._input is None:
            return
        self.about, self.detail, self._arrived_ns = self._input.about, "", now_ns
        self._restart()
        log.info("event=microphone participant=%s source=%r rate_hz=%.0f", self._name, self.about, self._input.rate_hz)

    def _restart(self) -> None:
        assert self._input is not None
        self._clock = DeviceClock(self._input.rate_hz)
        rate = self._input.rate_hz
        self._buffer = SampleBuffer(int(2.0 * rate), int(0.5 * rate))
        self._buffer.begin(0, reach(rate / RATE) + 1)
        self._position = None

    def _lost(self, reason: str, now_ns: int) -> None:
        log.warning("event=microphone_lost participant=%s reason=%r", self._name, reason)
        self.close()
        self.detail, self._retry_ns = reason, now_ns + _REOPEN_NS

    def _append(self, samples: F32, seen_ns: int) -> None:
        good = samples if np.isfinite(np.dot(samples, samples)) else np.nan_to_num(samples, nan=0.0, posinf=1.0, neginf=-1.0)
        for begin in range(0, len(good), 8192):
            self._buffer.append(good[begin : begin + 8192])
        self._clock.observe(self._buffer.end, seen_ns)
        if self._position is None:
            first_ns = self._clock.time_ns(self._buffer.end - len(good))
            self._next_ns = -(-int(first_ns) // FRAME_NS) * FRAME_NS
            self._position = self._clock.count_at(self._next_ns)

    def _cut_frames(self) -> list[tuple[int, F32]]:
        out: list[tuple[int, F32]] = []
        if self._clock.uncertain:
            return out  # better late than at a wrong time: receivers would delay all that follows
        while self._position is not None and len(out) < _MOST_FRAMES:
            pcm = self._next_frame()
            if pcm is None:
                break
            out.append((self._next_ns, pcm))
            self._next_ns += FRAME_NS
        return out

    def _is_silent(self, step: float, error: float) -> bool:
        """Whether this frame is silent, both at the position and at the right one."""
        assert self._position is not None
        begin = max(self._buffer.start, int(self._position + min(0.0, error)))
        end = int(self._position + max(0.0, error) + step * FRAME) + 1
        if end > self._buffer.end:
            return False
        part = self._buffer.between(begin, end)
        return float(np.dot(part, part)) < _SILENT**2 * len(part)

    def _next_frame(self) -> F32 | None:
        """The frame at `_next_ns`; None until all of its samples have arrived."""
        assert self._position is not None
        rate = self._clock.rate_hz
        step = rate / RATE
        error = self._clock.count_at(self._next_ns) - self._position
        if abs(error) > _JUMP_S * rate:
            log.info("event=microphone_jump participant=%s by_ms=%.0f", self._name, error / rate * 1e3)
            if error < 0.0:
                # Samples are missing: their time stays empty.
                missing = math.ceil(-error / rate * 1e9 / FRAME_NS)
                self._next_ns += missing * FRAME_NS
                error = self._clock.count_at(self._next_ns) - self._position
            self._position += error
            if self._position < self._buffer.start + reach(step):
                self._position = None
                return None
            error = 0.0
        if (
            abs(error) > _SLIP_S * rate
            and self._position + error > self._buffer.start + reach(step)
            and self._is_silent(step, error)
        ):
            self._position += error
            error = 0.0
        if step == 1.0 and abs(error) < _TOLERANCE_S * rate:
            at = round(self._position)
            if at + FRAME > self._buffer.end:
                return None
            self._position = float(at + FRAME)
            return self._buffer.between(at, at + FRAME).copy()
        most = _SPEED_CHANGE if abs(error) < _FAR_S * rate else _FASTER_CHANGE
        step *= 1.0 + min(most, max(-most, error / (8 * FRAME * step)))
        half = reach(step)
        last = self._position + step * FRAME
        begin, end = int(self._position) - half, int(last) + half + 2
        if end > self._buffer.end:
            return None
        begin = max(begin, self._buffer.start)
        try:
            out = sinc_resample(self._buffer.between(begin, end), self._position - begin, step, FRAME)
        except (ValueError, IndexError):
            self._position = None
            return None
        self._position = last
        return out
