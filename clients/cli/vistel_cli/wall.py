"""`vistel wall`: draws the calibration picture of a wall of screens."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from PIL import Image

from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.overwriting import Force, keep_existing, out_file
from vistel_cli.terminal import FAILED, USAGE, fail, load_conference, out
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def wall(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="A conference file (TOML) with \\[\\[sites.display.screens]].")],
    site: Annotated[str | None, typer.Option(help="Site of the wall; default: the first site that has one.")] = None,
    output: Annotated[Path | None, out_file("PNG to write; default: wall.png.")] = None,
    show: Annotated[bool, typer.Option("--show", help="Show the picture in a window until the window is closed.")] = False,
    force: Force = False,
) -> None:
    """Draw the calibration picture of a wall of screens, for eyes 1.2 m over the viewer's seat.

    Each screen shows a decimetre grid and a ring for its size, and steps of grey and colours for its light. Lines run over
    all screens. They are straight across the seams only if the corners in the file are right.

    [bold]Examples[/bold]

      vistel wall examples/conferences/v-wall.toml -o wall.png

      vistel wall examples/conferences/v-wall.toml --site tokyo --show
    """
    from vistel.conference.seats import seat_place

    with waiting("loading"):
        from vistel.render.config import render_config
        from vistel.render.view.wall_pattern import eyes_at, pattern

    conference = load_conference(file)
    walls = [s for s in conference.sites if s.display.screens]
    if site is not None and site not in [s.name for s in conference.sites]:
        fail(f"--site {site}: not in {file}; there are {', '.join(s.name for s in conference.sites)}", USAGE)
    chosen = next((s for s in walls if site in (None, s.name)), None)
    if chosen is None:
        fail(f"{file}: {site or 'no site'} has {'no ' if site else ''}[[sites.display.screens]]; see how-to/wall-of-screens")
    view = render_config(conference, chosen).view
    seat = seat_place(conference.room, conference.seat_of(view.eyes))
    picture = pattern(view.screens, eyes_at(*seat, view.eye_distance), view.stereo)
    if show:
        _show(picture, f"VISTEL {chosen.name}: wall")
        return
    if output is None:
        output = Path("wall.png")
        keep_existing(output, force=force)
    try:
        Image.fromarray(picture).save(output)
    except (OSError, ValueError) as e:
        fail(f"{output}: cannot be written: {e}", FAILED)
    out.print(f"  {output}  {chosen.name}: {len(view.screens)} screens, {picture.shape[1]}x{picture.shape[0]}", soft_wrap=True)


def _show(picture: NDArray[np.uint8], title: str) -> None:
    from vistel.render import NoOpenGlError  # loads the mathematics
    from vistel_services.renderer.window.presenter import show_picture

    try:
        shown = show_picture(picture, title)
    except NoOpenGlError as e:
        fail(str(e), FAILED)
    if not shown:
        fail("no window could be opened here; without --show the picture goes into a file", FAILED)
