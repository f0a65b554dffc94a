"""`vistel testing`: the commands of the test kit."""

from __future__ import annotations

import typer

from vistel_cli.lazy import Lazy, lazy_group

LATER = {"check": Lazy("vistel_cli.testing.check:check"), "init": Lazy("vistel_cli.testing.init:init")}
app = typer.Typer(cls=lazy_group(LATER), no_args_is_help=True)


@app.callback()
def testing() -> None:
    """Test drivers and devices: check a protocol, begin a package of a driver."""
