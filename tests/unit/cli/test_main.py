"""How the `vistel` command ends."""

import signal
import subprocess
import sys

import pytest

PROGRAM = """
import time
import vistel_cli.main as command

def waits() -> None:
    try:
        print("waits", flush=True)
        time.sleep(600)
    finally:
        print("ends what it started", flush=True)

command.app = waits
command.main()
"""


def test_a_command_that_is_told_to_end_first_ends_what_it_started() -> None:
    with subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "waits\n"
        process.terminate()
        assert process.stdout.read() == "ends what it started\n"
    assert process.returncode == 128 + signal.SIGTERM


@pytest.mark.parametrize(("raised", "code"), [("KeyboardInterrupt()", 130), ("SystemExit(143)", 143)])
def test_a_signal_that_came_while_a_kernel_was_called_is_no_fault(raised: str, code: int) -> None:
    program = f"""
import vistel_cli.main as command

def kernel() -> None:
    try:
        raise SystemError("inner") from {raised}
    except SystemError as e:
        raise SystemError("returned a result with an exception set") from e

command.app = kernel
command.main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert done.stderr == ""
