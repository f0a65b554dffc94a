"""What `vistel up` shows while a conference runs: one table of its sites, and a line for each event."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from vistel.conference.device_list import devices_of_site
from vistel.conference.model import Conference
from vistel.conference.simulators import cause
from vistel.v1.device_pb2 import DeviceStatus
from vistel_cli.run.logged_errors import LoggedErrors
from vistel_cli.run.observer import Observer

LEGEND = "delay: from a movement to its picture · devices: how many send"
LEGEND_OF_VOICES = " · voices: who is heard how late, and how much later (+) than the picture"
GARBAGE_BYTES = 256
"""A device that sends so many useless bytes more is an event."""


class Events:
    """What happens in a running conference, each told once: devices that fail and come back, people who join and leave, what is
    said to the room, what is wrong with its sound, what its processes log as errors."""

    def __init__(self, observer: Observer, errors: LoggedErrors | None = None) -> None:
        self._observer, self._errors = observer, errors
        self._states = {d: _state(s) for d, s in observer.devices.items() if _sends(s)}
        self._skipped = {d: s.bytes_skipped for d, s in observer.devices.items()}
        self._people = _seen(observer)
        self._warnings: set[str] = set()
        self._added: list[str] = []

    def add(self, event: str) -> None:
        """One that somebody else saw. While a table stands in the terminal, nothing is printed past it."""
        self._added.append(event)

    def everybody_is_there(self) -> None:
        """Who is seen now has not joined while the conference goes on."""
        self._people = _seen(self._observer)

    def new(self) -> Iterator[str]:
        """The events since the last call."""
        yield from self.troubles()
        people = _seen(self._observer)
        yield from (f"{name} joined" for name in sorted(people - self._people))
        yield from (f"{name} left" for name in sorted(self._people - people))
        self._people = people
        yield from self._observer.sound.new_captions()

    def troubles(self, simulated: Collection[str] = ()) -> Iterator[str]:
        """What fails, and what works again. simulated: devices of which nothing is told, for they are still being started."""
        added, self._added = self._added, []
        yield from added
        alike: dict[str, list[str]] = {}
        for device, status in self._observer.devices.items():
            for what in self._of_device(device, status) if device not in simulated else ():
                alike.setdefault(what, []).append(device)
        yield from (_of_several(devices, what) for what, devices in alike.items())
        warnings = {f"{site}: {w}" for site in self._observer.images for w in self._observer.sound.warnings(site)}
        yield from sorted(warnings - self._warnings)
        self._warnings = warnings
        if self._errors is not None:
            yield from self._errors.new()

    def _of_device(self, device: str, status: DeviceStatus) -> Iterator[str]:
        now, before = _state(status), self._states.get(device)
        if now == "absent" or (before, now) == ("absent", "streaming"):  # who joins and leaves is told as a person
            self._states[device] = now
        elif now != before and not (now == "starting" and before != "streaming"):  # what fails is started again and again
            if now == "streaming" and before is not None:
                yield "sends again"
            elif now == "starting":
                yield "is starting"
            elif now != "streaming" and before in (None, "streaming", "starting", "absent"):
                yield f"fails: {cause(status) or now}"
            self._states[device] = now
        more = status.bytes_skipped - min(self._skipped.setdefault(device, status.bytes_skipped), status.bytes_skipped)
        if more >= GARBAGE_BYTES:
            yield f"sent {more} bytes that are no frame"
        if more >= GARBAGE_BYTES or status.bytes_skipped < self._skipped[device]:
            self._skipped[device] = status.bytes_skipped


class LiveTable:
    """The table, in place on a terminal and nowhere else; events go above it. Use it in a `with`."""

    def __init__(
        self, conference: Conference, observer: Observer, events: Events, console: Console, seconds: float, *, silent: bool
    ) -> None:
        """events: of `observer`. seconds: how long the conference lasts; 0: until it is stopped. silent: show nothing."""
        self._conference, self._observer, self._console, self._seconds = conference, observer, console, seconds
        self._events = events
        self._silent = silent
        self._live = Live(console=console, auto_refresh=False, transient=True)

    def __enter__(self) -> LiveTable:
        self._events.everybody_is_there()
        if not self._silent and self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._live.stop()

    def update(self, elapsed_s: float) -> None:
        """Show how things are now."""
        if self._silent:
            return
        for event in self._events.new():
            self._console.print(self._line(_clock(elapsed_s), event), soft_wrap=not self._console.is_terminal)
        if not self._console.is_terminal:
            return
        length = f"{_clock(elapsed_s)} of {_clock(self._seconds)}" if self._seconds else _clock(elapsed_s)
        legend = LEGEND + (LEGEND_OF_VOICES if _sounds(self._conference, self._observer) else "")
        below = Text(f"{length}, Ctrl-C ends it\n{legend}", style="dim")
        self._live.update(Group(sites_table(self._conference, self._observer), below), refresh=True)

    def _line(self, clock: str, event: str) -> RenderableType:
        """An event after its time; on a terminal, further lines of it stand below the first."""
        if not self._console.is_terminal:
            return Text.assemble((f"{clock}  ", "dim"), event)
        line = Table.grid(padding=(0, 2, 0, 0))
        line.add_column(no_wrap=True, style="dim")
        line.add_column(overflow="fold")
        line.add_row(clock, Text(event))
        return line


def sites_table(conference: Conference, observer: Observer) -> RenderableType:
    """A row for each site, at most 60 characters wide where no voices are."""
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(overflow="ellipsis", no_wrap=True, max_width=16)
    for _ in range(3):
        table.add_column(justify="right", no_wrap=True)
    voices = _sounds(conference, observer)
    table.add_column(overflow="fold")
    table.add_row("site", "pictures/s", "delay", "devices", "voices" if voices else "", style="bold")
    for site in conference.sites:
        image = observer.images.get(site.name)
        delay_s = max((s.delay_s for s in image.streams), default=0.0) if image else 0.0
        devices = [d.name for d in devices_of_site(site) if _state(observer.devices.get(d.name, DeviceStatus())) != "absent"]
        sending = sum(d in observer.devices and _sends(observer.devices[d]) for d in devices)
        table.add_row(
            site.name,
            f"{image.frames_per_s:.1f}" if image else "-",
            f"{delay_s * 1e3:.0f} ms" if delay_s else "-",
            Text(f"{sending} of {len(devices)}" if devices else "-", "" if sending == len(devices) else "yellow"),
            (", ".join(observer.sound.heard(site.name)) or "-") if voices else "",
        )
    return table


def _of_several(devices: list[str], what: str) -> str:
    """An event of devices to which the same happened at the same time; what: "sends again"."""
    if len(devices) == 1:
        return f"{devices[0]} {what}"
    verb, _, rest = what.partition(" ")
    plural = {"sends": "send", "is": "are", "fails:": "fail:"}.get(verb, verb)
    last = devices[-1] if len(devices) < 4 else f"{len(devices) - 2} more devices"
    return f"{', '.join(devices[: min(len(devices) - 1, 2)])} and {last} {plural} {rest}"


def _sounds(conference: Conference, observer: Observer) -> bool:
    """Whether anybody may be heard."""
    return any(s.audio is not None or observer.sound.heard(s.name) for s in conference.sites)


def _sends(status: DeviceStatus) -> bool:
    return status.state == DeviceStatus.STATE_STREAMING


def _state(status: DeviceStatus) -> str:
    return DeviceStatus.State.Name(status.state).removeprefix("STATE_").lower()


def _seen(observer: Observer) -> set[str]:
    """Who is in the picture of a site."""
    return {s.participant for image in observer.images.values() for s in image.streams}


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"
