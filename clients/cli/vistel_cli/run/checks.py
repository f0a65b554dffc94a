"""What of a conference cannot run on this machine, found before anything starts: files, motions and ports."""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from vistel.conference.device_list import devices_of_site
from vistel.conference.files import ConferenceError
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.page_address import page_at
from vistel.toml import file as toml
from vistel.toml.faults import Fault
from vistel.toml.places import Place, written
from vistel.wire.zenoh.endpoints import host_and_port
from vistel_cli import kind_of_file as kinds
from vistel_cli.inputs import Takes
from vistel_cli.run.prepared import is_prepared

_MEASURED = Takes(kinds.CALIBRATION, kinds.JSON)
_KINDS = {
    "grammar": Takes(kinds.GRAMMAR),
    "calibration": _MEASURED,
    "body": _MEASURED,
    "distortion": _MEASURED,
    "file": Takes(kinds.USD, kinds.GLTF, kinds.OBJ),
    "voices": Takes(kinds.FOLDER),
}
"""What files are expected to be, by the key that names them; others must only be there."""
_ROOM: Place = ("room", "file")
Sites = Sequence[tuple[int, Site]]
"""Those that run here, each after its number in the file."""
Port = tuple[Place, int, str, int]
"""Place, kind, host and number."""
_USED = "is in use by another program; end that, or name another port"


def faults_of(conference: Conference, source: Path, site: str | None = None) -> list[str]:
    """One line for each fault: FILE:LINE: KEY: what is wrong and how to mend it. source: the conference's file. site: the only one
    that runs here; files and ports of the room, the hub and the others are on other machines."""
    source_file = toml.read(source, ConferenceError)
    here = [(i, s) for i, s in enumerate(conference.sites) if site in (None, s.name)]
    faults = [f for f in _file_faults(conference) if site is None or f.place[:2] in [("sites", i) for i, _ in here]]
    if any(fault.place == _ROOM for fault in faults):  # the rest is as wrong without it
        conference = conference.model_copy(update={"room": conference.room.model_copy(update={"file": None})})
    faults += [
        *_people_faults(here, made=is_prepared(conference, draws=True)),
        *_motion_faults(conference, here),
        *_port_faults(conference, here, whole=site is None),
    ]
    faults.sort(key=lambda fault: source_file.line(fault.place, fault.text) or 0)
    return source_file.described(faults).splitlines()


def _file_faults(conference: Conference) -> Iterator[Fault]:
    for place, path in _paths(conference, ()):
        if place == ("world", "folder"):  # it is made
            continue
        key = next(str(part) for part in reversed(place) if isinstance(part, str))
        fault = _KINDS[key].fault(path) if key in _KINDS else _missing(path)
        if fault:
            yield _of_file(place, path, fault)


def _paths(value: Any, place: Place) -> Iterator[tuple[Place, Path]]:
    """Every file or folder that is named anywhere in a value, and its place."""
    if isinstance(value, Path):
        yield place, value
    elif isinstance(value, BaseModel):
        for key in type(value).model_fields:
            yield from _paths(getattr(value, key), (*place, key))
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _paths(inner, (*place, key))
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for number, inner in enumerate(value):
            yield from _paths(inner, (*place, number))


def _of_file(place: Place, name: Path | str, fault: str) -> Fault:
    """A fault whose text begins with a file's name: in quotation marks, for it is no key."""
    return Fault(place, f'"{name}"{fault.removeprefix(str(name))}')


def _missing(path: Path) -> str | None:
    return None if path.exists() else Takes().fault(path)


def _people_faults(sites: Sites, *, made: bool) -> Iterator[Fault]:
    """Avatars, cameras' films and microphones' recordings, which the file gives as text. made: the built-in people were made from
    what the file says, so it is right; to read it takes as long as to load the body model."""
    for s, site in sites:
        for p, person in enumerate(site.participants):
            place = ("sites", s, "participants", p)
            if not (made and person.avatar.startswith("builtin")):
                yield from _avatar_faults((*place, "avatar"), person)
            for key, camera in (("face", person.face), ("eye", person.eye)):
                if (
                    camera
                    and Path(camera.source).suffix
                    and "://" not in camera.source
                    and (fault := _missing(Path(camera.source)))
                ):
                    yield _of_file((*place, key, "source"), camera.source, fault)
        sounds = {("microphone",): site.audio.microphone} if site.audio else {}
        sounds |= {("microphones", name): one for name, one in site.audio.microphones.items()} if site.audio else {}
        for key, sound in sounds.items():
            if sound.lower().endswith(".wav") and (fault := Takes(kinds.SOUND).fault(Path(sound))):
                yield _of_file(("sites", s, "audio", *key), sound, fault)


