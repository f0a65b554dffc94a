"""A process that ends while its bus is open, or was closed a moment ago."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

BUS = """
import asyncio
from vistel.wire.clock import SystemClock
from vistel.wire.topics import TOPICS, Delivery
from vistel.wire.zenoh.bus import Router, ZenohBus

async def main():
    router = Router.open()
    bus = await ZenohBus.open(conference="c", site="s", clock=SystemClock(), endpoints=router.endpoints)
    for topic in TOPICS:
        if topic.delivery is not Delivery.QUERY:
            bus.subscribe(topic)
    if {close}:
        await bus.close()
        router.close()
    print("end", flush=True)

asyncio.run(main())
"""


SESSION = """
import vistel
from vistel.wire.zenoh.bus import Router

router = Router.open()
session = vistel.join({file!r}, hub=router.endpoint)
session.__enter__()
if {close}:
    session.__exit__(None, None, None)
print("end", flush=True)
"""


def run(program: str) -> tuple[int, str]:
    command = [sys.executable, "-c", textwrap.dedent(program)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return done.returncode, done.stdout


def test_a_program_that_closes_its_bus_ends_well() -> None:
    assert run(BUS.format(close=True)) == (0, "end\n")


def test_a_program_that_forgets_to_close_its_bus_ends_well() -> None:
    assert run(BUS.format(close=False)) == (0, "end\n")


@pytest.mark.parametrize("close", [True, False])
def test_a_program_that_has_joined_a_conference_ends_well(close: bool, tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text('name = "small"\n[[sites]]\nname = "here"\n[[sites.participants]]\nname = "ben"\n')
    assert run(SESSION.format(file=str(file), close=close)) == (0, "end\n")


def test_threads_of_a_joined_conference_are_waited_for(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text('name = "small"\n[[sites]]\nname = "here"\n[[sites.participants]]\nname = "ben"\n')
    daemons = "import threading; print(sorted(t.name for t in threading.enumerate() if t.daemon and not t.name.startswith('bus ')))"
    program = SESSION.format(file=str(file), close=False) + daemons
    assert run(program) == (0, "end\n[]\n")


def test_a_thread_of_the_bus_comes_to_its_end_before_the_interpreter_goes_down() -> None:
    program = """
    import threading
    from vistel.wire.zenoh.at_exit import close_at_exit, started

    closed = threading.Event()

    def run():
        closed.wait()
        threading.Event().wait(0.3)  # as one that has not come back from native code yet
        print("the thread has ended", flush=True)

    owner = object()
    close_at_exit(owner, closed.set)
    started(threading.Thread(target=run, daemon=True))
    """
    assert run(program) == (0, "the thread has ended\n")


def test_a_thread_of_the_bus_that_hangs_does_not_keep_the_process() -> None:
    program = """
    import threading
    from vistel.wire.zenoh import at_exit

    at_exit.MOST_S = 0.2
    owner = object()
    at_exit.close_at_exit(owner, lambda: None)
    at_exit.started(threading.Thread(target=threading.Event().wait, daemon=True))
    """
    assert run(program) == (0, "")
