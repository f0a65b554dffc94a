"""Checks of a device's side of a protocol, for any implementation of it.

    from vistel.testing import conformance

    for outcome in conformance.run("fastrak", "/dev/ttyUSB0"):
        print(outcome.verdict, outcome.name, outcome.line)

    @pytest.mark.parametrize("check", conformance.checks("fastrak"), ids=str)
    def test_my_simulator(check, my_port):
        check(my_port)

A device is a serial port, "host:port", "Tracker0@host:port", "module:object", or a class or function that gives a `Line`.
`vistel testing check` does the same on the command line.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from vistel.testing.conformance import fastrak_commands
from vistel.testing.conformance.cyberglove import CYBERGLOVE
from vistel.testing.conformance.delay_unit import DELAY
from vistel.testing.conformance.fastrak_records import FASTRAK
from vistel.testing.conformance.fivedt_5 import GLOVE_5
from vistel.testing.conformance.fivedt_16 import GLOVE_16
from vistel.testing.conformance.liberty import LIBERTY, PATRIOT
from vistel.testing.conformance.line import Line, LineError, NonconformityError, NotApplicable
from vistel.testing.conformance.suite import Check, Outcome, Suite, Target
from vistel.testing.conformance.vrpn import VRPN

__all__ = ["Check", "Line", "LineError", "NonconformityError", "NotApplicable", "Outcome", "Target", "checks", "run"]

_ = fastrak_commands  # its checks follow those of the records
SUITES: dict[str, Suite[Any]] = {s.protocol: s for s in (FASTRAK, LIBERTY, PATRIOT, CYBERGLOVE, GLOVE_16, GLOVE_5, VRPN, DELAY)}
"""By protocol."""


def checks(protocol: str) -> list[Check]:
    """The checks of a protocol, in their order. Raises ValueError for one that there is no suite of."""
    if protocol not in SUITES:
        raise ValueError(f"no suite of {protocol!r}; there are {', '.join(SUITES)}")
    return list(SUITES[protocol].checks)


def run(protocol: str, device: Target | str | Path | Callable[[], Line]) -> Iterator[Outcome]:
    """Run all checks of a protocol, each outcome as soon as it is known. Raises ValueError as `checks` does, LineError (one line)
    when the device cannot be reached."""
    checks(protocol)
    return SUITES[protocol].run(device if isinstance(device, Target) else Target(device))
