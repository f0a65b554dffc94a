"""The conference of a crowd: one room, one participant at each site, a few of whom talk."""

from __future__ import annotations

from vistel.conference.model import Conference

TALKING = 4
"""How many talk at once."""
TURN_S = 4.0
"""For so long each."""


def crowd_conference(count: int) -> Conference:
    """`count` participants in one room, nothing recorded."""
    sites = [{"name": f"site-{i}", "participants": [{"name": f"person-{i}"}]} for i in range(count)]
    return Conference.model_validate({"name": "crowd", "record": False, "room": {"seats": count}, "sites": sites})


def talkers(count: int, t_s: float) -> frozenset[int]:
    """Who of `count` participants talk at conference time `t_s`."""
    turn = int(t_s / TURN_S)
    return frozenset((31 * turn + k * max(1, count // TALKING)) % count for k in range(min(TALKING, count)))
