"""How large what comes from outside may be. Checked where messages are received, before any service sees them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor

from vistel.wire.topics import Publisher, Topic

MOST_MESSAGE_BYTES = 16 << 20
"""Of anything on the bus; a node gathers no larger one from its fragments."""
SITE_BYTES = 64 << 10
"""Of a message of a site."""
RAW_BYTES = 4 << 20
"""Of `device_raw`, which may hold pictures."""
CUT: Mapping[str, int] = {"display_name": 64, "name": 100, "text": 500, "spoken": 500, "reply": 500, "detail": 500}
"""Letters of texts for people, by field; what is longer is cut."""
MOST_LETTERS = 1024
"""Of any other text; a message with a longer one is refused."""


def most_bytes(topic: Topic) -> int:
    """How long a message of `topic` may be."""
    if topic.publisher is not Publisher.SITE:
        return MOST_MESSAGE_BYTES
    return RAW_BYTES if topic.name == "device_raw" else SITE_BYTES


@cache
def short_bytes(kind: Descriptor) -> int:
    """A message of this kind with at most so many bytes holds no text that is too long: a letter takes a byte or more."""
    inside = (short_bytes(kind.fields_by_name[name].message_type) for name, _, nested in _texts(kind) if nested)
    own = (CUT.get(name, MOST_LETTERS) for name, _, nested in _texts(kind) if not nested)
    return min((*inside, *own), default=MOST_MESSAGE_BYTES)


def objection_to_texts(message: Any) -> str:
    """Why the texts in a message cannot be; empty where they can. Texts for people are cut."""
    for field, repeated, nested in _texts(message.DESCRIPTOR):
        found = getattr(message, field)
        if nested:
            parts = found if repeated else (found,) if message.HasField(field) else ()
            reason = next((r for part in parts if (r := objection_to_texts(part))), "")
        elif repeated:
            reason = _objection(field, max(map(len, found), default=0))
        elif len(found) > (most := CUT.get(field, MOST_LETTERS)) and field in CUT:
            setattr(message, field, found[: most - 1] + "…")
            reason = ""
        else:
            reason = _objection(field, len(found))
        if reason:
            return reason
    return ""


def _objection(field: str, letters: int) -> str:
    return f"{field} has {letters} letters, expected at most {MOST_LETTERS}" if letters > MOST_LETTERS else ""


@cache
def _texts(kind: Descriptor) -> tuple[tuple[str, bool, bool], ...]:
    """The fields of a message that are texts or have texts in them: name, whether repeated, whether a message of its own."""
    found = [(f.name, f.is_repeated, False) for f in kind.fields if f.type == FieldDescriptor.TYPE_STRING]
    inside = [f for f in kind.fields if f.message_type is not None and _texts(f.message_type)]
    return (*found, *((f.name, f.is_repeated, True) for f in inside))
