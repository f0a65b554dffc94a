"""What no command foresaw: one line for who typed it, and a report for who mends it."""

from __future__ import annotations

import platform
import shlex
import sys
import tempfile
import traceback
from pathlib import Path

from vistel.conference.files import ConferenceError
from vistel.wire.background import TaskFailedError
from vistel.wire.release import release
from vistel_cli.terminal import FAILED, print_error


def tell(error: Exception) -> int:
    """Says in one line what ended the command. Returns its exit code."""
    from vistel.wire.zenoh.bus import BusError  # takes long to load

    inner = _only(error)
    if isinstance(inner, TaskFailedError):
        print_error(f"{inner}; the log says why")
    elif isinstance(inner, (BusError, ConferenceError)):
        for line in str(inner).splitlines():
            print_error(line)
    elif isinstance(inner, OSError) and inner.filename is not None:
        print_error(f"{inner.filename}: {inner.strerror or inner}")
    else:
        first = (str(inner).splitlines() or [""])[0]
        print_error(f"unexpected {type(inner).__name__}{': ' if first else ''}{first[:200]}; {_reported(error)}")
    return FAILED


def _only(error: BaseException) -> BaseException:
    """The one error of a group that has no other."""
    while isinstance(error, BaseExceptionGroup) and len(error.exceptions) == 1:
        error = error.exceptions[0]
    return error


def _reported(error: Exception) -> str:
    text = (
        f"{shlex.join(sys.argv)}\nVISTEL {release()}, Python {sys.version}, {platform.platform()}\n\n"
        f"{''.join(traceback.format_exception(error))}"
    )
    try:
        with tempfile.NamedTemporaryFile("w", encoding="utf-8", prefix="vistel-error-", suffix=".txt", delete=False) as file:
            file.write(text)
    except OSError:
        return "no report could be written"
    return f"this is a fault of VISTEL; the full report is in {Path(file.name)}"
