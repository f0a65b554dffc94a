"""`vistel log redact`: a log that can be passed on, without the people in it."""

from pathlib import Path
from typing import Annotated

import typer

from vistel.wire.log import LogError, LogReader
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import LOG
from vistel_cli.overwriting import Force, keep_source, out_file, written_whole
from vistel_cli.terminal import fail, out, print_warning
from vistel_cli.waiting import waiting


def redact(
    log: Annotated[Path, Takes(LOG), typer.Argument(help="A log.")],
    output: Annotated[Path, out_file("File for what may be passed on.")],
    name: Annotated[
        list[str] | None,
        typer.Option("--name", help="Another name to take out, of somebody who was spoken of; may be given again."),
    ] = None,
    force: Force = False,
) -> None:
    """Write a log without the people in it: person-1 in place of names; no voices, words, faces and likenesses.

    What they did stays: postures, what trackers and gloves measured, what was touched, held and asked for. It is replayed as any
    other, but for --verify.

    [bold]Example[/bold]

      vistel log redact out/latest/conference.mcap --out shared.mcap
    """
    from vistel.log.redact import RedactError
    from vistel.log.redact import redact as write  # loads the mathematics

    keep_source(log, output)
    done = 0.0

    def progress(share: float) -> None:
        nonlocal done
        done = share

    try:
        reader = LogReader(log)
        with written_whole(output) as made, waiting(lambda: f"writing {output.name}: {done:.0%}"):
            found = write(reader, made, name or (), progress)
    except (LogError, RedactError) as e:
        fail(str(e))
    for line in reader.damage:
        print_warning(f"{log}: {line}")
    out.print(f"{found.written} messages written to {output}, {found.left_out} left out", soft_wrap=True)
    out.print(f"replaced: {', '.join(found.names)}", soft_wrap=True)
