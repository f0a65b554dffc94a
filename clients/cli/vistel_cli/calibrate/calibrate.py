"""`vistel calibrate`: measures people and devices once. One module for each command."""

import typer

from vistel_cli.lazy import Lazy, lazy_group

LATER = {
    "tracker": Lazy("vistel_cli.calibrate.person:tracker"),
    "body": Lazy("vistel_cli.calibrate.person:body"),
    "glove": Lazy("vistel_cli.calibrate.glove:glove"),
    "distortion": Lazy("vistel_cli.calibrate.distortion:distortion"),
    "face": Lazy("vistel_cli.calibrate.face:face"),
    "gaze": Lazy("vistel_cli.calibrate.gaze:gaze"),
}
app = typer.Typer(cls=lazy_group(LATER), no_args_is_help=True)


@app.callback()
def calibrate() -> None:
    """Measure people and devices, into files for a conference."""
