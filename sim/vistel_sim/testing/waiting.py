"""Waiting in a test until something holds."""

import time
from collections.abc import Callable

_LOOK_S = 0.005
"""Time between two looks [s]."""


def wait_until(condition: Callable[[], object], what: str, *, within_s: float = 10.0) -> None:
    """Return as soon as `condition` holds. Fails the test, naming `what`, when it has not held for `within_s` seconds."""
    __tracebackhide__ = True
    end_s = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > end_s:
            raise AssertionError(f"waited {within_s:g} s in vain for {what}")
        time.sleep(_LOOK_S)
