"""Who comes late knows the room that all others know, whenever they come and whatever moves."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from world_site import TICK_NS, WorldSite, scenario

from vistel.messages.world.encoder import MOST_KEYED
from vistel.space.room import Extra, table_radius
from vistel.v1.command_pb2 import Command, MoveThing
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.wire.topics import BY_NAME
from vistel.wire.world.codec.frame import MOST_ENCODED
from vistel.wire.world.decoder import RoomState
from vistel.wire.world.listener import WorldListener

SEATS, THINGS = 14, 110


def extras() -> tuple[Extra, ...]:
    """Balls all over a large table."""
    n, radius = 9, table_radius(SEATS) - 0.15
    places = [(0.13 * i, 0.13 * j) for i in range(-n, n + 1) for j in range(-n, n + 1)]
    free = sorted((p for p in places if 0.25 < math.hypot(*p) < radius), key=lambda p: math.hypot(*p))
    assert len(free) >= THINGS
    return tuple(Extra(f"t{i}", f"t{i}", "ball", 0.025, 0.1, 0.9, 0x888888FF, *p) for i, p in enumerate(free[:THINGS]))


def lift(site: WorldSite, who: str, thing: str) -> None:
    place = next(e for e in extras() if e.id == thing)
    command = Command(id=f"{who}-{thing}", participant=who)
    command.move.CopyFrom(MoveThing(thing=thing, pose=Pose(position=Vec3(x=place.x, y=1.2, z=place.z))))
    command.header.t_ns = site.clock.now_ns()
    site.buses[who].publish(BY_NAME["command"], participant=who).put(command)


async def joined(site: WorldSite, site_name: str, person: str) -> WorldListener:
    """A site that has just come, with a picture of the room."""
    listener = WorldListener(site.network.bus("demo", site_name, site.clock), site.clock, [person])
    for _ in range(60):
        if listener.take():
            return listener
        await site.play(TICK_NS * 1e-9)
        await asyncio.sleep(0)
    raise AssertionError("no room within a second")


def same(a: RoomState, b: RoomState) -> None:
    assert a.step == b.step and a.t_ns == b.t_ns
    assert (a.participants, a.touches, a.moving, a.grasps) == (b.participants, b.touches, b.moving, b.grasps)
    assert list(a.things.items()) == list(b.things.items())
    assert a.poses.keys() == b.poses.keys()
    assert all(np.array_equal(a.poses[k][i], b.poses[k][i]) for k in a.poses for i in (0, 1))


def newest(listener: WorldListener) -> RoomState:
    return listener.take()[-1][0]


def test_whoever_joins_a_large_room_at_any_moment_knows_what_those_know_who_were_there_from_the_beginning(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.kill()
        site.config = replace(site.config, seats=SEATS, extras=extras())
        await site.start()
        first = await joined(site, "tokyo", "nobody")
        moving = 0
        for n in range(2):
            for who in site.buses:
                for k in range(5):
                    lift(site, who, f"t{(n * 15 + sorted(site.buses).index(who) * 5 + k) % THINGS}")
            await site.play((7 + 6 * n) * TICK_NS * 1e-9)
            late = await joined(site, f"late-{n}", "nobody")
            first.take()
            await site.play(1.2)
            a, b = newest(first), newest(late)
            same(a, b)
            assert first.right and late.right
            assert len(a.things) > MOST_KEYED
            moving = max(moving, len(a.moving))
            late.close()
        assert moving > MOST_ENCODED
        near = await joined(site, "paris", "bruno")
        await site.play(1.2)
        assert near.right and newest(near).step == newest(first).step

    scenario(tmp_path, play)
