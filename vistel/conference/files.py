"""Reading a conference file; every error names file, line, key and what was expected."""

from pathlib import Path
from typing import Any

import tomli_w
from pydantic import ValidationError

from vistel.conference.devices import CameraConfig
from vistel.conference.model import Conference, Participant, RoomConfig, Tls
from vistel.conference.page_address import StreamTls
from vistel.conference.speech import Speech
from vistel.toml import file as toml
from vistel.toml.faults import faults_of


class ConferenceError(ValueError):
    """A conference file that cannot be used; the text is one line per fault: file:line: key: what was expected."""


DEMO_FILE = Path(__file__).with_name("demo.toml")
"""The conference that runs when no file is named."""


def load(path: Path, *, room_elsewhere: bool = False) -> Conference:
    """Read and check a conference file. room_elsewhere: the room's file may be missing here because the world's site has it; then
    the seats are not known. Raises ConferenceError."""
    source_file = toml.read(path, ConferenceError)
    conference = _with_room_kept(_with_files(source_file.checked(Conference, ConferenceError), path.parent), path)
    room = conference.room.file
    try:
        if room is not None and (room.is_file() or not room_elsewhere):
            conference = with_seats(conference)
    except ValidationError as e:
        raise ConferenceError(source_file.described(faults_of(e, Conference, source_file.tables))) from e
    except ConferenceError as e:
        raise ConferenceError(source_file.described(str(e).splitlines())) from e
    if faults := _room_faults(conference):
        raise ConferenceError(source_file.described(faults))
    return conference


def text_of(conference: Conference) -> str:
    """The conference as the text of a file."""
    return tomli_w.dumps(conference.model_dump(mode="json", exclude_none=True))


def write_conference(conference: Conference, folder: Path) -> Path:
    """Write the conference as a file for its processes. Returns its path. A room that the file keeps nowhere ends with the run."""
    path = folder / "conference.toml"
    if conference.world.folder is None:
        conference = conference.model_copy(update={"world": conference.world.model_copy(update={"folder": folder / "room"})})
    path.write_text(text_of(conference), "utf-8")
    return path


def text_without_tokens(file: dict[str, Any], but_of: str = "") -> str:
    """What a conference's file holds, as others may see it: a page that asks for a token is left out with it, but for that of the
    site `but_of`."""
    shared = dict(file)
    if shared.get("console", {}).get("token"):
        del shared["console"]
    shared["sites"] = [site if site["name"] == but_of else _without_page(site) for site in file.get("sites", [])]
    return tomli_w.dumps(shared)


def _without_page(site: dict[str, Any]) -> dict[str, Any]:
    display = site.get("display", {})
    if not display.get("stream_token"):
        return site
    return {**site, "display": {key: value for key, value in display.items() if not key.startswith("stream")}}


def _with_room_kept(conference: Conference, path: Path) -> Conference:
    """With the folder in which the room is kept. The demo's own file has none beside it: its room begins anew each time."""
    world = conference.world
    if world.folder is None and path == DEMO_FILE:
        return conference
    folder = (path.parent / (world.folder or f"{path.stem}-room")).resolve()
    return conference.model_copy(update={"world": world.model_copy(update={"folder": folder})})


def _room_faults(conference: Conference) -> list[str]:
    if not conference.room.things and not any(s.props for s in conference.sites):
        return []
    from vistel.conference.room_things import faults_of  # loads the mathematics; only for who has things

    return faults_of(conference)


def with_seats(conference: Conference) -> Conference:
    """The conference with as many seats as its room's file has, if it has any. Raises ConferenceError, ValidationError."""
    from vistel.conference.seats import seats_of  # loads the mathematics
    from vistel.space.files.faults import RoomFileError

    try:
        count = len(seats_of(conference.room))
    except RoomFileError as e:
        raise ConferenceError(f"room.file: {e}") from e
    room = conference.room.model_copy(update={"seats": count})
    return Conference.model_validate(conference.model_copy(update={"room": room}).model_dump())


def _with_files(conference: Conference, folder: Path) -> Conference:
    """Files that lie in or below the conference file's folder by their whole path; others may be elsewhere."""
    sites = [
        s.model_copy(
            update={
                "participants": [_person_with_files(p, folder) for p in s.participants],
                "speech": s.speech and _speech_with_files(s.speech, folder),
                "display": s.display.model_copy(update={"stream_tls": _stream_tls(s.display.stream_tls, folder)}),
            }
        )
        for s in conference.sites
    ]
    bus = conference.bus.model_copy(update={"tls": conference.bus.tls and _tls_with_files(conference.bus.tls, folder)})
    console = conference.console.model_copy(update={"tls": _stream_tls(conference.console.tls, folder)})
    room = _room_with_files(conference.room, folder)
    return conference.model_copy(update={"bus": bus, "sites": sites, "room": room, "console": console})


def _tls_with_files(tls: Tls, folder: Path) -> Tls:
    if tls.folder is not None:
        return Tls(folder=(folder / tls.folder).resolve())
    return Tls(ca=_beside(tls.ca, folder), certificate=_beside(tls.certificate, folder), key=_beside(tls.key, folder))


def _stream_tls(tls: StreamTls | None, folder: Path) -> StreamTls | None:
    return tls and tls.model_copy(update={key: _beside(path, folder) for key, path in tls})


def _room_with_files(room: RoomConfig, folder: Path) -> RoomConfig:
    things = [t.model_copy(update={"file": _beside(t.file, folder)}) for t in room.things]
    return room.model_copy(update={"file": _beside(room.file, folder), "things": things})


def _speech_with_files(speech: Speech, folder: Path) -> Speech:
    voices = speech.voices and (folder / speech.voices if (folder / speech.voices).is_dir() else speech.voices)
    model = speech.model and _beside(speech.model, folder)
    return speech.model_copy(update={"grammar": [_beside(g, folder) for g in speech.grammar], "voices": voices, "model": model})


def _person_with_files(person: Participant, folder: Path) -> Participant:
    update: dict[str, Any] = {"avatar": _avatar_file(person.avatar, folder)}
    for name, camera in (("face", person.face), ("eye", person.eye)):
        if camera is not None:
            update[name] = camera.model_copy(update=_camera_files(camera, folder))
    update["body"] = _beside(person.body, folder)
    update["gloves"] = {s: g.model_copy(update={"calibration": _beside(g.calibration, folder)}) for s, g in person.gloves.items()}
    if person.tracker is not None:
        t = person.tracker
        found = {"calibration": _beside(t.calibration, folder), "distortion": _beside(t.distortion, folder)}
        update["tracker"] = t.model_copy(update=found)
    return person.model_copy(update=update)


def _beside(path: Path | None, folder: Path) -> Path | None:
    return (folder / path).resolve() if path is not None and (folder / path).is_file() else path


def _camera_files(camera: CameraConfig, folder: Path) -> dict[str, Any]:
    out: dict[str, Any] = {}
    out["calibration"] = _beside(camera.calibration, folder)
    if (folder / camera.source).is_file():
        out["source"] = str((folder / camera.source).resolve())
    return out


def public_avatar(avatar: str) -> str:
    """An avatar as other sites know it: a file's name without its folder."""
    return avatar if avatar.startswith("builtin") else Path(avatar).name


def _avatar_file(avatar: str, folder: Path) -> str:
    if avatar.startswith("builtin") or not (folder / avatar).is_file():
        return avatar
    return str((folder / avatar).resolve())
