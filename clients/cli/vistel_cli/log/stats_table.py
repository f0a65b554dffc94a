"""Prints the statistics of a log."""

import os
from collections.abc import Sequence

from vistel.log.statistics import LogStatistics
from vistel_cli.terminal import out

HEADINGS = ("messages", "per s", "jitter", "kB", "99 % gap", "longest", "at", "delay", "99 %")
UNITS = ("", "", "ms", "", "s", "s", "s", "ms", "ms")

NARROWEST = 6
"""Columns that are left to the keys in a narrow terminal, where they stand on lines of their own."""


def print_statistics(found: LogStatistics) -> None:
    """A row for each channel, those with the most bytes first; then the clocks."""
    share = found.file_bytes / found.bytes if found.bytes else 0.0
    out.print(
        f"{found.seconds:.1f} s, {sum(c.messages for c in found.channels)} messages of {found.bytes / 1e6:.2f} MB, "
        f"in a file of {found.file_bytes / 1e6:.2f} MB ({share:.0%})"
    )
    keys = [c.key for c in found.channels]
    common = f"{os.path.commonpath(keys)}/" if len(keys) > 1 else ""
    rows = [
        (
            str(c.messages),
            f"{c.rate_hz:.1f}",
            f"{c.jitter_ms:.1f}",
            f"{c.bytes / 1e3:.1f}",
            f"{c.gap99_s:.3f}",
            f"{c.gap_s:.2f}",
            f"{c.gap_at_s:.1f}",
            f"{c.delay_ms:.1f}",
            f"{c.delay99_ms:.1f}",
        )
        for c in found.channels
    ]
    widths = [max(len(row[n]) for row in (HEADINGS, UNITS, *rows)) for n in range(len(HEADINGS))]
    longest = max((len(c.key.removeprefix(common)) for c in found.channels), default=0)
    left = max(NARROWEST, min(max(longest, len(common) + len("under ")), out.width - sum(w + 2 for w in widths)))
    _print_row("", HEADINGS, widths, left, "bold")
    _print_row(f"under {common}" if common else "", UNITS, widths, left, "bold")
    for c, row in sorted(zip(found.channels, rows, strict=True), key=lambda pair: -pair[0].bytes):
        _print_row(c.key.removeprefix(common), row, widths, left)
    for c in found.channels:
        if c.backwards:
            often = "once" if c.backwards == 1 else f"{c.backwards} times"
            out.print(f"{c.key}: its sender's time went back {often}", style="yellow")
    for clock in found.clocks:
        out.print(
            f"clock of {clock.node}: {clock.least_ms:.2f} to {clock.most_ms:.2f} ms off, measured {clock.measured} times "
            f"within {clock.uncertainty_ms:.2f} ms"
        )


def _print_row(key: str, figures: Sequence[str], widths: Sequence[int], left: int, style: str = "") -> None:
    """Figures in their columns after the key, or below one that is too long."""
    if len(key) > left:
        out.print(key, style=style, soft_wrap=True)
        key = ""
    out.print(f"{key:{left}}" + "".join(f"  {f:>{w}}" for f, w in zip(figures, widths, strict=True)), style=style, soft_wrap=True)
