"""The newest snapshot on disk, so that a world that was killed goes on where it was."""

from __future__ import annotations

import logging
import os
from pathlib import Path

from vistel.space.room import Extra
from vistel.space.world import World

log = logging.getLogger("vistel.world")

OLDEST_NS = 600_000_000_000
"""A snapshot older than ten minutes belongs to another conference."""


def save(path: Path, data: bytes) -> bool:
    """Replace the file at once or not at all. A disk that refuses is told, and costs nothing but the snapshot."""
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(data)
        os.replace(part, path)
    except OSError as e:
        log.error("snapshot not written path=%s reason=%s", path, e.strerror)
        return False
    return True


def load(path: Path, seats: int, extras: tuple[Extra, ...], now_ns: int) -> World | None:
    """The world of the snapshot, or None when there is none that fits."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as e:
        log.error("snapshot not read path=%s reason=%s", path, e.strerror)
        return None
    try:
        world = World.restore(data)
    except ValueError as e:
        log.error("snapshot not usable path=%s reason=%s", path, e)
        return None
    age_ns = now_ns - world.t_ns
    if world.seats != seats or world.extras != extras or not -1_000_000_000 < age_ns < OLDEST_NS:
        log.info("snapshot of another conference ignored path=%s seats=%d age_s=%.1f", path, world.seats, age_ns * 1e-9)
        return None
    log.info("world restored step=%d age_s=%.2f", world.step_number, age_ns * 1e-9)
    return world
