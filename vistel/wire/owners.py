"""Who speaks for whom. A sender's key, and what its message says of itself, are held against the conference file before any service
sees them: a participant, a device, a prop and equipment are heard from the site that the file gives them, and from no other.

A router's access rules (`vistel.wire.zenoh.access`) hold every certificate to the keys of its own site; they know nothing of whom
the names in those keys belong to. That is asked here, by every subscription, and there only.
"""

import hashlib
import logging
import threading
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from vistel.host import HOST
from vistel.wire.bus import BusCounters
from vistel.wire.topics import Delivery, Publisher, Topic

log = logging.getLogger("vistel.bus")

OWNED = ("participant", "device", "equipment")
"""Names of a key that the conference file gives to a site."""
MOST_NAMES: Mapping[str, int] = {"thing": 256, "node": 64, "digest": 64, "picture": 512, "part": 400, "hand": 2}
"""How many different names a site may use that the file does not give it, by kind: things that are led by a mouse, processes,
avatars, pictures on panels, parts of either, hands."""
MOST_AHEAD_NS = 10_000_000_000
"""How far a sender's clock may be ahead of the receiver's."""
LOG_EVERY_NS = 60_000_000_000
"""How often one sender's refused messages of one topic are logged, at most."""


@dataclass(frozen=True)
class Owners:
    """What the conference file gives to each site: names by kind ("participant", "device", "equipment", "prop"). The hub has one
    participant, the host (`vistel.host`); a place without people and devices has an empty entry; who has none is unknown."""

    sites: Mapping[str, Mapping[str, Collection[str]]]

    def digests(self) -> dict[str, bytes]:
        """Of each site with something of its own: what tells whether another file gives it the same. The hub has the host in
        every file."""
        given_to = {site: given for site, given in self.sites.items() if given and HOST not in given.get("participant", ())}
        own = {site: sorted((kind, sorted(names)) for kind, names in given.items()) for site, given in given_to.items()}
        return {site: hashlib.sha256(repr(given).encode()).digest()[:8] for site, given in own.items()}

    def owner(self, kind: str, name: str) -> str:
        """The first site that has it; empty: none."""
        return next((site for site, own in self.sites.items() if name in own.get(kind, ())), "")

    def objection(self, names: Mapping[str, str]) -> str:
        """Why a key with these names is not believed; empty where it is."""
        site = names.get("site")
        if site is None:
            who = names.get("participant")
            return f"no participant {who!r} in the conference file" if who and not self.owner("participant", who) else ""
        own = self.sites.get(site)
        if own is None:
            return f"no site {site!r} in the conference file"
        for kind in OWNED:
            if kind in names and names[kind] not in own.get(kind, ()):
                return self._not_its_own(kind, names[kind])
        reader = names.get("reader")
        if reader is not None and reader not in self.sites.get(names["reader_site"], {}).get("participant", ()):
            return f"no participant {reader!r} of {names['reader_site']!r} in the conference file"
        prop_of = self.owner("prop", names.get("thing", ""))
        return self._not_its_own("prop", names["thing"]) if prop_of not in ("", site) else ""

    def objection_to_message(self, topic: Topic, names: Mapping[str, str], message: Any) -> str:
        """Why what a message says of its sender is not believed. What it leaves open is filled in from the key."""
        for field in ("site", *OWNED, "thing"):
            if field in names and field in topic.message.DESCRIPTOR.fields_by_name:
                said = getattr(message, field)
                if not said:
                    setattr(message, field, names[field])
                elif said != names[field]:
                    return f"its key says {field} {names[field]!r}, the message {said[:64]!r}"
        if topic.name == "prop" and not self._leads(names["site"], names["thing"], message.led_by):
            return f"{names['thing']!r} is no prop of the site, and {message.led_by[:64]!r} no participant of it who could lead it"
        return ""

    def _leads(self, site: str, thing: str, led_by: str) -> bool:
        own = self.sites[site]
        return led_by in own.get("participant", ()) if led_by else thing in own.get("prop", ())

    def _not_its_own(self, kind: str, name: str) -> str:
        owner = self.owner(kind, name)
        return f"{kind} {name!r} belongs to {owner}" if owner else f"no {kind} {name!r} in the conference file"


