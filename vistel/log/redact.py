"""A log without the people in it: their names, voices, words, faces and likenesses go, and what they did stays.

What is kept is named here, topic by topic; everything else is left out, so that what later versions record is not passed on
unseen. The world's own state of each second (`world_inputs`) goes too: a redacted log is played, drawn, studied and computed anew
from its devices or motions, and not verified bit for bit.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import tomli_w
from google.protobuf.descriptor import FieldDescriptor

from vistel.conference.device_list import devices_of
from vistel.conference.model import Conference
from vistel.wire.log import LogReader, LogRecord, LogWriter
from vistel.wire.motion import MotionDecoder, MotionEncoder

AVATAR = "builtin"
"""In place of an avatar of somebody's own, or one that is called after somebody."""
RAW = ("tracker", "glove")
"""Roles of devices whose bytes are kept: they tell postures and nothing else, but for whole bodies, which are of a model."""
_LETTER = "0-9A-Za-z"
_ADDRESSES = ("bus", "monitoring", "console", "world")
"""Sections of a conference file that say where its machines and files are."""

Edit = Callable[[Any], bool]
"""Changes a message; False: it is left out."""


Progress = Callable[[float], object]
"""Told the share that is done."""


class RedactError(ValueError):
    """A log that cannot be redacted; the text is one line that says why."""


@dataclass(frozen=True)
class Redacted:
    """names: whose names went, in the order of the numbers that they got; written, left_out: messages."""

    names: tuple[str, ...]
    written: int
    left_out: int


