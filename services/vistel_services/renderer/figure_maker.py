"""Has a built-in person made by a process of its own: in a thread of the renderer, pictures would wait for it, for seconds at a
time."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from vistel.figure.people.builtin import is_made
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.people import load_figure
from vistel.render.stage.stage import ParticipantInfo

log = logging.getLogger("vistel.renderer")


def load_apart(about: ParticipantInfo, files: Mapping[str, Path], parcel: Callable[[str], bytes]) -> AvatarFigure:
    """As `load_figure`. Where the process cannot make the person, this one does."""
    if about.avatar.startswith("builtin") and not is_made(about.avatar, name=about.name, height=about.height):
        code = subprocess.run(command(about, os.getpid()), stdin=subprocess.DEVNULL, check=False).returncode
        if code != 0:
            log.warning("event=figure_not_made_apart participant=%s exit_code=%d", about.name, code)
    return load_figure(about, files, parcel)


def command(about: ParticipantInfo, parent: int) -> list[str]:
    """What makes the person of `about`, and ends when the process `parent` does."""
    return [sys.executable, "-m", "vistel.render.figures.make_person", about.avatar, about.name, repr(about.height), str(parent)]
