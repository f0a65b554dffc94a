"""What the people who wear simulated devices are like."""

from vistel.conference.avatar_files import avatar_file
from vistel.conference.model import Conference, Participant
from vistel.figure.avatar.avatar import scaled
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.formats.load import read_parcel
from vistel.figure.people.builtin import builtin_proportions


def own_limbs(conference: Conference) -> dict[str, Proportions]:
    """By participant. Those with an avatar that cannot be used are left out; the posture service says what is wrong with it."""
    out: dict[str, Proportions] = {}
    for site in conference.sites:
        for person in site.participants:
            try:
                out[person.name] = _limbs(person)
            except (ValueError, OSError):
                continue
    return out


def _limbs(person: Participant) -> Proportions:
    file = avatar_file(person)
    if file is None:
        return builtin_proportions(person.avatar, name=person.name, height=person.height)
    avatar = scaled(read_parcel(file)[0], person.height)
    return Proportions.of(avatar.skeleton, avatar.body)