class Pseudonyms:
    """Words in place of names: person-1, person-2, ... A name that others contain goes first where it is longer."""

    def __init__(self, people: Iterable[str], also: Mapping[str, str]) -> None:
        """people: ids of participants; also: other names, and whose they are ("": nobody's that is known)."""
        self._of = {who: f"person-{n}" for n, who in enumerate(dict.fromkeys(people), 1)}
        self._of |= {name: self._of.get(who, "somebody") for name, who in also.items() if name and name not in self._of}
        words = sorted(self._of, key=len, reverse=True)
        # A Latin name is a word of its own, also beside Japanese; one of another script stands in a text without spaces.
        parts = [rf"(?<![{_LETTER}]){re.escape(w)}(?![{_LETTER}])" if w.isascii() else re.escape(w) for w in words]
        self._pattern = re.compile("|".join(parts), re.IGNORECASE) if parts else None
        self._folded = {name.casefold(): new for name, new in self._of.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Every name that is replaced."""
        return tuple(self._of)

    def text(self, text: str) -> str:
        """A text with all names replaced."""
        return self._pattern.sub(lambda m: self._folded[m[0].casefold()], text) if self._pattern else text

    def found_in(self, text: str) -> bool:
        """Whether a name stands in a text."""
        return self._pattern is not None and self._pattern.search(text) is not None

    def data(self, value: Any) -> Any:
        """Data as TOML has it, with names replaced in keys and texts."""
        if isinstance(value, dict):
            return {self.text(str(k)): self.data(v) for k, v in cast("dict[str, Any]", value).items()}
        if isinstance(value, list):
            return [self.data(v) for v in cast("list[Any]", value)]
        return self.text(value) if isinstance(value, str) else value

    def message(self, message: Any) -> None:
        """Replace all names in a message's texts."""
        for field, value in message.ListFields():
            if field.type == FieldDescriptor.TYPE_MESSAGE:
                for part in value if field.is_repeated else (value,):
                    self.message(part)
            elif field.type == FieldDescriptor.TYPE_STRING:
                if field.is_repeated:
                    value[:] = [self.text(text) for text in value]
                else:
                    setattr(message, field.name, self.text(value))


def redact(reader: LogReader, output: Path, also: Iterable[str] = (), progress: Progress = lambda _: None) -> Redacted:
    """Write a log without its people into `output`. also: further names that are to go, such as of people who were spoken of.
    progress: told the share that is done. Raises RedactError, and OSError where `output` cannot be written."""
    if reader.conference is None:
        raise RedactError(f"{reader.path}: holds no conference file, so nobody knows whose names are in it")
    try:
        conference = Conference.model_validate(reader.conference)
    except ValueError as e:
        raise RedactError(f"{reader.path}: the conference file inside is not one of this version") from e
    names = Pseudonyms(*_people(reader, conference, also))
    text = tomli_w.dumps(_conference(reader.conference, names))
    keeping = _Keeping(conference, names)
    written = seen = 0
    span = max(1, reader.end_ns - reader.begin_ns)
    with LogWriter(output, text) as writer:
        for record in reader.records():
            seen += 1
            progress((record.log_ns - reader.begin_ns) / span)
            for kept in keeping.kept(record):
                writer.write(kept.topic, kept.key, kept.message, kept.log_ns)
                written += 1
    return Redacted(names.names, written, seen - written)


def _people(reader: LogReader, conference: Conference, also: Iterable[str]) -> tuple[list[str], dict[str, str]]:
    """Ids of participants, and other names with whose they are."""
    people = [p.name for site in conference.sites for p in site.participants]
    shown = {p.display_name: p.name for site in conference.sites for p in site.participants}
    for record in reader.records(("participant", "pointer")):
        device = record.names.get("device", "").removesuffix("-pointer")
        people.append(record.names.get("participant") or device)
        who = record.message.guest if record.topic.name == "pointer" else record.message
        shown[who.display_name] = people[-1]
    return people, shown | dict.fromkeys(also, "")


def _conference(data: dict[str, Any], names: Pseudonyms) -> dict[str, Any]:
    """The conference file without names, addresses, files and what somebody says."""
    found = {k: v for k, v in data.items() if k not in _ADDRESSES}
    for site in found.get("sites", []):
        site.pop("speech", None)
        site["display"] = {k: v for k, v in site.get("display", {}).items() if not k.startswith("stream")}
        for person in site.get("participants", []):
            person.pop("display_name", None)
            person.pop("says", None)
            person["avatar"] = _avatar(str(person.get("avatar", "")), names)
    return names.data(found)


def _avatar(avatar: str, names: Pseudonyms) -> str:
    return avatar if avatar.startswith("builtin") and not names.found_in(avatar) else AVATAR


class _Keeping:
    """What is kept of each record, of all topics that are named here."""

    def __init__(self, conference: Conference, names: Pseudonyms) -> None:
        self._names = names
        self._raw = {d.name for d in devices_of(conference) if d.kind.role in RAW and not d.kind.whole_body}
        self._coders: dict[str, tuple[MotionDecoder, MotionEncoder]] = {}
        self._edits: dict[str, Edit] = {
            **dict.fromkeys(("tracker", "glove", "prop", "ownership", "bond_torn", "button", "heartbeat", "clock_offset"), _whole),
            **dict.fromkeys(("world_detail", "hand_force", "image_delay", "voice_control", "voice_level"), _whole),
            **dict.fromkeys(("world_state", "world_key"), _without("hash", "check")),
            "device_status": _without("detail"),
            "command": _whole,
            "command_result": _without("reason"),
            "voice": _without("opus", "earlier"),
            "utterance": _without("text", "reply", "spoken", "readings"),
            "participant": self._about,
            "pointer": self._pointer,
        }

    def kept(self, record: LogRecord) -> Iterator[LogRecord]:
        """The record without names; nothing where it is left out."""
        topic = record.topic.name
        if topic in ("motion", "motion_thin"):
            message = self._motion(record)
        elif topic == "device_raw":
            told = record.message.data.decode("latin-1")
            message = record.message if record.names["device"] in self._raw and not self._names.found_in(told) else None
        else:
            edit = self._edits.get(topic)
            message = record.message if edit is not None and edit(record.message) else None
        if message is not None:
            self._names.message(message)
            yield replace(record, key=self._names.text(record.key), message=message)

    def _motion(self, record: LogRecord) -> Any | None:
        """The same posture, encoded anew without the face: its marks are in the bytes of a frame."""
        decoder, encoder = self._coders.setdefault(record.key, (MotionDecoder(), MotionEncoder()))
        sample = decoder.decode(record.message)
        if sample is None:
            return None
        message = encoder.encode(replace(sample, face=None))
        message.header.CopyFrom(record.message.header)
        return message

    def _about(self, message: Any) -> bool:
        message.avatar = _avatar(message.avatar, self._names)
        message.display_name = message.participant
        message.parcel = ""
        return True

    def _pointer(self, message: Any) -> bool:
        if message.HasField("guest"):
            message.guest.avatar = _avatar(message.guest.avatar, self._names)
        return True


def _whole(message: Any) -> bool:
    return True


def _without(*fields: str) -> Edit:
    def edit(message: Any) -> bool:
        for field in fields:
            if field in message.DESCRIPTOR.fields_by_name:
                message.ClearField(field)
        return True

    return edit
