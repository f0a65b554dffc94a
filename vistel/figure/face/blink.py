"""Blinks of people whose lids nobody sees. Everybody blinks at moments of their own, the same at all sites and in all replays."""

import hashlib
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import Posture

_EVERY_S = 3.6
"""Once in so long; people who talk blink fifteen to twenty times a minute (Bentivoglio et al. 1997)."""
_SHUT_S = 0.075
"""So long after it begins the lids are shut."""
_RISES_S = 0.105
"""So long after it begins they rise, more slowly than they fell."""
_LASTS_S = 0.255
"""A blink."""


def blinking(posture: Posture, name: str, t_ns: int) -> Posture:
    """The posture of `name` with lids as they are at `t_ns`, where it says nothing of them."""
    return posture if posture.lids is not None else replace(posture, lids=lids_at(name, t_ns))


def lids_at(name: str, t_ns: int) -> F64:
    """(2,) opening of both eyes, 1 open, 0 shut."""
    turn, within_ns = divmod(t_ns, round(_EVERY_S * 1e9))
    drawn = int.from_bytes(hashlib.blake2b(f"{name} {turn}".encode(), digest_size=4).digest()) / 2**32
    begins_s = (_EVERY_S - _LASTS_S) * drawn
    since_s = within_ns * 1e-9 - begins_s
    moments = (0.0, _SHUT_S, _RISES_S, _LASTS_S)
    return np.full(2, np.interp(since_s, moments, (1.0, 0.0, 0.0, 1.0)))
