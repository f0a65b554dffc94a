"""What pictures of a site show, as its conference file says."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from vistel.conference.model import Conference, PlayoutConfig, Site
from vistel.conference.model import RoomConfig as RoomKeys
from vistel.conference.seats import seat_place
from vistel.render.figures.people import files_of
from vistel.render.stage.arrivals import AdaptiveDelay
from vistel.render.view.screens import RoomScreen, Stereo, picture_size
from vistel.render.view.view import View


@dataclass(frozen=True)
class RenderConfig:
    """view: what the picture is of; seats: of the room; delay_s: playout of films behind capture; avatars: files of participants;
    room: what the conference file says of the room, where files hold some of it; live_delay: playout of live pictures, fixed [ns]
    or following the network; None: as in films; own: who sees themselves without it.
    """

    view: View
    seats: int
    delay_s: float
    avatars: Mapping[str, Path] = field(default_factory=lambda: MappingProxyType({}))
    room: RoomKeys | None = None
    live_delay: int | AdaptiveDelay | None = None
    own: frozenset[str] = frozenset()


def live_delay(playout: PlayoutConfig) -> int | AdaptiveDelay:
    """How late live pictures show a motion: fixed [ns] or following the network."""
    if playout.delay != "auto":
        return round(playout.delay * 1e9)
    least_ns, most_ns, predict_ns = (round(1e9 * s) for s in (playout.least, playout.most, playout.predict))
    return AdaptiveDelay(playout.in_time, least_ns, most_ns, predict_ns)


def render_config(conference: Conference, site: Site) -> RenderConfig:
    """What pictures of `site` show."""
    display, viewer = site.display, site.participants[0].name
    seat = seat_place(conference.room, conference.seat_of(viewer))
    screens, stereo = tuple(RoomScreen.placed(s, *seat) for s in display.screens), Stereo(display.stereo)
    width, height = picture_size(screens, stereo) if screens else (stereo.widths * display.width, display.height)
    view = View(
        width,
        height,
        display.view,
        viewer,
        display.engine,
        display.layers,
        screens,
        stereo,
        display.eye_distance,
        display.convergence,
        display.wrinkles,
        display.light,
        display.gauges,
    )
    room = conference.room if conference.room.from_files else None
    playout = conference.playout
    own = frozenset(() if playout.own_waits else (p.name for p in site.participants))
    return RenderConfig(view, conference.room.seats, playout.recorded_s, files_of(conference), room, live_delay(playout), own)
