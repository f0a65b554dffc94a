"""Head-related transfer functions of a model head, for headphones: a rigid sphere with ears a little behind its middle, and
the echoes of the outer ears (Brown and Duda 1998, "A structural model for binaural sound synthesis", table II)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from vistel.arrays import C64, C128, F32, F64
from vistel.audio.opus import FRAME, RATE
from vistel.audio.spatial import HEAD_RADIUS, SOUND_SPEED, SourceDirection
from vistel.audio.sphere import at_surface

TAPS = 192
"""Samples of a filter: 4 ms."""
LEAD = 20
"""Samples by which all filters delay, so that the nearer ear's filter is causal: 0.4 ms."""
SIZE = TAPS + FRAME
"""Samples of a filtered block."""
_GRID = 512
_FREQUENCY: F64 = np.asarray(np.fft.rfftfreq(_GRID, 1.0 / RATE), np.float64)
EAR_ANGLE = np.radians(100.0)
"""From straight ahead to each ear."""
_SOURCE_M = 1.2
"""Distance of the source: across a table [m]."""
_STEP_DEG = 3.0
"""Directions are rounded to it; people distinguish one to four degrees."""
_ECHO_GAIN = (0.5, -1.0, 0.5, -0.25, 0.25)
_ECHO_SPREAD = (1.0, 5.0, 5.0, 5.0, 5.0)
_ECHO_OFFSET = (2.0, 4.0, 7.0, 11.0, 13.0)
_ECHO_BEND = (1.0, 0.5, 0.5, 0.5, 0.5)
_ECHO_RATE = 44_100.0
"""The table gives delays in samples at this rate."""
_DULL_HZ = 2500.0
"""Above it, a talker who faces away is attenuated."""
_AWAY_LOSS = 0.35


def response(azimuth: float, elevation: float, *, pinna: bool = True) -> C128:
    """(2, _GRID / 2 + 1) responses of left and right ear at 0 to 24 kHz, to a source at `azimuth` to the left of straight ahead
    and `elevation` above the ears' level [rad]; delays are relative to the head's centre."""
    to = np.array([np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)])
    out = np.empty((2, len(_FREQUENCY)), np.complex128)
    for ear, side in enumerate((1.0, -1.0)):
        axis = np.array([side * np.sin(EAR_ANGLE), 0.0, np.cos(EAR_ANGLE)])
        angle = np.degrees(np.arccos(np.clip(axis @ to, -1.0, 1.0)))
        out[ear] = _sphere()[round(float(angle))]
        if pinna:
            out[ear] *= _echoes(side * azimuth, elevation)
    return out


@lru_cache(maxsize=1)
def _sphere() -> C128:
    """(181, _GRID / 2 + 1) by degrees between source and ear; faded out below half the rate, where its phase would ring."""
    out = at_surface(_FREQUENCY, np.radians(np.arange(181.0)), HEAD_RADIUS, _SOURCE_M, SOUND_SPEED)
    return out * (0.5 + 0.5 * np.cos(np.pi * np.clip((_FREQUENCY - 16_000.0) / 8_000.0, 0.0, 1.0)))


def _echoes(azimuth: float, elevation: float) -> C128:
    """Response of an outer ear. azimuth: towards its own side [rad]."""
    out = np.ones(len(_FREQUENCY), np.complex128)
    for gain, spread, bend, offset in zip(_ECHO_GAIN, _ECHO_SPREAD, _ECHO_BEND, _ECHO_OFFSET, strict=True):
        late = spread * np.cos(azimuth / 2.0) * np.sin(bend * (np.pi / 2.0 - elevation)) + offset
        out += gain * np.exp(-2j * np.pi * _FREQUENCY * late / _ECHO_RATE)
    return out


@lru_cache(maxsize=512)
def impulse(azimuth_step: int, elevation_step: int) -> F32:
    """(2, TAPS) impulse response for a direction in steps of _STEP_DEG; read-only."""
    h = response(np.radians(azimuth_step * _STEP_DEG), np.radians(elevation_step * _STEP_DEG))
    lead = np.exp(-2j * np.pi * _FREQUENCY * LEAD / RATE)
    out = np.fft.irfft(h * lead, _GRID)[:, :TAPS]
    out[:, -32:] *= np.linspace(1.0, 0.0, 32)
    out.flags.writeable = False
    return out.astype(np.float32)


@lru_cache(maxsize=512)
def _spectrum(azimuth_step: int, elevation_step: int) -> C64:
    return np.fft.rfft(impulse(azimuth_step, elevation_step), SIZE).astype(np.complex64)


def filters(direction: SourceDirection | None) -> C64:
    """(2, SIZE / 2 + 1) spectra for left and right ear; None: no direction, the same delay."""
    if direction is None:
        flat = np.exp(-2j * np.pi * np.fft.rfftfreq(SIZE) * LEAD).astype(np.complex64)
        return np.stack((flat, flat))
    azimuth, elevation = np.degrees(direction.azimuth), np.degrees(direction.elevation)
    h = _spectrum(round(float(azimuth) / _STEP_DEG), round(float(elevation) / _STEP_DEG))
    frequency = np.fft.rfftfreq(SIZE, 1.0 / RATE)
    share = _AWAY_LOSS * direction.facing_away
    dull = direction.gain * (1.0 - share + share / (1.0 + (frequency / _DULL_HZ) ** 2))
    return np.asarray(h * dull.astype(np.float32), np.complex64)
