"""The kinds of devices there are: those that come with VISTEL and those of other installed packages.

A package offers a kind as an entry point of the group `vistel.devices` whose object is a `DeviceKind`:

    [project.entry-points."vistel.devices"]
    beacon = "beacon:KIND"
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points

from vistel.devices.builtin import KINDS
from vistel.devices.kind import DeviceKind, Role

GROUP = "vistel.devices"


class UnknownKindError(ValueError):
    """No such kind of device; one line that lists those there are."""


def kind_of(role: Role, name: str) -> DeviceKind:
    """The kind that a conference file names. Raises UnknownKindError."""
    # Other packages are only searched for a name that is not built in: reading what is installed takes milliseconds.
    found = next((k for k in KINDS if (k.role, k.name) == (role, name)), None)
    found = found or next((k for k in packaged_kinds()[0] if (k.role, k.name) == (role, name)), None)
    if found is None:
        names = [repr(k.name) for k in kinds() if k.role == role]
        listed = f"{', '.join(names[:-1])} or {names[-1]}" if len(names) > 1 else names[0]
        raise UnknownKindError(f"expected {listed}, got {name!r}")
    return found


def kinds() -> tuple[DeviceKind, ...]:
    """All kinds, the built-in ones first."""
    return (*KINDS, *packaged_kinds()[0])


@cache
def packaged_kinds() -> tuple[tuple[DeviceKind, ...], tuple[str, ...]]:
    """The kinds of other packages, and a line for each entry point that offers none. A kind with the role and the name of
    another does not replace it."""
    found: list[DeviceKind] = []
    faults: list[str] = []
    for point in entry_points(group=GROUP):
        kind = _kind(point)
        if isinstance(kind, str):
            faults.append(f"{_package(point)}: {point.value}: {kind}")
        elif any((k.role, k.name) == (kind.role, kind.name) for k in (*KINDS, *found)):
            faults.append(f"{_package(point)}: {point.value}: there is a {kind.role} {kind.name!r} already")
        else:
            found.append(kind)
    return tuple(found), tuple(faults)


def _kind(point: EntryPoint) -> DeviceKind | str:
    try:
        kind = point.load()
    except Exception as e:  # what an installed package does when it is imported is its own; it must not end a conference
        return f"cannot be loaded: {e!r}"
    return kind if isinstance(kind, DeviceKind) else "expected a DeviceKind"


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else "?"
