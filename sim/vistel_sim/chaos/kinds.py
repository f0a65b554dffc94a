"""The faults that a running conference can be struck with. Where LiveKit's simulation scenarios have one, its name is theirs."""

from dataclasses import dataclass
from enum import Enum


class Target(Enum):
    """What a fault strikes."""

    PROCESS = "a process"
    SITE = "a site"
    CONFERENCE = ""


@dataclass(frozen=True)
class FaultKind:
    """One fault. seconds: how long it lasts unless another time is given, 0 for what happens in a moment; amount: how large it is,
    in `unit`."""

    name: str
    target: Target
    about: str
    seconds: float = 0.0
    amount: float = 0.0
    unit: str = ""


KINDS = {
    kind.name: kind
    for kind in (
        FaultKind("kill", Target.PROCESS, "it ends without a message, and is started again"),
        FaultKind("hang", Target.PROCESS, "it stops, then goes on where it was", 10.0),
        FaultKind("signal-reconnect", Target.SITE, "its connections to the router are closed; it connects again"),
        FaultKind("router-failure", Target.CONFERENCE, "the router closes, and opens again", 5.0),
        FaultKind("world-failure", Target.CONFERENCE, "the process of the world that leads ends without a message"),
        FaultKind("link-cut", Target.SITE, "nothing passes between it and the router, and no connection is closed", 10.0),
        FaultKind("bandwidth", Target.SITE, "the link from it to the router is slow", 30.0, 64.0, "kbit/s"),
        FaultKind("clock-step", Target.CONFERENCE, "the hub's clock, which all follow, is set, and set back", 30.0, 2.0, "s"),
        FaultKind("disk-full", Target.PROCESS, "the system refuses every byte it writes to a file", 20.0),
        FaultKind("slow-disk", Target.CONFERENCE, "another process writes to the disk of the room all the time", 20.0),
    )
}
"""By name."""
