"""The console's page of a log, served in this process."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from vistel.conference.model import Conference
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.log import LogReader
from vistel_services.console import bundle
from vistel_services.console.replays import Replays
from vistel_services.console.service import POLICY, SERVED
from vistel_services.serving.address import PageAddress
from vistel_services.serving.pages import PageFiles
from vistel_services.serving.server import open_server

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


@contextlib.asynccontextmanager
async def served(log: Path, beside: Path | None = None) -> AsyncIterator[str]:
    """The address of the page of a log, with another one beside it."""
    clock = SystemClock()
    conference = Conference.model_validate(LogReader(MEETING).conference)
    replays = Replays(conference, lambda: log if log.exists() else None, clock, beside)
    files = PageFiles("replay", bundle.FOLDER, SERVED, POLICY)
    handlers = {"/live": replays.watch, "/export": replays.export, "/asset/{digest}.glb": replays.asset}
    server = await open_server("replay", files, PageAddress("127.0.0.1", 0), handlers, clock, datetime.now(UTC))
    try:
        yield server.address.url
    finally:
        await server.close()


def run(test: Any) -> None:
    asyncio.run(background.as_service("test", test))
