"""From a microphone's samples, on its own clock and at its own rate, to frames of 20 ms of conference time."""

from __future__ import annotations

import logging
import math
from typing import Protocol

import numpy as np

from vistel.arrays import F32
from vistel.audio.device_clock import DeviceClock
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.audio.resample import at_positions, reach
from vistel.audio.tape import Tape

log = logging.getLogger("vistel.audio")

_RETRY_NS = 1_000_000_000
_SOON_NS = 200_000_000
"""After it was lost: others may only have had all cards looked for."""
_SILENT_NS = 1_000_000_000
_CLOSE_S = 0.0005
"""Samples of a device without drift whose time is off by less are taken as they came, not resampled [s]."""
_JUMP_S = 0.06
"""A larger error means that samples are missing: it is made good at once [s]."""
_STEER = 0.002
"""Share by which samples are taken faster or slower than they come while the error is small."""
_STEER_MORE = 0.01
"""The same share while the error is above `_FAR_S`."""
_FAR_S = 0.005
_SLIP_S = 0.002
"""A larger error is made good at once where nobody speaks [s]."""
_QUIET = 0.003
"""Root mean square below which nobody speaks; full scale is 1."""
_MOST_FRAMES = 25


class InputError(Exception):
    """A microphone or a loudspeaker that cannot be used now; one line for a person."""


