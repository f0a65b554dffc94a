"""`vistel log`: inspects, repairs, cuts and exports logs."""

from pathlib import Path
from typing import Annotated

import typer

from vistel.wire.log import LogError, LogReader
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import LOG
from vistel_cli.log.encrypt import decrypt, encrypt, new_key
from vistel_cli.log.export import export
from vistel_cli.log.importing import import_
from vistel_cli.log.piece import piece_of
from vistel_cli.log.redact import redact
from vistel_cli.log.study import diff, grep, reading, stats
from vistel_cli.overwriting import Force, keep_source, out_file, written_whole
from vistel_cli.terminal import fail, out, print_warning
from vistel_cli.waiting import waiting

app = typer.Typer(no_args_is_help=True)


def _open(path: Path, *, warn: bool = True) -> LogReader:
    try:
        reader = LogReader(path)
    except LogError as e:
        fail(str(e))
    if reader.damage and not reader.end_ns:
        fail(f"{path}: {reader.damage[0]}")
    for line in reader.damage if warn else ():
        print_warning(f"{path}: {line}")
    return reader


@app.command()
def info(
    log: Annotated[Path, Takes(LOG), typer.Argument(help="An MCAP log.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Show how long a log is, who is in it, what is missing or damaged, and its channels with their rates and gaps.

    [bold]Example[/bold]

      vistel log info out/latest/conference.mcap
    """
    from vistel_cli.log.info import contents_json, print_contents, read_contents  # loads the mathematics

    reader = _open(log, warn=False)
    with reading(reader):
        found = read_contents(reader)
    if as_json:
        out.print_json(data=contents_json(found))
    else:
        print_contents(found, log.stat().st_size)


@app.command()
def repair(
    log: Annotated[Path, Takes(LOG), typer.Argument(help="A damaged log.")],
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
    log: Annotated[Path, Takes(LOG), typer.Argument(help="A log.")],
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
    whole = end is None
    begin, end = piece_of(reader, begin, end)
    _copy(reader, log, output, reader.begin_ns + int(begin * 1e9), None if whole else reader.begin_ns + int(end * 1e9))


app.command()(diff)
app.command()(stats)
app.command()(grep)
app.command()(export)
app.command(name="import")(import_)
app.command()(redact)
app.command()(new_key)
app.command()(encrypt)
app.command()(decrypt)


def _copy(reader: LogReader, log: Path, output: Path, begin_ns: int | None, end_ns: int | None) -> None:
    keep_source(log, output)
    from vistel.log.exports import write_records

    records = reader.records(begin_ns=begin_ns, end_ns=end_ns)
    with written_whole(output) as made, waiting(lambda: f"writing {output.name}: {reader.share_read:.0%} of {log.name} read"):
        count = write_records(reader, records, made)
    out.print(f"{count} messages written to {output}", soft_wrap=True)
