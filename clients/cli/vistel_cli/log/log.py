"""`vistel log`: inspects, repairs, cuts and exports logs."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track
from rich.table import Table

from vistel.wire.log import LogError, LogReader, LogWriter
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import USAGE, err, fail, out, print_warning

app = typer.Typer(no_args_is_help=True)


@dataclass
class _Channel:
    topic: str
    messages: int = 0
    bytes: int = 0
    first_ns: int = 0
    last_ns: int = 0
    longest_gap_s: float = 0.0

    @property
    def rate_hz(self) -> float:
        span = (self.last_ns - self.first_ns) * 1e-9
        return (self.messages - 1) / span if span > 0 else 0.0

    @property
    def kbit_s(self) -> float:
        """Rate of the messages alone, without the network's own bytes."""
        span = (self.last_ns - self.first_ns) * 1e-9
        return self.bytes * 8e-3 / span if span > 0 else 0.0


def _open(path: Path) -> LogReader:
    try:
        reader = LogReader(path)
    except LogError as e:
        fail(str(e), USAGE)
    for line in reader.damage:
        print_warning(f"{path}: {line}")
    return reader


@app.command()
def info(
    log: Annotated[Path, typer.Argument(help="An MCAP log.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Show channels, messages, rates, longest gaps and damage.

    [bold]Example[/bold]

      vistel log info out/latest/conference.mcap
    """
    reader = _open(log)
    channels: dict[str, _Channel] = {}
    for r in reader.records():
        c = channels.setdefault(r.key, _Channel(r.topic.name, first_ns=r.log_ns, last_ns=r.log_ns))
        c.longest_gap_s = max(c.longest_gap_s, (r.log_ns - c.last_ns) * 1e-9)
        c.messages += 1
        c.bytes += r.size
        c.last_ns = r.log_ns
    length = (reader.end_ns - reader.begin_ns) * 1e-9
    if as_json:
        rows = [
            {
                "key": k,
                "topic": c.topic,
                "messages": c.messages,
                "bytes": c.bytes,
                "rate_hz": round(c.rate_hz, 2),
                "kbit_s": round(c.kbit_s, 2),
                "longest_gap_s": round(c.longest_gap_s, 3),
            }
            for k, c in sorted(channels.items())
        ]
        out.print_json(data={"seconds": round(length, 3), "damage": reader.damage, "channels": rows})
        return
    table = Table("key", box=None)
    table.columns[0].overflow = "fold"
    for heading in ("messages", "rate", "kbit/s", "longest gap", "bytes"):
        table.add_column(heading, justify="right", no_wrap=True)
    common = f"{os.path.commonpath(channels)}/" if len(channels) > 1 else ""
    out.print(f"channels under {common}" if common else "channels")
    for key, c in sorted(channels.items()):
        figures = (str(c.messages), f"{c.rate_hz:.1f} Hz", f"{c.kbit_s:.1f}", f"{c.longest_gap_s:.2f} s", str(c.bytes))
        table.add_row(key.removeprefix(common), *figures)
    out.print(table)
    total = sum(c.messages for c in channels.values())
    out.print(f"{length:.1f} s, {total} messages, {len(channels)} channels, {log.stat().st_size / 1e6:.1f} MB")


@app.command()
def repair(
    log: Annotated[Path, typer.Argument(help="A damaged log.")],
    output: Annotated[Path, out_file("File for the undamaged part.")],
    force: Force = False,
) -> None:
    """Write the undamaged part of a log as a complete file.

    [bold]Example[/bold]

      vistel log repair out/latest/conference.mcap --out repaired.mcap
    """
    _copy(_open(log), log, output, None, None)


@app.command()
def cut(
    log: Annotated[Path, typer.Argument(help="A log.")],
    output: Annotated[Path, out_file("File for the piece.")],
    begin: Annotated[float, typer.Option("--from", help="Seconds after the log's beginning.")] = 0.0,
    end: Annotated[float | None, typer.Option("--to", help="Seconds after the log's beginning.")] = None,
    force: Force = False,
) -> None:
    """Write a piece of a log as a log of its own.

    [bold]Example[/bold]

      vistel log cut out/latest/conference.mcap --from 10 --to 20 --out handover.mcap
    """
    reader = _open(log)
    begin_ns = reader.begin_ns + int(begin * 1e9)
    _copy(reader, log, output, begin_ns, None if end is None else reader.begin_ns + int(end * 1e9))


@app.command()
def export(
    log: Annotated[Path, typer.Argument(help="An MCAP log.")],
    output: Annotated[Path, out_file("USD file to write; its parts go into a folder beside it.")],
    begin: Annotated[float, typer.Option("--from", min=0.0, help="Seconds after the log's beginning.")] = 0.0,
    end: Annotated[float | None, typer.Option("--to", help="Seconds after the log's beginning.")] = None,
    fps: Annotated[float, typer.Option(min=1.0, max=240.0, help="Samples per second.")] = 30.0,
    force: Force = False,
) -> None:
    """Write people, room and cameras of a conference as USD with time samples, for usdview, Blender and the like.

    [bold]Example[/bold]

      vistel log export out/latest/conference.mcap -o meeting.usda --from 10 --to 20
    """
    from vistel_cli.log.usd import export_usd  # loads the mathematics

    export_usd(_open(log), log, output, begin, end, fps)


def _copy(reader: LogReader, log: Path, output: Path, begin_ns: int | None, end_ns: int | None) -> None:
    if output.resolve() == log.resolve():
        fail(f"--out {output}: is the log itself; name another file", USAGE)
    count = 0
    try:
        with LogWriter(output, conference=reader.conference_toml) as writer:
            records = reader.records(begin_ns=begin_ns, end_ns=end_ns)
            for r in track(records, description="writing", console=err, transient=True):
                writer.write(r.topic, r.key, r.message, r.log_ns)
                count += 1
    except OSError as e:
        fail(f"--out {output}: cannot be written: {e.strerror}")
    out.print(f"{count} messages written to {output}", soft_wrap=True)
