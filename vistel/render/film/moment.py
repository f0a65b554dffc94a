"""One picture of a log: what a site saw at a time."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vistel.conference.model import Conference
from vistel.render.config import render_config
from vistel.render.film.film import film, records_of
from vistel.render.still import Picture
from vistel.wire.log import LogReader

_RATE = 25.0
"""Pictures a second of the film of one picture: how far behind it the log is read."""


def moment(reader: LogReader, t_ns: int, site: str | None, size: tuple[int, int]) -> Picture:
    """The picture of `site`, or of the conference file's first one, at conference time `t_ns`, `size` pixels wide and high.

    Raises ValueError (one line) for a log without a conference file, or one without the site; NoOpenGlError.
    """
    if reader.conference is None:
        raise ValueError(f"{reader.path}: holds no conference file, so nothing tells what its sites looked like")
    conference = Conference.model_validate(_shown(reader.conference, size))
    sites = {s.name: s for s in conference.sites}
    name = site or next(iter(sites))
    if name not in sites:
        raise ValueError(f"{reader.path}: no site is called {name!r}; there are {', '.join(sites)}")
    until_ns = t_ns + round(1e9 / _RATE)
    pictures = film(render_config(conference, sites[name]), records_of(reader, t_ns, until_ns), t_ns, until_ns, _RATE)
    return Picture(np.ascontiguousarray(next(pictures).rgba[::-1, :, :3]))


def _shown(data: Mapping[str, Any], size: tuple[int, int]) -> dict[str, Any]:
    """A conference file as data, with displays of this size in place of walls and windows."""
    display: dict[str, Any] = {"width": size[0], "height": size[1], "window": False, "screens": []}
    return {**data, "sites": [{**s, "display": {**s.get("display", {}), **display}} for s in data["sites"]]}
