"""How long a start waits for what does not come: longer on a machine that has no time for it, and not for ever."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from vistel_cli.run import patience
from vistel_cli.run.patience import LEAST, Patience


class Machine:
    """A clock that is set, and what Linux tells of two processes, each of which wants one core."""

    def __init__(self, proc: Path) -> None:
        self.now, self._proc = 100.0, proc
        self._ran, self._queued = [0, 0], [0, 0]
        self._write()

    def monotonic(self) -> float:
        return self.now

    def run(self, seconds: int, share: float, look: Patience, *, starting: bool = True) -> None:
        """Both run for `share` of that time, and wait for a processor for the rest; somebody looks twice a second."""
        for _ in range(2 * seconds):
            self.now += 0.5
            for n in range(2):
                self._ran[n] += round(0.5e9 * share)
                self._queued[n] += round(0.5e9 * (1.0 - share))
            self._write()
            look.look(starting=starting)

    def _write(self) -> None:
        for n in range(2):
            (self._proc / str(n)).mkdir(exist_ok=True)
            (self._proc / str(n) / "schedstat").write_text(f"{self._ran[n]} {self._queued[n]} 77\n")


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    one = Machine(tmp_path)
    monkeypatch.setattr(patience, "time", one)
    return one


def test_time_counts_as_far_as_the_processes_ran(machine: Machine, tmp_path: Path) -> None:
    waiting = Patience(lambda: (0, 1), tmp_path)
    machine.run(60, 1.0, waiting)
    assert waiting.counted_s == pytest.approx(60.0) and not waiting.busy
    waiting.progress()
    machine.run(60, 0.4, waiting)
    assert waiting.counted_s == pytest.approx(24.0) and waiting.waited_s == pytest.approx(60.0)
    assert waiting.busy == "the machine is busy: the processes get 40% of the processor time that they want"


def test_a_wait_ends_on_the_busiest_machine_and_where_all_have_spoken_all_time_counts(machine: Machine, tmp_path: Path) -> None:
    waiting = Patience(lambda: (0, 1), tmp_path)
    machine.run(60, 0.01, waiting)
    assert waiting.counted_s == pytest.approx(60.0 * LEAST)
    waiting.progress()
    machine.run(60, 0.01, waiting, starting=False)
    assert waiting.counted_s == pytest.approx(60.0)


def test_where_the_system_does_not_tell_all_time_counts_and_nothing_is_said_of_it(machine: Machine, tmp_path: Path) -> None:
    waiting = Patience(lambda: (0, 1), tmp_path / "no such folder")
    machine.run(60, 0.01, waiting)
    assert waiting.counted_s == pytest.approx(60.0) and not waiting.busy


def test_linux_tells_of_this_process() -> None:
    assert Patience(lambda: (os.getpid(),))._times()[os.getpid()][0] > 0
