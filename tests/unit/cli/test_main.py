"""How the `vistel` command ends."""

import signal
import subprocess
import sys

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
