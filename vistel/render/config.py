"""What pictures of a site show, as its conference file says."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from vistel.conference.model import Conference, Site
from vistel.conference.model import RoomConfig as RoomKeys
from vistel.conference.seats import seat_place
from vistel.render.figures.people import files_of
from vistel.render.stage.arrivals import AdaptiveDelay
from vistel.render.view.screens import RoomScreen, Stereo, picture_size
from vistel.render.view.view import View


@dataclass(frozen=True)
class RenderConfig:
    """view: what the picture is of; seats: of the room; delay_s: playout behind capture, in live pictures only where `adaptive`
    is None; avatars: files of participants; room: what the conference file says of the room, where files hold some of it."""

    view: View
    seats: int
    delay_s: float
    avatars: Mapping[str, Path] = field(default_factory=lambda: MappingProxyType({}))
    room: RoomKeys | None = None
    adaptive: AdaptiveDelay | None = None

    @property
    def live_delay(self) -> int | AdaptiveDelay:
        """The delay of live pictures, fixed [ns] or following the network."""
        return self.adaptive or round(self.delay_s * 1e9)


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
    p = conference.playout
    adaptive = AdaptiveDelay(p.in_time, round(p.least * 1e9), round(p.most * 1e9)) if p.delay == "auto" else None
    return RenderConfig(view, conference.room.seats, p.recorded_s, files_of(conference), room, adaptive)
