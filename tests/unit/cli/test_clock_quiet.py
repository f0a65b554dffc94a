"""A command whose machine's time is wrong prints no line of a log."""

from __future__ import annotations

import subprocess
import sys

CORRECTS = """
import logging
from vistel_cli.conference_choice import keep_clock_quiet
{first}
logging.getLogger("vistel.clock").warning("clock set by_s=120.000")
"""


def printed(first: str) -> str:
    code = CORRECTS.format(first=first)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stderr


def test_a_clock_that_is_corrected_is_no_line_in_a_terminal_and_one_in_a_log() -> None:
    assert printed("keep_clock_quiet()") == ""
    assert "by_s=120" in printed("logging.basicConfig(); keep_clock_quiet()")
