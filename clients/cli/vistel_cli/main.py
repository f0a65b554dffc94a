"""The `vistel` command."""

from __future__ import annotations

import sys

import typer

from vistel_cli import bench, devices, doctor, log, record, replay, sim, site, up

app = typer.Typer(
    name="vistel",
    help="Virtual Space Teleconferencing: people in different places meet as figures that move, touch and grasp.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)
app.command("up")(up.up)
app.command("replay")(replay.replay)
app.command("record")(record.record)
app.command("sim")(sim.sim)
app.command("doctor")(doctor.doctor)
app.command("devices")(devices.devices)
app.command("bench")(bench.bench)
app.add_typer(site.app, name="site")
app.add_typer(log.app, name="log")


def main() -> None:
    """Entry point: exit code 0 fine, 1 failed, 2 wrong usage."""
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(0)


if __name__ == "__main__":
    main()
