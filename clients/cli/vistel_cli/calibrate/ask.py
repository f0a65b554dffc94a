"""Guides a person through the moves of a calibration: instruction, countdown, remaining time."""

import asyncio
import contextlib
import shutil
from collections.abc import Callable
from typing import Protocol

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from vistel.wire import background
from vistel_cli.terminal import err, out

_VOICES = ("spd-say", "espeak-ng", "espeak", "say")
_SHOWN_S = 0.1

Now = Callable[[], float]
"""Seconds since the moves began."""


class Asker(Protocol):
    """Who asks a person for moves."""

    def tell(self, text: str) -> None:
        """Say what to do."""
        ...

    async def lead(self, now: Now, begin_s: float, seconds: float, go: str) -> None:
        """Count down to `begin_s`, say `go`, and show the `seconds` of it passing."""
        ...


class TerminalAsker:
    """Asks on the terminal. With `speak` it also asks aloud, if a speech program is installed."""

    def __init__(self, speak: bool) -> None:
        self._voice = next((v for v in _VOICES if shutil.which(v)), None) if speak else None
        if speak and self._voice is None:
            err.print(f"no speech program found; install one of {', '.join(_VOICES)}")
        self._speaking: set[asyncio.Task[None]] = set()

    def tell(self, text: str) -> None:
        """Print and speak a text. Does not wait until it is spoken."""
        out.print(text, soft_wrap=True)
        if self._voice is not None:
            self._speaking = {t for t in self._speaking if not t.done()}
            self._speaking.add(background.start(_say(self._voice, text), "voice"))

    async def lead(self, now: Now, begin_s: float, seconds: float, go: str) -> None:
        """As `Asker` has it."""
        await until(now, begin_s - 3.0)
        for left in (3, 2, 1):
            await until(now, begin_s - left)
            out.print(f"   {left}", end="")
        await until(now, begin_s)
        out.print(f"   {go}")
        if not err.is_terminal:
            await until(now, begin_s + seconds)
            return
        columns = (TextColumn("  "), BarColumn(), TimeRemainingColumn())
        with Progress(*columns, console=err, transient=True) as progress:
            task = progress.add_task("", total=seconds)
            while (done := now() - begin_s) < seconds:
                progress.update(task, completed=done)
                await asyncio.sleep(_SHOWN_S)


async def until(now: Now, t_s: float) -> None:
    """Return once it is `t_s`."""
    await asyncio.sleep(max(0.0, t_s - now()))


async def _say(voice: str, text: str) -> None:
    quiet = asyncio.subprocess.DEVNULL
    with contextlib.suppress(OSError):
        process = await asyncio.create_subprocess_exec(voice, text, stdout=quiet, stderr=quiet)
        await process.wait()
