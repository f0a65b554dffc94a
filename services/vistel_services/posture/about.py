"""Who a participant is, as it is told to everybody."""

from vistel.capture.config import Person
from vistel.v1.motion_pb2 import Participant
from vistel.wire.motion.proportions import to_message
from vistel_services.posture.own_avatar import OwnAvatar


def about(person: Person, own: OwnAvatar | None, site: str, t_ns: int) -> Participant:
    """own: their avatar, None for one that cannot be used; t_ns: now."""
    out = Participant(
        participant=person.name, site=site, display_name=person.display_name, avatar=person.avatar, height_m=person.height_m
    )
    if own is not None:
        limbs = own.proportions
        out.parcel = own.digest
        out.proportions.CopyFrom(to_message(limbs.names, limbs.joint, limbs.arrays))
    out.header.t_ns = t_ns
    out.header.source = f"{site}/posture"
    return out
