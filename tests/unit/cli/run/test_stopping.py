"""One Ctrl-C ends a run in good order, a second one at once."""

from __future__ import annotations

import asyncio
import os
import signal

import pytest

from vistel_cli.run import stopping
from vistel_cli.run.stopping import Stopping


async def _signalled(*numbers: int) -> Stopping:
    told = Stopping()
    loop = asyncio.get_running_loop()
    for number in numbers:
        os.kill(os.getpid(), number)
        await loop.run_in_executor(None, lambda: None)  # the loop turns, and takes the signal
        await asyncio.sleep(0)
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.remove_signal_handler(number)
    return told


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_signal_ends_in_good_order(number: int) -> None:
    told = asyncio.run(_signalled(number))
    assert told.asked.is_set()
    assert not told.at_once.is_set()


def test_a_second_interrupt_ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stopping, "APART_S", 0.0)
    assert asyncio.run(_signalled(signal.SIGINT, signal.SIGINT)).at_once.is_set()


def test_a_signal_that_is_passed_on_twice_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not asyncio.run(_signalled(signal.SIGTERM, signal.SIGTERM)).at_once.is_set()
    monkeypatch.setattr(stopping, "APART_S", 60.0)
    assert not asyncio.run(_signalled(signal.SIGINT, signal.SIGINT)).at_once.is_set()
