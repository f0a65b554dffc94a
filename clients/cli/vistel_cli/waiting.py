"""Says what a command waits for, and how long or how far it is, once that is noticed."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

SILENT_S = 2.0
"""Nothing is said before so much time has passed [s] ..."""
SILENT_ON_TERMINAL_S = 1.0
"""... and on a terminal so much: who sits there wonders earlier [s]."""
BEGINNING_S = 5.0
"""A command begins with several short waits. On a terminal those within this time are taken for one [s]."""
EVERY_S = 1.9
"""Where there is no terminal, a line is printed so often [s]."""


class _Command:
    """The command of this process."""

    begun_s = -BEGINNING_S
    """When it began, on the clock of `time.monotonic`."""


def command_begins() -> None:
    """Tell that a command of a terminal begins now."""
    _Command.begun_s = time.monotonic()


def silent_of(since_s: float, *, on_terminal: bool) -> float:
    """How long a wait says nothing at first [s] that begins `since_s` after its command."""
    if not on_terminal:
        return SILENT_S
    return max(0.0, SILENT_ON_TERMINAL_S - since_s) if since_s < BEGINNING_S else SILENT_ON_TERMINAL_S


@contextmanager
def waiting(what: str | Callable[[], str], silent_s: float | None = None) -> Iterator[None]:
    """Within the block, `what`, or what it gives then, is said on standard error with the seconds that have passed: "waiting for
    the world … 4 s". silent_s: first it says nothing for so long; default `SILENT_S`, and less on a terminal. In a thread, for the
    command may be loading, or wait in native code."""
    if silent_s is None:
        silent_s = silent_of(time.monotonic() - _Command.begun_s, on_terminal=sys.stderr.isatty())
    ended = threading.Event()
    thread = threading.Thread(target=_tell, args=(what, silent_s, ended), daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@contextmanager
def progress(what: str, show: bool = True) -> Iterator[Callable[[float], None]]:
    """Within the block, how much of `what` is done is shown on standard error: the given function is told the share, 0 to 1. On a
    terminal as a bar with the time that is left, elsewhere as lines, as `waiting` has them. show: False shows nothing."""
    from vistel_cli.terminal import err

    done = 0.0

    def tell(share: float) -> None:
        nonlocal done
        done = share

    if not (show and err.is_terminal):
        with waiting(lambda: f"{what}: {done:.0%}") if show else nullcontext():
            yield tell
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err, transient=True) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda share: bar.update(task, completed=share)


def _tell(what: str | Callable[[], str], silent_s: float, ended: threading.Event) -> None:
    began = time.monotonic()
    if ended.wait(silent_s):
        return
    from rich.text import Text

    from vistel_cli.terminal import err

    with err.status("") as status:  # shown on a terminal only
        while True:
            said = f"{what if isinstance(what, str) else what()} … {time.monotonic() - began:.0f} s"
            status.update(Text(said))
            if not err.is_terminal:
                err.print(said, soft_wrap=True)
            if ended.wait(1.0 if err.is_terminal else EVERY_S):
                return
