"""`vistel replay --render`: draws a log as films, picture by picture, however long each takes."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from vistel.conference.model import Conference
from vistel.wire.log import LogReader
from vistel_cli.terminal import FAILED, USAGE, fail, out
from vistel_cli.waiting import progress, waiting

if TYPE_CHECKING:
    from vistel.render.film.film import FilmPicture


@dataclass(frozen=True)
class FilmSettings:
    """size: pixels, None: the site's; rate: pictures per second; finer: samples per pixel in each direction; png: one file
    for each picture instead of a film; view: "seat" or "room", None: the site's; light: "fast" or "fine"; speed: 1 is real time;
    names: over people's heads."""

    size: tuple[int, int] | None
    rate: float
    finer: int
    png: bool
    view: str | None
    light: str
    speed: float = 1.0
    names: bool = True


def size_of(text: str | None) -> tuple[int, int] | None:
    """Pixels of "1280x720"; ends the command with one line for any other text."""
    if text is None:
        return None
    found = re.fullmatch(r"(\d{2,5})x(\d{2,5})", text)
    if not found or not all(16 <= int(n) <= 16384 for n in found.groups()):
        fail(f"--size {text}: expected width and height from 16 to 16384, such as 1280x720", USAGE)
    return int(found[1]), int(found[2])


def render_log(
    reader: LogReader, conference: Conference, sites: list[str], begin_ns: int, end_ns: int, look: FilmSettings, folder: Path
) -> None:
    """Write SITE.mp4 (or SITE/00000.png ...) for each of `sites` into `folder`."""
    with waiting("loading"):  # the mathematics
        from vistel.render import NoOpenGlError

    try:
        for name in sites:
            _render_site(reader, _shown(conference, name, look), name, begin_ns, end_ns, look, folder)
    except (NoOpenGlError, ValueError) as e:
        fail(str(e), FAILED)
    except OSError as e:
        fail(f"{e.filename or folder}: cannot be written: {e.strerror}", FAILED)


def _shown(conference: Conference, name: str, look: FilmSettings) -> Conference:
    """The conference with the site's display as asked."""
    data = conference.model_dump(mode="json", exclude_none=True)
    display = next(s["display"] for s in data["sites"] if s["name"] == name)
    display |= {"video": True, "window": False, "light": look.light}
    if look.size is not None:
        display |= {"width": look.size[0], "height": look.size[1]}
    if look.view is not None:
        display["view"] = look.view
    if look.size is not None or look.view is not None:
        display["screens"] = []
    return Conference.model_validate(data)


def _render_site(
    reader: LogReader, conference: Conference, name: str, begin_ns: int, end_ns: int, look: FilmSettings, folder: Path
) -> None:
    with waiting("loading"):
        from vistel.render.config import render_config
        from vistel.render.film.film import count_of, film, records_of
        from vistel.render.film.sound import FilmSound
        from vistel.render.film.video import FILM, VideoWriter

    site = next(s for s in conference.sites if s.name == name)
    config = render_config(conference, site)
    config = replace(config, view=replace(config.view, names=look.names))
    rate = look.rate / look.speed  # in a second of the log
    count = count_of(begin_ns, end_ns, rate)
    voices: FilmSound | None = None
    if not look.png and look.speed == 1.0 and next(reader.records(topics=("voice",)), None) is not None:
        seated = config.view.kind == "seat" or bool(config.view.screens)
        spatial = site.audio is None or site.audio.spatial != "off"
        voices = FilmSound(begin_ns, config.delay_s, config.view.eyes if seated else None, spatial)
    pictures = film(config, records_of(reader, begin_ns, end_ns), begin_ns, end_ns, rate, look.finer, voices)
    with progress(f"drawing {count} pictures of {name}") as tell:
        if look.png:
            target = folder / name
            target.mkdir(exist_ok=True)
            for n, picture in enumerate(pictures):
                _write_png(target / f"{n:05d}.png", picture)
                tell((n + 1) / count)
        else:
            target = folder / f"{name}.mp4"
            writer = VideoWriter(target, config.view.width, config.view.height, look.rate, voices is not None, FILM, look.speed)
            try:
                for n, picture in enumerate(pictures):
                    for heard in picture.sounds:
                        writer.put_sound(*heard)
                    if not writer.put_waiting(picture.t_ns, picture.rgba):
                        fail(f"{target}: cannot be written; is the disk full?", FAILED)
                    tell((n + 1) / count)
            finally:
                writer.close()
    out.print(f"  {target}  {count} pictures at {look.rate:g}/s, {config.view.width}x{config.view.height}", soft_wrap=True)


def _write_png(path: Path, picture: FilmPicture) -> None:
    from PIL import Image

    Image.fromarray(picture.rgba[::-1, :, :3]).save(path, compress_level=4)