class Admission:
    """What a bus lets through to its subscriptions, by its conference's owners. Safe from any thread. Remembers the keys that were
    admitted, whose number the file and MOST_NAMES bound, and nothing of those that were not."""

    def __init__(self, owners: Owners | None, counters: BusCounters) -> None:
        """owners: None admits every key of a topic."""
        self._owners, self._counters = owners, counters
        self._admitted: dict[str, dict[str, str]] = {}
        self._used: dict[tuple[str, str], set[str]] = {}
        self._logged: dict[tuple[str, str], tuple[int, int]] = {}
        self._lock = threading.Lock()

    def names(self, topic: Topic, key: str, now_ns: int) -> dict[str, str] | None:
        """The names of a key of `topic`; None for one that is not admitted."""
        found = self._admitted.get(key)
        if found is not None:
            return found
        names = topic.match(key)
        if names is None:
            return None
        with self._lock:
            reason = self._owners.objection(names) or self._objection_to_number(names) if self._owners is not None else ""
            if reason:
                self._refuse(topic, names, reason, now_ns)
                return None
            self._admitted[key] = names
        return names

    def message(self, topic: Topic, names: Mapping[str, str], message: Any, now_ns: int) -> bool:
        """Whether a message says of its sender what its key says."""
        if self._owners is None or topic.publisher is not Publisher.SITE:
            return True
        reason = self._owners.objection_to_message(topic, names, message) or _objection_to_time(topic, message, now_ns)
        if reason:
            with self._lock:
                self._refuse(topic, names, reason, now_ns)
        return not reason

    @property
    def bounded(self) -> bool:
        """Whether senders are held to anything at all."""
        return self._owners is not None

    def refuse(self, topic: Topic, key: str, reason: str, now_ns: int) -> None:
        """Count a message of an admitted key that is not let through."""
        with self._lock:
            self._refuse(topic, self._admitted.get(key, {}), reason, now_ns)

    def present(self, site: str) -> bool:
        """Whether the presence of a process of `site` counts."""
        return self._owners is None or site in self._owners.sites

    def _objection_to_number(self, names: Mapping[str, str]) -> str:
        site = names.get("site", "")
        for kind, most in MOST_NAMES.items():
            if kind in names:
                used = self._used.setdefault((site, kind), set())
                if names[kind] not in used and len(used) >= most:
                    return f"more than {most} names of the kind {kind!r}"
        for kind in MOST_NAMES.keys() & names.keys():
            self._used[site, kind].add(names[kind])
        return ""

    def _refuse(self, topic: Topic, names: Mapping[str, str], reason: str, now_ns: int) -> None:
        """Count, and log one line for each sender and topic; all senders that the file does not know are one."""
        self._counters.refused[topic.name] += 1
        site = names.get("site", "")
        sender = (site if self._owners is not None and site in self._owners.sites else "", topic.name)
        since_ns, count = self._logged.get(sender, (now_ns - LOG_EVERY_NS, 0))
        if 0 <= now_ns - since_ns < LOG_EVERY_NS:
            self._logged[sender] = since_ns, count + 1
            return
        self._logged[sender] = now_ns, 0
        log.warning("event=message_refused topic=%s site=%s reason=%r more=%d", topic.name, site or "-", reason, count)


def _objection_to_time(topic: Topic, message: Any, now_ns: int) -> str:
    """Why the time that a message says it is of is not believed. A reliable one, which is not sent again, is taken as of now."""
    ahead_ns = message.header.t_ns - now_ns
    if ahead_ns <= MOST_AHEAD_NS:
        return ""
    if topic.delivery is Delivery.RELIABLE:
        message.header.t_ns = now_ns
        return ""
    return "its time is more than 10 s ahead; set the clocks of both machines"
