"""What a benchmark is at, on standard error: a line for each part, and in a terminal how far it has come."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SHOWN_EVERY = 0.25
"""Seconds."""


@contextmanager
def part(name: str, steps: int = 0) -> Iterator[Callable[[], None]]:
    """One part of a benchmark, of so many steps; what it gives is called after each of them."""
    began = shown = time.monotonic()
    count, live = 0, sys.stderr.isatty()

    def done() -> None:
        nonlocal count, shown
        count += 1
        now = time.monotonic()
        if live and now - shown > SHOWN_EVERY:
            shown = now
            print(f"\r  {name}: {count} of {steps}", end="", file=sys.stderr, flush=True)

    yield done
    print(f"{chr(13) if live else ''}  {name}: {time.monotonic() - began:.1f} s    ", file=sys.stderr, flush=True)


def skipped(what: str, why: str) -> None:
    """Say in one line which figures of a benchmark are not measured here, and why."""
    print(f"{what}: skipped, {why}", file=sys.stderr, flush=True)
