"""Files of motion: postures are known, nothing is solved."""

from pathlib import Path
from typing import Any

from vistel.conference.model import Conference
from vistel.v1.device_pb2 import TrackerReceiver
from vistel.v1.motion_pb2 import Participant, Prop
from vistel.wire.topics import BY_NAME
from vistel_cli.log.imported.recorded import NAME, SITE, Messages, Recorded


def bvh(path: Path) -> Recorded:
    """Somebody who moved, of a BVH file. Raises MotionError."""
    from vistel_sim.motion.bvh import load_bvh
    from vistel_sim.motion.played import play_alone
    from vistel_sim.motion.source import simulated_people

    take = load_bvh(path)
    person = _moved(path.stem, take.measured().height)

    def messages(conference: Conference, begin_ns: int) -> Messages:
        played = play_alone(simulated_people(conference)[person["name"]], take)
        yield from _motions(conference, person, played.postures, begin_ns)

    return Recorded(take.duration_s, [person], messages)


def hand_over(path: Path) -> Recorded:
    """Two people and a baton, of a folder. Raises MotionError."""
    from vistel.space.room import BATON
    from vistel_sim.motion.hand_over import play_hand_over
    from vistel_sim.motion.played import RATE_HZ
    from vistel_sim.motion.six_dof import ROLES, load_hand_over
    from vistel_sim.motion.source import simulated_people

    take = load_hand_over(path)
    people = [_moved(role, take.people[role].measured().height) for role in ROLES]
    seconds = take.people[ROLES[0]].duration_s

    def messages(conference: Conference, begin_ns: int) -> Messages:
        everyone = simulated_people(conference)
        played = play_hand_over({p["name"]: everyone[p["name"]] for p in people}, take, conference.room.seats)
        for person in people:
            yield from _motions(conference, person, played.takes[person["name"]].postures, begin_ns)
        topic = BY_NAME["prop"]
        key = topic.format(conference=NAME, site=SITE, thing=BATON)
        for n in range(int(seconds * RATE_HZ)):
            p, q = played.things(n / RATE_HZ)[BATON]
            message = Prop(thing=BATON)
            message.pose.position.x, message.pose.position.y, message.pose.position.z = p.tolist()
            r = message.pose.rotation
            r.x, r.y, r.z, r.w = q.tolist()
            message.health = TrackerReceiver.HEALTH_GOOD
            message.header.seq, message.header.t_ns = n + 1, begin_ns + round(n * 1e9 / RATE_HZ)
            yield topic, key, message, message.header.t_ns

    return Recorded(seconds, people, messages, props=[BATON])


def _moved(name: str, height: float) -> dict[str, Any]:
    """Somebody whose postures are known: as a program that takes their part."""
    return {"name": name, "height": round(min(2.5, max(0.5, height)), 3), "program": True}


def _motions(conference: Conference, person: dict[str, Any], postures: Any, begin_ns: int) -> Messages:
    from vistel.messages.postures import sample_of
    from vistel.wire.motion import MotionEncoder
    from vistel_sim.motion.played import RATE_HZ

    who = person["name"]
    where = {"conference": NAME, "site": SITE, "participant": who}
    about = Participant(participant=who, site=SITE, avatar="builtin", height_m=person["height"])
    about.header.t_ns, about.header.seq = begin_ns, 1
    yield BY_NAME["participant"], BY_NAME["participant"].format(**where), about, begin_ns
    encoder, key = MotionEncoder(), BY_NAME["motion"].format(**where)
    for n, posture in enumerate(postures):
        t_ns = begin_ns + round(n * 1e9 / RATE_HZ)
        yield BY_NAME["motion"], key, encoder.encode(sample_of(posture, n + 1, t_ns, gaze=None, face=None, lids=None)), t_ns
