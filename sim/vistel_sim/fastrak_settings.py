"""The settings of a FASTRAK and its stations."""

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64


@dataclass
class Station:
    """Settings of one station."""

    enabled: bool = True
    items: tuple[int, ...] = (2, 4, 1)
    hemisphere: tuple[float, float, float] = (1.0, 0.0, 0.0)
    reference: tuple[float, float, float] = (0.0, 0.0, 0.0)
    boresight: F64 = field(default_factory=lambda: np.eye(3))
    origin: F64 = field(default_factory=lambda: np.zeros(3))
    alignment: F64 = field(default_factory=lambda: np.eye(3))
    mounting: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)
    increment: float = 0.0
    envelope: tuple[float, ...] | None = None
    angular_envelope: tuple[float, ...] | None = None
    last: F64 = field(default_factory=lambda: np.zeros(3))
    stylus_mode: int = 1


@dataclass
class Settings:
    """What `^K` saves and `^Y` restores."""

    stations: list[Station]
    binary: bool = False
    centimetres: bool = False
    continuous: bool = False
    compensation: bool = False
    sync: int = 0
    identification: str = "OutputCompensat CPG2030-003-10"
    filters: dict[str, str] = field(default_factory=lambda: {"x": "2", "v": "2"})


def copy_of(settings: Settings) -> Settings:
    """A deep copy."""
    return dataclasses.replace(
        settings, stations=[dataclasses.replace(s) for s in settings.stations], filters=dict(settings.filters)
    )