def _avatar_faults(place: Place, person: Participant) -> Iterator[Fault]:
    from vistel.conference.avatar_files import avatar_file
    from vistel.figure.people.builtin import described

    path = avatar_file(person)
    try:
        if path is None:
            described(person.avatar, person.name, person.height)
        elif fault := Takes(kinds.USD).fault(path):
            beside = "; put it beside the conference file" if not path.exists() else ""
            yield _of_file(place, person.avatar, fault.removeprefix(str(path)) + beside)
    except ValueError as e:
        yield Fault(place, str(e).removeprefix("avatar "))


def _motion_faults(conference: Conference, sites: Sites) -> Iterator[Fault]:
    people = [
        (("sites", s, "participants", p, "motion"), person.motion)
        for s, site in sites
        for p, person in enumerate(site.participants)
        if person.motion is not None
    ]
    if not people:
        return
    from vistel_sim.motion import MotionError, open_motion  # loads the mathematics

    for motion, place in {motion: place for place, motion in reversed(people)}.items():
        path = Path(motion)
        if path.suffix and (fault := Takes(kinds.BVH, kinds.FOLDER).fault(path)):
            yield _of_file(place, path, fault)
            continue
        try:
            open_motion(_moved_by(conference, motion))
        except MotionError as e:
            yield _of_file(place, motion, str(e))


def _moved_by(conference: Conference, motion: str) -> Conference:
    """The conference in which nobody has another motion."""
    data = conference.model_dump(mode="json", exclude_none=True)
    for site in data["sites"]:
        for person in site["participants"]:
            if person.get("motion") != motion:
                person.pop("motion", None)
    return Conference.model_validate(data)


def _port_faults(conference: Conference, sites: Sites, *, whole: bool) -> Iterator[Fault]:
    """Ports are opened for a moment, all at the same time: two that are the same are found, too."""
    if whole and conference.bus.mode == "routed" and not conference.bus.endpoints:
        yield Fault(("bus",), "endpoints: is missing; name the conference's router, such as tcp/192.0.2.7:7447")
    taken: dict[tuple[int, int], Place] = {}
    with ExitStack() as opened:
        for place, kind, host, port in [*(_hub_ports(conference) if whole else ()), *_ports(sites)]:
            if (kind, port) in taken:
                yield Fault(place, f"port {port} is that of {written(taken[kind, port])}, too; name another port")
                continue
            taken[kind, port] = place
            fault = _port_fault(opened, kind, host, port)
            if fault:
                yield Fault(place, f"{'UDP ' if kind == socket.SOCK_DGRAM else ''}port {port} {fault}")


def ports_of(conference: Conference) -> set[int]:
    """The TCP ports that a file names for what runs here."""
    ports = [*_hub_ports(conference), *_ports(list(enumerate(conference.sites)))]
    return {port for _, kind, _, port in ports if kind == socket.SOCK_STREAM}


def _hub_ports(conference: Conference) -> Iterator[Port]:
    """Those of the router and of the console."""
    if conference.bus.mode == "embedded" and conference.bus.endpoints:
        kind = socket.SOCK_DGRAM if conference.bus.endpoints[0].startswith("quic/") else socket.SOCK_STREAM
        yield ("bus", "endpoints", 0), kind, *host_and_port(conference.bus.endpoints[0])
    if (console := page_at(conference.console.at)) and console[1]:
        yield ("console", "at"), socket.SOCK_STREAM, *console


def _ports(sites: Sites) -> Iterator[Port]:
    """Those of pages for browsers, and those to which phones and tracking suites send."""
    for s, site in sites:
        if site.draws and site.display.stream_at and site.display.stream_at[1]:
            yield ("sites", s, "display", "stream"), socket.SOCK_STREAM, *site.display.stream_at
        for device in devices_of_site(site):
            if "udp" in device.kind.connections and device.port.isdecimal():
                key = "face" if device.kind.role == "face" else "tracker"
                p = site.participants.index(device.participant) if device.participant else 0
                yield (
                    ("sites", s, "participants", p, key, "port"),
                    socket.SOCK_DGRAM,
                    getattr(device.config, "listen", "0.0.0.0"),
                    int(device.port),
                )


def _port_fault(opened: ExitStack, kind: int, host: str, port: int) -> str:
    try:
        family, _, _, _, address = socket.getaddrinfo(host or None, port, type=kind, flags=socket.AI_PASSIVE)[0]
        one = opened.enter_context(socket.socket(family, kind))
        if kind == socket.SOCK_STREAM:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # what a program that has ended left behind is free
        one.bind(address)
    except PermissionError:
        return "may not be opened by you; name one above 1023"
    except OSError as e:
        return _USED if e.errno == errno.EADDRINUSE else f"cannot be opened at {host}: {e.strerror or e}"
    return ""
