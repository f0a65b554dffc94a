"""`vistel testing check`: whether a device, or what stands in for one, does what its protocol says."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Generator, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table
from rich.text import Text

from vistel_cli.terminal import FAILED, USAGE, fail, indented, out
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.testing.conformance import Outcome

STYLES = {"pass": "green", "fail": "bold red", "skip": "yellow"}


def check(
    protocol: Annotated[str | None, typer.Argument(help="The protocol; without one, those that can be checked are listed.")] = None,
    device: Annotated[
        str | None,
        typer.Argument(
            help='A serial port, "host:port", "Tracker0@host:port" for a device of a VRPN server, "module:object" for a class or '
            'function that gives a line, or "sim" for VISTEL\'s own simulator. Without one, the checks are listed.'
        ),
    ] = None,
    baud: Annotated[int, typer.Option(help="Speed of a serial port; default: the usual one of the protocol.")] = 0,
    only: Annotated[list[str] | None, typer.Option(help="Try only this check, after identification; repeatable.")] = None,
    memory: Annotated[bool, typer.Option("--memory", help="Overwrite what the device keeps when it is switched off.")] = False,
    by_hand: Annotated[bool, typer.Option("--by-hand", help="Ask you to unplug the device, and to plug it in again.")] = False,
    patience: Annotated[float, typer.Option(min=1.0, help="How many times longer than usual answers may take.")] = 1.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object for each check.")] = False,
) -> None:
    """Check whether a device, or a program that stands in for one, does what its protocol says.

    The exit code is 1 when a check fails. No other program may be using the port.

    [bold]Examples[/bold]

      vistel testing check

      vistel testing check fastrak sim

      vistel testing check fastrak /dev/ttyUSB0
    """
    from vistel.testing.conformance import SUITES, LineError, Target

    if protocol is None:
        _list([(s.protocol, s.title) for s in SUITES.values()], "protocol", "described in", as_json)
        return
    if protocol not in SUITES:
        fail(f"no suite of {protocol!r}; there are {', '.join(SUITES)}", USAGE)
    suite = SUITES[protocol]
    if device is None:
        _list([(c.name, c.about) for c in suite.checks], "check", "what is expected", as_json)
        return
    names = [c.name for c in suite.checks]
    if unknown := [n for n in only or () if n not in names]:
        fail(f"no check of {protocol} is called {unknown[0]!r}; `vistel testing check {protocol}` lists them", USAGE)
    if device == "sim":
        with waiting("loading the simulator"):
            from vistel_sim.testing.conforming import simulated

        targets = simulated(protocol)
    else:
        unplugged = _unplugged_by_hand if by_hand else None
        targets = nullcontext(Target(device, baud, overwrite=memory, unplugged=unplugged, patience=patience))
    failed = 0
    try:
        with targets as target:
            for outcome in _begun(suite.run(target, only or ())):
                _show(outcome, as_json)
                failed += outcome.verdict == "fail"
    except LineError as e:
        fail(str(e))
    if failed:
        if not as_json:
            out.print(f"{failed} of {len(names)} checks failed", style=STYLES["fail"])
        raise typer.Exit(FAILED)


def _begun(outcomes: Iterator[Outcome]) -> Iterator[Outcome]:
    """The outcomes; a word where the first one is long in coming."""
    with waiting("waiting for the device's first answer"):
        first = next(outcomes, None)
    yield from () if first is None else (first,)
    yield from outcomes


@contextmanager
def _unplugged_by_hand() -> Generator[None]:
    typer.prompt("unplug the device, then press Enter", default="", show_default=False, err=True)
    yield
    typer.prompt("plug it in again, wait until its port is there, then press Enter", default="", show_default=False, err=True)


def _list(rows: list[tuple[str, str]], what: str, about: str, as_json: bool) -> None:
    if as_json:
        for name, text in rows:
            print(json.dumps({"name": name, "about": text}))
        return
    table = Table(box=None)
    table.add_column(what, no_wrap=True, min_width=max(len(name) for name, _ in rows))
    table.add_column(about)
    for row in rows:
        table.add_row(*row)
    out.print(table)


def _show(outcome: Outcome, as_json: bool) -> None:
    if as_json:
        print(json.dumps(dataclasses.asdict(outcome)), flush=True)
        return
    section = f"  ({outcome.section})" if outcome.section and outcome.verdict == "fail" else ""
    said = f"{outcome.name:44} {indented(outcome.line + section, 50)}"
    line = Text.assemble((f"{outcome.verdict:5}", STYLES[outcome.verdict]), said)
    out.print(line, soft_wrap=True)