class Input(Protocol):
    """An open microphone."""

    about: str
    rate_hz: float

    def take(self) -> list[tuple[F32, int]]:
        """What has come since the last call: samples (n,), and by when they had been captured. Raises InputError when
        the device is gone."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class Opener(Protocol):
    """How a microphone is opened."""

    def poll(self) -> Input | None:
        """The open microphone; None while that takes its time. Raises InputError. Never waits."""
        ...

    def close(self) -> None:
        """Let go of what is still being opened."""
        ...


class Capture:
    """Opens the microphone, opens it again when it goes, and cuts what it hears into frames."""

    def __init__(self, name: str, opener: Opener) -> None:
        self.detail = "not opened yet"
        self.about = ""
        self._name, self._opener = name, opener
        self._input: Input | None = None
        self._retry_ns = 0
        self._heard_ns = 0
        self._tape = Tape()
        self._clock = DeviceClock(RATE)
        self._position: float | None = None
        self._next_ns = 0

    @property
    def is_open(self) -> bool:
        """Whether sound comes."""
        return self._input is not None and not self.detail

    @property
    def rate_hz(self) -> float:
        """Of the device, as measured."""
        return self._clock.rate_hz * (1.0 + self._clock.drift_ppm * 1e-6)

    def frames(self, now_ns: int) -> list[tuple[int, F32]]:
        """New frames: when their first sample was captured, and (FRAME,) samples."""
        if self._input is None and now_ns >= self._retry_ns:
            self._open(now_ns)
        if self._input is None:
            return []
        try:
            parts = self._input.take()
        except InputError as e:
            self._lose(str(e), now_ns)
            return []
        for samples, seen_ns in parts:
            self._heard(samples, seen_ns)
        if parts:
            self._heard_ns, self.detail = now_ns, ""
        elif now_ns - self._heard_ns > _SILENT_NS and not self.detail:
            self.detail = f"{self.about}: no samples come"
            self._forget()
            log.warning("event=microphone_silent participant=%s source=%r", self._name, self.about)
        return self._cut()

    def close(self) -> None:
        """Let the microphone go."""
        self._opener.close()
        if self._input is not None:
            self._input.close()
            self._input = None

    def _open(self, now_ns: int) -> None:
        try:
            self._input = self._opener.poll()
        except InputError as e:
            if str(e) != self.detail:
                log.warning("event=no_microphone participant=%s reason=%r retry_s=%.0f", self._name, str(e), _RETRY_NS * 1e-9)
            self.detail, self._retry_ns = str(e), now_ns + _RETRY_NS
            return
        if self._input is None:
            return
        self.about, self.detail, self._heard_ns = self._input.about, "", now_ns
        self._forget()
        log.info("event=microphone participant=%s source=%r rate_hz=%.0f", self._name, self.about, self._input.rate_hz)

    def _forget(self) -> None:
        assert self._input is not None
        self._clock = DeviceClock(self._input.rate_hz)
        rate = self._input.rate_hz
        self._tape = Tape(int(2.0 * rate), int(0.5 * rate))
        self._tape.begin(0, reach(rate / RATE) + 1)
        self._position = None

    def _lose(self, reason: str, now_ns: int) -> None:
        log.warning("event=microphone_lost participant=%s reason=%r", self._name, reason)
        self.close()
        self.detail, self._retry_ns = reason, now_ns + _SOON_NS

    def _heard(self, samples: F32, seen_ns: int) -> None:
        good = samples if np.isfinite(np.dot(samples, samples)) else np.nan_to_num(samples, nan=0.0, posinf=1.0, neginf=-1.0)
        for begin in range(0, len(good), 8192):
            self._tape.append(good[begin : begin + 8192])
        self._clock.observe(self._tape.end, seen_ns)
        if self._position is None:
            first_ns = self._clock.time_ns(self._tape.end - len(good))
            self._next_ns = -(-int(first_ns) // FRAME_NS) * FRAME_NS
            self._position = self._clock.count_at(self._next_ns)

    def _cut(self) -> list[tuple[int, F32]]:
        out: list[tuple[int, F32]] = []
        if self._clock.doubtful:
            return out  # better late than stamped wrongly: receivers would wait for all that comes after
        while self._position is not None and len(out) < _MOST_FRAMES:
            pcm = self._one()
            if pcm is None:
                break
            out.append((self._next_ns, pcm))
            self._next_ns += FRAME_NS
        return out

    def _quiet(self, step: float, error: float) -> bool:
        """Whether nothing is said in this frame, where it would be taken from and where it belongs."""
        assert self._position is not None
        begin = max(self._tape.start, int(self._position + min(0.0, error)))
        end = int(self._position + max(0.0, error) + step * FRAME) + 1
        if end > self._tape.end:
            return False
        part = self._tape.between(begin, end)
        return float(np.dot(part, part)) < _QUIET**2 * len(part)

    def _one(self) -> F32 | None:
        """The frame at `_next_ns`, as soon as all of its samples are there."""
        assert self._position is not None
        rate = self._clock.rate_hz
        step = rate / RATE
        error = self._clock.count_at(self._next_ns) - self._position
        if abs(error) > _JUMP_S * rate:
            log.info("event=microphone_jump participant=%s by_ms=%.0f", self._name, error / rate * 1e3)
            if error < 0.0:
                # Samples are missing. Nothing is sent twice: the time that they would have filled stays empty.
                missing = math.ceil(-error / rate * 1e9 / FRAME_NS)
                self._next_ns += missing * FRAME_NS
                error = self._clock.count_at(self._next_ns) - self._position
            self._position += error
            if self._position < self._tape.start + reach(step):
                self._position = None
                return None
            error = 0.0
        if abs(error) > _SLIP_S * rate and self._position + error > self._tape.start + reach(step) and self._quiet(step, error):
            self._position += error
            error = 0.0
        if step == 1.0 and abs(error) < _CLOSE_S * rate:
            at = round(self._position)
            if at + FRAME > self._tape.end:
                return None
            self._position = float(at + FRAME)
            return self._tape.between(at, at + FRAME).copy()
        steer = _STEER if abs(error) < _FAR_S * rate else _STEER_MORE
        step *= 1.0 + min(steer, max(-steer, error / (8 * FRAME * step)))
        half = reach(step)
        last = self._position + step * FRAME
        begin, end = int(self._position) - half, int(last) + half + 2
        if end > self._tape.end:
            return None
        begin = max(begin, self._tape.start)
        try:
            out = at_positions(self._tape.between(begin, end), self._position - begin, step, FRAME)
        except (ValueError, IndexError):
            self._position = None
            return None
        self._position = last
        return out
