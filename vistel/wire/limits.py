"""How large what comes from outside may be, how often it may come, and how much of it is recorded. Checked where messages are
received, before any service sees them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor

from vistel.wire.topics import Delivery, Publisher, Topic

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
MOST_OFTEN = 10.0
"""Times the rate of its topic, over longer times: VRPN trackers of 1000 Hz are the fastest that there are."""
AT_ONCE_S = 5.0
"""So much of a topic at its rate may come at once: what was held up, or what a replay sends before it begins [s]."""
LEAST_AT_ONCE = 20.0
"""Messages of a topic of any rate."""
SITE_BYTES_S = 8e6
"""What a site may have recorded, over longer times: pictures of four cameras take half [bytes/s]."""
SITE_BYTES_AT_ONCE = 64e6
"""So much may come at once: avatars, and what waited while a link was away [bytes]."""
TELL_EVERY_NS = 60_000_000_000
"""How often it is told that a site is over it, at most."""


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


@dataclass(slots=True)
class _Key:
    left: float
    since_ns: int


class Rates:
    """Of one subscription: who sends at a hundred times their rate is heard as who sends at ten times. Remembers as many keys as
    are asked for: ask for admitted ones. Not for two threads at once."""

    def __init__(self, topic: Topic) -> None:
        limited = topic.publisher is Publisher.SITE and topic.delivery is Delivery.NEWEST and topic.rate_hz > 0.0
        self._per_s = MOST_OFTEN * topic.rate_hz if limited else 0.0
        self._most = max(LEAST_AT_ONCE, AT_ONCE_S * topic.rate_hz)
        self._keys: dict[str, _Key] = {}
        self.objection = f"more than {MOST_OFTEN:g} times the {topic.rate_hz:g} messages a second of its topic"

    def admit(self, key: str, now_ns: int) -> bool:
        """Whether one more message under a key is let through at `now_ns`. Reliable ones are: their senders are held back."""
        if not self._per_s:
            return True
        found = self._keys.get(key)
        if found is None:
            self._keys[key] = _Key(self._most - 1.0, now_ns)
            return True
        passed_ns = now_ns - found.since_ns
        found.left = min(self._most, found.left + max(0, passed_ns) * 1e-9 * self._per_s)
        found.since_ns = now_ns
        if found.left < 1.0:
            return False
        found.left -= 1.0
        return True


class Spending:
    """What each site has had recorded. Who is over it gets nothing more until there is something left again."""

    def __init__(self) -> None:
        self._left: dict[str, float] = {}
        self._since_ns: dict[str, int] = {}
        self._told_ns: dict[str, int] = {}

    def over(self, site: str, now_ns: int) -> bool:
        """Whether nothing of a site may be recorded at `now_ns`."""
        passed_s = max(0, now_ns - self._since_ns.get(site, now_ns)) * 1e-9
        self._since_ns[site] = now_ns
        self._left[site] = min(SITE_BYTES_AT_ONCE, self._left.get(site, SITE_BYTES_AT_ONCE) + passed_s * SITE_BYTES_S)
        return self._left[site] <= 0.0

    def spend(self, site: str, count: int) -> None:
        """`count` bytes of a site, which `over` was asked about, have been recorded."""
        self._left[site] -= count

    def to_tell(self, site: str, now_ns: int) -> bool:
        """Whether that a site is over it was not told lately."""
        if now_ns - self._told_ns.get(site, now_ns - TELL_EVERY_NS) < TELL_EVERY_NS:
            return False
        self._told_ns[site] = now_ns
        return True
