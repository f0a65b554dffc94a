"""The `vistel` command."""

from __future__ import annotations

import logging
import os
import sys

import typer

from vistel.wire.background import TaskFailedError
from vistel_cli import ask, bench, wall
from vistel_cli.avatar import avatar
from vistel_cli.calibrate import calibrate
from vistel_cli.devices import devices, doctor
from vistel_cli.log import log, replay
from vistel_cli.run import record, sim, site, up
from vistel_cli.scene import polygonise, scanline, trace
from vistel_cli.terminal import FAILED, print_error
from vistel_cli.voice import speech, voice
from vistel_cli.world import move as world_move
from vistel_cli.world import serve as world_serve
from vistel_cli.world import world
from vistel_cli.wrinkle import wrinkle

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
app.command("trace")(trace.trace)
app.command("scanline")(scanline.scanline)
app.command("bench")(bench.bench)
app.command("ask")(ask.ask)
app.command("wall")(wall.wall)
app.command("polygonise")(polygonise.polygonise)
app.add_typer(avatar.app, name="avatar")
app.add_typer(wrinkle.app, name="wrinkle")
app.add_typer(calibrate.app, name="calibrate")
app.add_typer(site.app, name="site")
app.add_typer(voice.app, name="voice")
app.add_typer(speech.app, name="speech")
app.add_typer(log.app, name="log")
world.app.command("serve")(world_serve.serve)
world.app.command("where")(world_move.where)
world.app.command("move")(world_move.move)
app.add_typer(world.app, name="world")


def main() -> None:
    """Entry point. Exit code 0: success, 1: failure, 2: wrong usage."""
    code: int | str | None = 0
    try:
        app()
    except KeyboardInterrupt:
        code = 0
    except TaskFailedError as e:
        print_error(f"{e}; the log says why")
        code = FAILED
    except SystemExit as e:
        code = e.code
    if "zenoh" not in sys.modules or not isinstance(code, int):
        sys.exit(code)
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    # The bus's threads wait in native code; Python's own exit would interrupt them there and abort.
    os._exit(code)


if __name__ == "__main__":
    main()
