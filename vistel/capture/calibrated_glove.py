"""A glove's calibration from hands that its user holds still (`DeviceKind.fit`)."""

import itertools
import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from vistel.conference.device_list import Device
from vistel.conference.devices import GloveConfig
from vistel.protocol import fivedt_calibration, glove_calibration
from vistel.protocol.glove_fit import HANDS, find_holds, fit_among
from vistel.protocol.glove_frames import highest_of

_STILL_BYTES = 4.0
"""By how many counts a sensor of one byte may wander while a hand is held still."""
_STILL_WORDS = 60.0
"""By how many counts a sensor of two bytes may wander while a hand is held still."""


@dataclass(frozen=True)
class CalibratedGlove:
    """save: writes the calibration to a file. notes: a line for each sensor that keeps a typical hand's values. unrest_deg: by how
    much the most restless joint strayed in each hand that was held still, root mean square [degrees]."""

    save: Callable[[Path], None]
    notes: tuple[str, ...]
    unrest_deg: dict[str, float]


def cyberglove(device: Device, times: Sequence[float], raw: Sequence[bytes]) -> CalibratedGlove:
    """Of a CyberGlove, from all four of `HANDS`. times: of each sample [s]. Raises GloveCalibrationError."""
    holds = find_holds(times, [tuple(r) for r in raw], _STILL_BYTES)
    found, four = fit_among(holds)
    unrest = {
        name: _unrest([found.calibration.angles(r) for r in raw[hold.begin : hold.end]])
        for (name, _), hold in zip(HANDS, four, strict=True)
    }
    return CalibratedGlove(partial(glove_calibration.save_calibration, found.calibration), found.notes, unrest)


def fivedt(device: Device, times: Sequence[float], raw: Sequence[bytes]) -> CalibratedGlove:
    """Of a 5DT glove, from the fist and the spread hand. times: of each sample [s]. Raises GloveCalibrationError."""
    keys = device.config_as(GloveConfig)
    highest = highest_of(keys.kind)
    bytewise = highest < 256
    samples = [tuple(r) if bytewise else struct.unpack(f">{len(r) // 2}H", r) for r in raw]
    holds = find_holds(times, samples, _STILL_BYTES if bytewise else _STILL_WORDS)
    # The open hand of these gloves is a spread one. A hand at rest may come first: a fist has the highest counts.
    fist, spread = max(itertools.pairwise(holds[1:-1]), key=lambda pair: sum(pair[0].counts) - sum(pair[1].counts))
    base = fivedt_calibration.default_calibration(highest)
    calibration, notes = fivedt_calibration.calibrate(spread.counts, fist.counts, base)
    unrest = {
        name: _unrest([calibration.angles(s, keys.sensors) for s in samples[hold.begin : hold.end]])
        for name, hold in (("fist", fist), ("spread", spread))
    }
    return CalibratedGlove(partial(fivedt_calibration.save_calibration, calibration), notes, unrest)


def _unrest(angles: Sequence[Sequence[float]]) -> float:
    return math.degrees(float(np.asarray(angles, np.float64).std(axis=0).max()))
