"""Reading again where Python stumbled over its own threads."""

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

_TIMES = 5


def undisturbed(read: Callable[P, T]) -> Callable[P, T]:
    """A function that reads arrays from files, begun again where it raises SystemError, at most five times.

    NumPy parses the header of every array with Python's own parser. Before Python 3.11.8 that raises SystemError now and then while
    another thread parses, too (CPython issue 106905): an avatar would not come, for no fault of its own.
    """

    @functools.wraps(read)
    def again(*given: P.args, **named: P.kwargs) -> T:
        for _ in range(_TIMES - 1):
            try:
                return read(*given, **named)
            except SystemError:
                continue
        return read(*given, **named)

    return again
