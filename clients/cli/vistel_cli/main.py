"""The `vistel` command."""

import logging
import os
import sys

import typer

from vistel_cli.lazy import Lazy, lazy_group
from vistel_cli.terminal import FAILED, print_error

RUN = "Run a conference"
LOGS = "Record and replay"
PEOPLE = "People and devices"
SHAPES = "Shapes, pictures, measurements"
COMMANDS = {
    "up": Lazy("vistel_cli.run.up:up", RUN),
    "runs": Lazy("vistel_cli.run.runs:app", RUN, "List the folders of runs, and clear old ones."),
    "site": Lazy("vistel_cli.run.site:app", RUN, "Take part in a conference across machines."),
    "ask": Lazy("vistel_cli.ask:ask", RUN),
    "voice": Lazy("vistel_cli.voice.voice:app", RUN, "Microphones, loudspeakers and equipment of a running conference."),
    "world": Lazy("vistel_cli.world.world:app", RUN, "Rooms and things on file: show, edit, export."),
    "doctor": Lazy("vistel_cli.devices.doctor:doctor", RUN),
    "record": Lazy("vistel_cli.run.record:record", LOGS),
    "replay": Lazy("vistel_cli.log.replay:replay", LOGS),
    "log": Lazy("vistel_cli.log.log:app", LOGS, "Inspect, repair, cut and export logs."),
    "avatar": Lazy("vistel_cli.avatar.avatar:app", PEOPLE, "Make, inspect and export avatars: the people of a conference."),
    "wrinkle": Lazy("vistel_cli.wrinkle.wrinkle:app", PEOPLE, "Wrinkles of cloth and skin: shapes, displacement maps, textures."),
    "devices": Lazy("vistel_cli.devices.devices:devices", PEOPLE),
    "calibrate": Lazy("vistel_cli.calibrate.calibrate:app", PEOPLE, "Measure people and devices, into files for a conference."),
    "sim": Lazy("vistel_cli.run.sim:sim", PEOPLE),
    "speech": Lazy("vistel_cli.voice.speech:app", PEOPLE, "Spoken commands: try them, score recordings, check grammars."),
    "wall": Lazy("vistel_cli.wall:wall", PEOPLE),
    "trace": Lazy("vistel_cli.scene.trace:trace", SHAPES),
    "scanline": Lazy("vistel_cli.scene.scanline:scanline", SHAPES),
    "polygonise": Lazy("vistel_cli.scene.polygonise:polygonise", SHAPES),
    "bench": Lazy("vistel_cli.bench:bench", SHAPES),
}
app = typer.Typer(
    name="vistel",
    cls=lazy_group(COMMANDS),
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)


@app.callback()
def vistel() -> None:
    """Virtual Space Teleconferencing: people in different places meet as figures that move, touch and grasp."""


def main() -> None:
    """Entry point. Exit code 0: success, 1: failure, 2: wrong usage."""
    code: int | str | None = 0
    try:
        app()
    except KeyboardInterrupt:
        code = 0
    except SystemExit as e:
        code = e.code
    except Exception as e:
        from vistel.wire.background import TaskFailedError

        if not isinstance(e, TaskFailedError):
            raise
        print_error(f"{e}; the log says why")
        code = FAILED
    if "zenoh" not in sys.modules or not isinstance(code, int):
        sys.exit(code)
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    # The bus's threads wait in native code; Python's own exit would interrupt them there and abort.
    os._exit(code)


if __name__ == "__main__":
    main()
