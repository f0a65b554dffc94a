"""`vistel log diff`, `stats` and `grep`: what differs between two logs, what one is made of, and when something was so."""

from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.wire.log import LogError, LogReader
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import LOG
from vistel_cli.log.compare_options import APART_S, DEGREES, MM, MostApart, MostDegrees, MostMm
from vistel_cli.terminal import FAILED, USAGE, err, fail, out, print_warning
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.log import Log

Begin = Annotated[float, typer.Option("--from", min=0.0, help="Seconds after the log's beginning.")]
End = Annotated[float | None, typer.Option("--to", help="Seconds after the log's beginning.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print as JSON.")]
A_LOG = typer.Argument(help="An MCAP log.")


def diff(
    first: Annotated[Path, Takes(LOG), A_LOG],
    second: Annotated[Path, Takes(LOG), typer.Argument(help="Another one of the same conference, such as a replay.")],
    begin: Begin = 0.0,
    end: End = None,
    most_degrees: MostDegrees = DEGREES,
    most_mm: MostMm = MM,
    most_apart: MostApart = APART_S,
    as_json: AsJson = False,
) -> None:
    """Compare two logs: postures joint by joint, contacts, who held what, answers to commands.

    What both have at the same conference time is compared. Exit code 1 where something is beyond the limits.

    [bold]Example[/bold]

      vistel log diff out/latest/conference.mcap replayed/replay.mcap --most-degrees 1
    """
    from vistel.log.compare import Limits, compare  # loads the mathematics
    from vistel_cli.log.compared import comparison_json, print_comparison

    limits = Limits(most_degrees, most_mm, most_apart)
    one, other = opened(first), opened(second)
    try:
        with reading(one, other):
            found = compare(one, other, begin, end)
    except ValueError as e:
        fail(str(e))
    if as_json:
        out.print_json(data=comparison_json(found, limits))
    else:
        print_comparison(found, limits)
    raise typer.Exit(FAILED if found.over(limits) else 0)


def stats(log: Annotated[Path, Takes(LOG), A_LOG], as_json: AsJson = False) -> None:
    """Show rates, gaps, sizes and delays of every channel, and how well clocks agreed.

    [bold]Example[/bold]

      vistel log stats out/latest/conference.mcap
    """
    from vistel.log.statistics import statistics
    from vistel_cli.log.stats_table import print_statistics

    read = opened(log)
    told = len(read.damage)
    with reading(read):
        found = statistics(read)
    for line in read.damage[told:]:
        print_warning(f"{log}: {line}")
    if as_json:
        out.print_json(data=asdict(found) | {"damage": read.damage})
    else:
        print_statistics(found)


def grep(
    log: Annotated[Path, Takes(LOG), A_LOG],
    expression: Annotated[str, typer.Argument(help='What must be true, such as "participant.ben.motion.left_wrist.speed > 0.5".')],
    begin: Begin = 0.0,
    end: End = None,
    as_json: AsJson = False,
) -> None:
    """Tell when an expression was true. It holds numbers of joints, things, contacts and messages.

    Names: participant.NAME.motion.JOINT.x, .y, .z, .speed, .angle; thing.ID.x, .y, .z, .speed, .held; touch.A.B;
    TOPIC.NAMES.FIELD for any number in a message. If it was never true, it says
    from where to where each number went, with exit code 1.

    [bold]Examples[/bold]

      vistel log grep out/latest/conference.mcap "participant.ben.motion.left_wrist.speed > 0.5"

      vistel log grep out/latest/conference.mcap "touch.aiko.ben and thing.baton.held > 1"
    """
    from vistel.log.expression import Expression, ExpressionError
    from vistel.log.numbers import UnknownNumberError, extent, spans, together, tracks

    try:
        asked, read = Expression(expression), opened(log)
        with reading(read):
            found = tracks(read, asked.names, begin, end)
    except (ExpressionError, UnknownNumberError) as e:
        fail(str(e), USAGE)
    times, values = together(found.values())
    true = asked.evaluate(dict(zip(found, values, strict=True)))
    so = list(spans(times, true)) if true.shape == times.shape else []
    if as_json:
        out.print_json(data=[{"from": round(a, 4), "to": round(b, 4)} for a, b in so])
    else:
        for a, b in so:
            out.print(f"{a:9.3f} s to {b:9.3f} s   {b - a:7.3f} s")
        if not so:
            err.print("never true" + "".join(f"\n  {name} {extent(track)}" for name, track in found.items()), soft_wrap=True)
    raise typer.Exit(0 if so else FAILED)


def reading(*logs: "Log | LogReader") -> AbstractContextManager[None]:
    """Tells within the block how far logs have been read, where that takes long."""
    return waiting(lambda: f"reading {', '.join(f'{log.path.name}: {log.share_read:.0%}' for log in logs)}")


def opened(path: Path) -> "Log":
    """A log. Ends the command with one line where it cannot be read; damage is told."""
    import vistel.log  # loads the mathematics

    try:
        log = vistel.log.open(path)
    except LogError as e:
        fail(str(e))
    if log.damage and not log.begin_ns:
        fail(f"{path}: {log.damage[0]}")
    for line in log.damage:
        print_warning(f"{path}: {line}")
    return log
