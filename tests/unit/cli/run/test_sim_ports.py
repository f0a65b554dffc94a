"""`vistel sim` prints a port when it can be opened, and a fault when it begins and when it is over."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from vistel.wire import simulated_loop
from vistel_cli.run import sim
from vistel_sim.faults import fault_from_text


def _waited(*, code: int | None, ports: list[Path], plugged: Path | None = None) -> float:
    """How long the command waits for ports [s], one of which may come after a second."""

    async def wait() -> float:
        loop = asyncio.get_running_loop()
        if plugged is not None:
            loop.call_later(1.0, plugged.symlink_to, "/dev/null")
        process: Any = SimpleNamespace(returncode=code)
        began = loop.time()
        await sim.until_there(ports, process)
        return loop.time() - began

    return simulated_loop.run(wait())


def test_ports_are_waited_for(tmp_path: Path) -> None:
    first, second = tmp_path / "tracker", tmp_path / "glove"
    first.symlink_to("/dev/null")
    assert 0.99 <= _waited(code=None, ports=[first, second], plugged=second) < 2.0


def test_ports_of_a_process_that_has_ended_are_not_waited_for(tmp_path: Path) -> None:
    assert _waited(code=2, ports=[tmp_path / "tracker"]) == 0.0


def test_a_port_that_a_fault_takes_away_does_not_hold_the_others_up_for_ever(tmp_path: Path) -> None:
    assert sim.MOST_S <= _waited(code=None, ports=[tmp_path / "tracker"]) <= sim.MOST_S + 1.0


def test_a_fault_is_told_as_it_begins_and_when_it_is_over(capsys: pytest.CaptureFixture[str]) -> None:
    async def fail() -> tuple[float, str]:
        loop = asyncio.get_running_loop()
        loop.call_later(11.0, lambda: said.append(capsys.readouterr().err))
        await sim.tell(fault_from_text("aiko-tracker:unplug:10:3"))
        return loop.time(), capsys.readouterr().err

    said: list[str] = []
    ended, over = simulated_loop.run(fail())
    assert said == ["aiko-tracker: unplug for 3 s\n"]
    assert over == "aiko-tracker: unplug is over\n"
    assert ended >= 13.0
