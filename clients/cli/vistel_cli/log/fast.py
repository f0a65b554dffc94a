"""`vistel replay --fast`: computes a log anew in simulated time, without pictures and without a network.

Recorded bytes go through the same drivers, filters, posture solver and world as live, and what comes out is written down. Clocks
jump from one event to the next, so it takes as long as the machine computes, and the same log gives the same bytes.

Postures do not depend on the world, and nothing on what is written. So there are three parts, which hand on a quarter of a second
at a time: postures (`fast_sites`), the world (`fast_world`), and the log that is written. Where the machine has a second core, the
first two have a process each (`fast_apart`). One process or three makes no difference to the result.
"""

import contextlib
import logging
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire.log import LogReader, LogWriter
from vistel_cli.log.fast_apart import can_be_apart, computed_apart
from vistel_cli.log.fast_sites import computed_sites
from vistel_cli.log.fast_world import computed_world, write_messages

BEFORE_NS = 10_000_000_000
"""A replay from the middle begins so long before: solver and filters have forgotten by then where they began [ns]."""
SETTLE_NS = 100_000_000
"""It goes on for so long after the end: the world steps with the last motions [ns]."""


def replay_fast(
    reader: LogReader,
    conference: Conference,
    source: str,
    begin_ns: int,
    end_ns: int,
    output: Path,
    progress: Callable[[int], object] = lambda _: None,
    apart: bool | None = None,
) -> int:
    """Compute from `begin_ns` to `end_ns` [conference time] into the log `output`, which holds what was used and what was made.

    source: what is taken from the log, "devices" or "motion". progress: called with the time that was reached [ns]. apart: whether
    postures and the world are computed in processes of their own, copies of this one; None: where the machine has a core for it.
    Returns how many messages were used. Raises OSError where `output` cannot be written.
    """
    start_ns = max(reader.begin_ns, begin_ns - BEFORE_NS)
    with ExitStack() as ends:
        folder = Path(ends.enter_context(tempfile.TemporaryDirectory(prefix="vistel-")))
        writer = ends.enter_context(LogWriter(output, reader.conference_toml))
        ends.enter_context(_quietly())
        paths = RunPaths(folder, folder)
        several = can_be_apart() if apart is None else apart
        windows = computed_sites(reader, conference, source, start_ns, end_ns, end_ns + SETTLE_NS, paths)
        if several:
            windows = ends.enter_context(computed_apart(windows))
        windows = computed_world(reader, conference, start_ns, windows, paths)
        if several:
            windows = ends.enter_context(computed_apart(windows))
        last = None
        for last in windows:
            write_messages(writer, last.messages)
            progress(last.until_ns)
    assert last is not None
    reader.damage.extend(line for line in last.damage if line not in reader.damage)  # found by the other processes
    return last.used


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    """Services say less: what they log is about a conference that is over."""
    ours = logging.getLogger("vistel")
    before = ours.level
    ours.setLevel(logging.ERROR)
    try:
        yield
    finally:
        ours.setLevel(before)
