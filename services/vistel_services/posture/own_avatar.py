"""A participant's own avatar: read at their site, announced to the others and sent to every renderer."""

from __future__ import annotations

import logging
from dataclasses import dataclass

from vistel.capture.config import Person
from vistel.conference.avatar_files import keep_parcel
from vistel.figure.avatar.avatar import scaled
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.formats.load import read_parcel
from vistel.figure.people.builtin import builtin_proportions
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.parcels import digest_of, parts_of, send_parcel
from vistel.wire.topics import BY_NAME

log = logging.getLogger("vistel.posture")


@dataclass(frozen=True)
class OwnAvatar:
    """What its limbs are like, as tall as the participant, and the avatar as a parcel; no parcel for a built-in person, whom every
    site makes itself."""

    proportions: Proportions
    parcel: bytes = b""
    digest: str = ""


def own_avatar(person: Person) -> OwnAvatar | None:
    """The avatar of a participant; None for one that cannot be used, which is logged in one line."""
    path = person.avatar_file
    if path is None:
        return _builtin(person)
    try:
        avatar, parcel = read_parcel(path)
        next(parts_of(parcel))
        grown = scaled(avatar, person.height_m)
        own = OwnAvatar(Proportions.of(grown.skeleton, grown.body), parcel, digest_of(parcel))
    except FileNotFoundError:
        reason = f"no file {path.name!r} beside the conference file or in {path.parent}; copy it there"
    except (ValueError, OSError) as fault:
        reason = str(fault)
    else:
        keep_parcel(own.digest, own.parcel)
        log.info("event=avatar_read participant=%s digest=%s bytes=%d", person.name, own.digest, len(parcel))
        return own
    log.error("event=avatar_refused participant=%s avatar=%s reason=%r shown=stand-in", person.name, path, reason)
    return None


def _builtin(person: Person) -> OwnAvatar | None:
    try:
        limbs = builtin_proportions(person.avatar, name=person.name, height=person.height_m)
    except ValueError as fault:
        log.error("event=avatar_refused participant=%s avatar=%s reason=%r shown=stand-in", person.name, person.avatar, str(fault))
        return None
    return OwnAvatar(limbs)


async def send_parts(own: OwnAvatar, site: str, bus: Bus, clock: Clock) -> None:
    """Put the parcel on the bus, a part at a time; late joiners get it from there."""
    topic = BY_NAME["avatar_part"]
    await send_parcel(own.parcel, lambda name: bus.publish(topic, digest=own.digest, part=name), clock, f"{site}/posture")
