"""A command-line program from an activity: a short coroutine that watches a room and changes it, such as a puzzle.

async def play(session: AsyncSession) -> None:
    await session.ask("create green ball 6 cm here")
    async for room in session.steps():
        ...

run(play)      # python my_activity.py conference.toml --as aiko
"""

import argparse
import asyncio
import contextlib
import signal
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from vistel.conference.files import ConferenceError
from vistel.session.blocking import place_of
from vistel.session.session import AsyncSession, opened
from vistel.space.commands.phrase import PhraseError
from vistel.wire.zenoh.bus import BusError

Activity = Callable[[AsyncSession], Coroutine[Any, Any, None]]


def run(activity: Activity, arguments: list[str] | None = None) -> None:
    """Read the command line, join the conference, and play until the activity ends or Ctrl-C is pressed."""
    parser = argparse.ArgumentParser(description=(activity.__doc__ or "").strip() or None)
    parser.add_argument("conference", type=Path, nargs="?", help="conference file; default: that of the conference that runs here")
    parser.add_argument("--as", dest="participant", help="participant who asks; default: the first of the file")
    parser.add_argument("--hub", help="router; default: that of the conference that runs here, else the file's")
    args = parser.parse_args(arguments)
    try:
        asyncio.run(_played(activity, args.conference, args.participant, args.hub))
    except (ConferenceError, BusError, PhraseError) as e:
        sys.exit(f"error: {e}")


async def _played(activity: Activity, file: Path | None, participant: str | None, hub: str | None) -> None:
    conference, site, name, router = place_of(file, None, participant, hub)
    async with opened(conference, site, name, router) as session:
        told = (activity.__doc__ or "").strip()
        print(f"{told}{' ' if told else ''}This runs in {conference.name} as {name}, until Ctrl-C.", flush=True)
        playing = asyncio.current_task()
        assert playing is not None
        for signum in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(signum, playing.cancel)
        with contextlib.suppress(asyncio.CancelledError):
            await activity(session)
