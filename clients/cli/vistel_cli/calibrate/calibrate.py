"""`vistel calibrate`: measures people and devices once. One module for each command."""

from __future__ import annotations

import typer

from vistel_cli.calibrate import distortion as calibrate_distortion
from vistel_cli.calibrate import face as calibrate_face
from vistel_cli.calibrate import gaze as calibrate_gaze
from vistel_cli.calibrate import glove as calibrate_glove
from vistel_cli.calibrate import person as calibrate_person

app = typer.Typer(help="Measure people and devices. The results are files that a conference uses.", no_args_is_help=True)
app.command("tracker")(calibrate_person.tracker)
app.command("body")(calibrate_person.body)
app.command("glove")(calibrate_glove.glove)
app.command("distortion")(calibrate_distortion.distortion)
app.command("face")(calibrate_face.face)
app.command("gaze")(calibrate_gaze.gaze)
