"""Ctrl-C ends what is in native code."""

from __future__ import annotations

import signal
import subprocess
import sys

from vistel_cli.stop_asked import STOPPED, stopped_at_once

IN_NATIVE_CODE = """
import hashlib, sys
from vistel_cli.stop_asked import STOPPED, stopped_at_once
with stopped_at_once(STOPPED):
    print("begun", flush=True)
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""


def test_ctrl_c_ends_what_is_in_native_code_with_one_line() -> None:
    process = subprocess.Popen([sys.executable, "-c", IN_NATIVE_CODE], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == "begun\n"
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, said) == (1, "stopped; nothing was written\n")


def test_after_the_block_ctrl_c_is_what_it_was() -> None:
    before = signal.getsignal(signal.SIGINT)
    with stopped_at_once(STOPPED):
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before
    assert signal.set_wakeup_fd(-1) == -1
