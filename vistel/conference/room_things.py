"""What a conference file puts on the table of its room, and whether the props of its sites are in the room."""

from vistel.conference.model import Conference, RoomConfig, RoomThing
from vistel.space.room import Extra, meeting_room
from vistel.space.things.things import PhysicsMaterial


def extra_of(thing: RoomThing) -> Extra:
    """A simple shape of the file as the world takes it. Raises ValueError for one that cannot be."""
    slow = thing.recovery or (0.5 if thing.material == "viscoelastic" else 0.0)
    mass, rigidity = 0.2 if thing.mass is None else thing.mass, 0.3 if thing.rigidity is None else thing.rigidity
    return Extra(
        thing.id,
        thing.name or thing.id,
        thing.shape,
        thing.size,
        mass,
        rigidity,
        int((thing.colour or "#b5a48f")[1:] + "ff", 16),
        *thing.at,
        PhysicsMaterial(thing.material, slow, thing.sticky, thing.bears),
    )


def extras_of(room: RoomConfig) -> tuple[Extra, ...]:
    """Those of the room's things that are simple shapes. Raises ValueError for things that cannot be together."""
    simple = [extra_of(t) for t in room.things if t.file is None]
    return meeting_room(room.seats, simple).extras if simple else ()


def faults_of(conference: Conference) -> list[str]:
    """One line, "key: what was expected", for each of the room's things that cannot be and each prop of which there is no such
    thing. What files hold is not looked at."""
    faults: list[str] = []
    for n, thing in enumerate(conference.room.things):
        try:
            if thing.file is None:
                extra_of(thing)
        except ValueError as e:
            faults.append(f"room.things[{n}]: {e}")
    if faults:
        return faults
    try:
        extras = extras_of(conference.room)
    except ValueError as e:
        return [f"room: {e}"]
    if conference.room.from_files:
        return []
    loose = [t.id for t in meeting_room(conference.room.seats, extras).things if not t.fixed]
    return [
        f"sites[{i}].props[{k}].thing: no such loose thing in the room; expected one of {', '.join(loose)}, got {prop.thing!r}"
        for i, site in enumerate(conference.sites)
        for k, prop in enumerate(site.props)
        if prop.thing not in loose
    ]
