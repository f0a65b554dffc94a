"""The piece of a log that `--from` and `--to` mean."""

from vistel.wire.log import LogReader
from vistel_cli.terminal import USAGE, fail, print_warning


def check_within(reader: LogReader, option: str, seconds: float) -> None:
    """Ends the command with one line when the log ends before so many seconds after its beginning."""
    if not 0.0 <= seconds <= reader.length_s:
        fail(f"{option} {seconds:g}: the log ends at {reader.length_s:.1f} s", USAGE)


def piece_of(reader: LogReader, begin_s: float, end_s: float | None) -> tuple[float, float]:
    """Begin and end in seconds after the log's beginning. Ends the command when the log has nothing there."""
    length = reader.length_s
    check_within(reader, "--from", begin_s)
    if begin_s == length > 0.0:
        fail(f"--from {begin_s:g}: the log ends there", USAGE)
    if end_s is not None and end_s <= begin_s:
        fail(f"--to {end_s:g}: expected a time after --from {begin_s:g}", USAGE)
    if end_s is not None and end_s > length:
        print_warning(f"--to {end_s:g}: the log ends at {length:.1f} s")
    return begin_s, length if end_s is None else min(end_s, length)
