"""Parts of a benchmark, each of which can be run alone: `vistel bench NAME --part PART`."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence

from benchmarks.row import Row

Parts = Mapping[str, Callable[[], Iterator[Row]]]


def rows_of(parts: Parts, wanted: Sequence[str] = ()) -> Iterator[Row]:
    """Figures of the parts that are wanted, in their order; of all where none is named. One that fails keeps no other from running.
    Raises RuntimeError at the end with those that have failed."""
    failed: list[str] = []
    for name, rows in parts.items():
        if wanted and name not in wanted:
            continue
        print(f"{name}:", file=sys.stderr, flush=True)
        try:
            yield from rows()
        except (RuntimeError, TimeoutError) as fault:
            print(f"{name}: failed, {str(fault) or 'it took too long'}", file=sys.stderr, flush=True)
            failed.append(name)
    if failed:
        raise RuntimeError(f"not measured: {', '.join(failed)}")
