"""A part of a fast replay in a process of its own ends with the command, without a word."""

from __future__ import annotations

import itertools
import os
import signal
import sys
from collections.abc import Iterator

import pytest

from vistel_cli.log.fast_apart import computed_apart


def in_a_kernel() -> Iterator[int]:
    """Numbers, and then a computation that does not end; what is raised within a kernel comes out of it as something else."""
    yield from range(3)
    try:
        signal.pause()
    except SystemExit as e:
        raise SystemError("a kernel returned a result with an exception set") from e


@pytest.mark.skipif(sys.platform != "linux", reason="a copy of a process is made on Linux alone")
def test_a_part_that_is_ended_in_its_midst_says_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    def end(signum: int, _: object) -> None:
        sys.exit(128 + signum)

    before = signal.signal(signal.SIGTERM, end)  # as the command has it
    try:
        with computed_apart(in_a_kernel()) as items:
            assert list(itertools.islice(items, 3)) == [0, 1, 2]
    finally:
        signal.signal(signal.SIGTERM, before)
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(sys.platform != "linux", reason="a copy of a process is made on Linux alone")
def test_a_part_goes_on_where_the_terminal_interrupts_all(capfd: pytest.CaptureFixture[str]) -> None:
    def interrupted() -> Iterator[str]:
        os.kill(os.getpid(), signal.SIGINT)
        yield "on"

    with computed_apart(interrupted()) as items:
        assert list(items) == ["on"], "who began it decides when it ends"
    assert capfd.readouterr().err == ""
