"""`vistel log new-key`, `encrypt` and `decrypt`: logs that only holders of a key read."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import ENCRYPTED, LOG
from vistel_cli.overwriting import Force, keep_existing, keep_source, out_file
from vistel_cli.terminal import fail, out
from vistel_cli.waiting import progress


def new_key(output: Annotated[Path, out_file("File for the private key.")], force: Force = False) -> None:
    """Make a key for encrypted logs: a private file for oneself, and beside it FILE.pub for everybody who encrypts.

    [bold]Example[/bold]

      vistel log new-key --out my.key
    """
    from vistel.log import encryption

    public = encryption.public_file(output)
    keep_existing(public, force=force)
    try:
        key = encryption.new_key(output)
    except OSError as e:
        fail(f"--out {output}: cannot be written: {e.strerror}")
    out.print(f"{output} written: keep it to yourself, nobody can read your logs without it", soft_wrap=True)
    out.print(f"{public} written: give it to those who encrypt for you; it holds {key}", soft_wrap=True)


def encrypt(
    log: Annotated[Path, Takes(LOG), typer.Argument(help="A log.")],
    output: Annotated[Path, out_file("File that only holders of the keys can read.")],
    keys: Annotated[
        list[str],
        typer.Option("--recipient", metavar="KEY", help="A public key of age or SSH, or a file of them; several may be given."),
    ],
    force: Force = False,
) -> None:
    """Encrypt a log for those who may read it. The program age (age-encryption.org) reads the file, too.

    [bold]Example[/bold]

      vistel log encrypt out/latest/conference.mcap --recipient my.key.pub --out meeting.mcap.age
    """
    from vistel.log import encryption

    _write(log, output, lambda told: encryption.encrypt(log, output, keys, told))


def decrypt(
    file: Annotated[Path, Takes(ENCRYPTED), typer.Argument(help="An encrypted log.")],
    output: Annotated[Path, out_file("File for the log.")],
    key: Annotated[Path, typer.Option("--key", help="The file of a private key of age or SSH.")],
    force: Force = False,
) -> None:
    """Decrypt a log. Nothing is written where a byte of it was changed.

    [bold]Example[/bold]

      vistel log decrypt meeting.mcap.age --key my.key --out meeting.mcap
    """
    from vistel.log import encryption

    _write(file, output, lambda told: encryption.decrypt(file, output, key, told))


def _write(source: Path, output: Path, write: Callable[[Callable[[float], None]], None]) -> None:
    from vistel.log.encryption import EncryptionError

    keep_source(source, output)
    try:
        with progress(f"writing {output.name}") as tell:
            write(tell)
    except EncryptionError as e:
        fail(str(e))
    except OSError as e:
        fail(f"{e.filename or output}: {(e.strerror or 'cannot be read or written').lower()}")
    out.print(f"{output} written", soft_wrap=True)
