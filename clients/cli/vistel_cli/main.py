"""The `vistel` command."""

import gc
import io
import logging
import os
import signal
import sys
from typing import Annotated

import typer

from vistel_cli.lazy import Lazy, lazy_group

# The panels of `vistel --help`, by who uses the commands.
HOSTS = "For hosts"
PARTICIPANTS = "For participants"
RESEARCHERS = "For researchers"
INTEGRATORS = "For builders of devices"
MODELLERS = "For modellers"
COMMANDS = {
    "up": Lazy("vistel_cli.run.up:up", HOSTS),
    "invite": Lazy("vistel_cli.invite:invite", HOSTS),
    "examples": Lazy("vistel_cli.examples.examples:examples", HOSTS),
    "runs": Lazy("vistel_cli.run.runs:app", HOSTS, "List the folders of runs, and clear old ones."),
    "site": Lazy("vistel_cli.site.site:app", HOSTS, "Take part in a conference across machines."),
    "world": Lazy("vistel_cli.world.world:app", HOSTS, "Rooms: show, edit, export, run and move them."),
    "doctor": Lazy("vistel_cli.devices.doctor:doctor", HOSTS),
    "fault": Lazy("vistel_cli.faults.fault:fault", HOSTS),
    "wall": Lazy("vistel_cli.wall:wall", HOSTS),
    "ask": Lazy("vistel_cli.ask:ask", PARTICIPANTS),
    "chat": Lazy("vistel_cli.chat:chat", PARTICIPANTS),
    "raise": Lazy("vistel_cli.signals:raise_hand", PARTICIPANTS),
    "react": Lazy("vistel_cli.signals:react", PARTICIPANTS),
    "show": Lazy("vistel_cli.show:show", PARTICIPANTS),
    "board": Lazy("vistel_cli.board:board", PARTICIPANTS),
    "voice": Lazy("vistel_cli.voice.voice:app", PARTICIPANTS, "Microphones, loudspeakers and equipment of a running conference."),
    "speech": Lazy("vistel_cli.voice.speech:app", PARTICIPANTS, "Spoken commands: try them, score recordings, check grammars."),
    "avatar": Lazy("vistel_cli.avatar.avatar:app", PARTICIPANTS, "Make, inspect and export avatars: the people of a conference."),
    "calibrate": Lazy(
        "vistel_cli.calibrate.calibrate:app", PARTICIPANTS, "Measure people and devices, into files for a conference."
    ),
    "studio": Lazy("vistel_cli.studio.open_studio:studio", PARTICIPANTS),
    "devices": Lazy("vistel_cli.devices.devices:devices", PARTICIPANTS),
    "record": Lazy("vistel_cli.run.record:record", RESEARCHERS),
    "replay": Lazy("vistel_cli.log.replay:replay", RESEARCHERS),
    "log": Lazy("vistel_cli.log.log:app", RESEARCHERS, "Inspect, repair, cut and export logs."),
    "bench": Lazy("vistel_cli.bench:bench", RESEARCHERS),
    "sim": Lazy("vistel_cli.run.sim:app", INTEGRATORS, "Simulate the devices of a conference, or a crowd in one room."),
    "testing": Lazy(
        "vistel_cli.testing.testing:app", INTEGRATORS, "Test drivers and devices: check a protocol, begin a package of a driver."
    ),
    "wrinkle": Lazy(
        "vistel_cli.wrinkle.wrinkle:app", MODELLERS, "Wrinkles of cloth and skin: shapes, displacement maps, textures."
    ),
    "trace": Lazy("vistel_cli.scene.trace:trace", MODELLERS),
    "scanline": Lazy("vistel_cli.scene.scanline:scanline", MODELLERS),
    "polygonise": Lazy("vistel_cli.scene.polygonise:polygonise", MODELLERS),
}
COLLECT_AFTER = 50_000
"""New objects before Python looks for garbage: what loads is no garbage, and looking takes a tenth of the time."""
app = typer.Typer(
    name="vistel",
    cls=lazy_group(COMMANDS),
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)


def _show_version(asked: bool) -> None:
    if asked:
        from vistel.wire.release import RELEASE

        print(f"vistel {RELEASE}")
        raise typer.Exit


@app.callback()
def vistel(
    version: Annotated[bool, typer.Option("--version", help="Print the version.", callback=_show_version, is_eager=True)] = False,
) -> None:
    """Virtual Space Teleconferencing: people in different places meet as figures that move, touch and grasp."""


def _end(signum: int, _: object) -> None:
    sys.exit(128 + signum)


def _raised(error: BaseException) -> BaseException | None:
    """What a signal raised: where a kernel was called just then, Python tells it as the cause of a SystemError."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, KeyboardInterrupt | SystemExit):
        cause = cause.__cause__
    return cause


def main() -> None:
    """Entry point. Exit code 0: success, 1: failure, 2: wrong usage, 130: ended by Ctrl-C before it was done, 143: by SIGTERM."""
    gc.set_threshold(COLLECT_AFTER)
    signal.signal(signal.SIGTERM, _end)  # else what the command started goes on without it
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that is not UTF-8 shows ? for what it lacks
    code: int | str | None = 0
    try:
        app()
    except KeyboardInterrupt:
        code = 0
    except SystemExit as e:
        code = e.code
    except Exception as e:
        from vistel_cli.unexpected import tell

        match _raised(e):
            case KeyboardInterrupt():
                code = 128 + signal.SIGINT
            case SystemExit() as ended:
                code = ended.code
            case _:
                code = tell(e)
    if "zenoh" not in sys.modules or not isinstance(code, int):
        sys.exit(code)
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    # The bus's threads wait in native code; Python's own exit would interrupt them there and abort.
    os._exit(code)


if __name__ == "__main__":
    main()
