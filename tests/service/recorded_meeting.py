"""A recorded meeting on file: what the world of the demo does in some seconds, without devices and without a network."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from world_site import WorldSite

from vistel.conference.files import DEMO_FILE
from vistel.wire.log import LogWriter
from vistel.wire.topics import BY_NAME

PEOPLE = {"ben": "bruno", "carla": "chidi"}
"""Whom `WorldSite` has in place of whom in the demo's file."""


def record(folder: Path, seconds: float = 3.0) -> Path:
    """Write `seconds` of the meeting into a log in `folder`."""

    async def played() -> WorldSite:
        site = WorldSite(folder)
        async with site.open():
            await site.play(seconds, from_s=2.2)
        return site

    return written(asyncio.run(played()).log, folder / "conference.mcap")


def written(log: Iterable[tuple[str, dict[str, str], Any, int]], file: Path) -> Path:
    """Write what `WorldSite.log` has into a log."""
    text = DEMO_FILE.read_text("utf-8")
    for name, here in PEOPLE.items():
        text = text.replace(f'"{name}"', f'"{here}"')
    with LogWriter(file, text) as writer:
        for topic, names, message, log_ns in log:
            key = BY_NAME[topic].key.format(**{"conference": "demo", "site": "tokyo", **names})
            writer.write(BY_NAME[topic], key, message, log_ns)
    return file
