"""Pages are told what hands feel at the moment that they show."""

import json
from typing import Any

from virtual_time import LoopClock, run

from vistel.session.felt_forces import FELT_NS, PERIOD_NS, FeltForces
from vistel.v1.envelope_pb2 import Header
from vistel.v1.geometry_pb2 import Vec3
from vistel.v1.world_pb2 import HandForce
from vistel.wire.bus import Bus
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME

SECOND = 1_000_000_000
DELAY_NS = 50_000_000


def feels(world: Bus, t_ns: int, newtons: float, *, right: bool = True) -> None:
    touch = HandForce.Touch(digit=HandForce.DIGIT_THUMB, body="ball", force=Vec3(y=newtons), normal_force=newtons)
    message = HandForce(header=Header(t_ns=t_ns), participant="ann", right=right, touches=[touch])
    world.publish(BY_NAME["hand_force"], participant="ann", hand="right" if right else "left").put(message)


def told(forces: FeltForces, now_ns: int) -> list[Any]:
    return json.loads(forces.words(now_ns, {"ann": DELAY_NS}))["touches"]


def room(crowd: bool = False) -> tuple[Bus, FeltForces]:
    network = MemoryNetwork()
    clock = LoopClock()
    return network.bus("demo", "hub", clock), FeltForces(network.bus("demo", "page", clock), crowd=crowd)


def test_a_force_is_told_when_the_picture_of_its_moment_is_shown_and_not_before() -> None:
    async def scene() -> None:
        world, forces = room()
        feels(world, 10 * SECOND, 2.0)
        assert told(forces, 10 * SECOND) == []
        assert [t["force"] for t in told(forces, 10 * SECOND + PERIOD_NS)] == [[0.0, 2.0, 0.0]]

    run(scene())


def test_the_newest_that_is_not_ahead_of_the_picture_counts_and_a_hand_of_which_nothing_comes_feels_nothing() -> None:
    async def scene() -> None:
        world, forces = room()
        for n in range(12):
            feels(world, 10 * SECOND + n * SECOND // 60, 1.0 + n)
        newest_ns = 10 * SECOND + 11 * SECOND // 60
        at_ns = (newest_ns + DELAY_NS) // PERIOD_NS * PERIOD_NS + PERIOD_NS
        assert [t["force"][1] for t in told(forces, at_ns)] == [12.0]
        assert told(forces, newest_ns + DELAY_NS + FELT_NS + PERIOD_NS) == []

    run(scene())


def test_what_is_weak_is_not_told_nor_who_is_not_shown_nor_anybody_of_a_crowd() -> None:
    async def scene() -> None:
        world, forces = room()
        feels(world, 10 * SECOND, 0.01)
        feels(world, 10 * SECOND, 3.0, right=False)
        assert [t["hand"] for t in told(forces, 10 * SECOND + PERIOD_NS)] == ["left"]
        assert json.loads(forces.words(10 * SECOND + 2 * PERIOD_NS, {}))["touches"] == []
        world, many = room(crowd=True)
        feels(world, 10 * SECOND, 3.0)
        assert told(many, 10 * SECOND + PERIOD_NS) == []

    run(scene())


def test_a_log_that_stands_still_tells_what_and_who_has_come_since() -> None:
    async def scene() -> None:
        world, forces = room()
        now_ns = 10 * SECOND + PERIOD_NS
        assert told(forces, now_ns) == []
        feels(world, 10 * SECOND + PERIOD_NS - 2 * DELAY_NS, 3.0)
        assert json.loads(forces.words(now_ns, {}))["touches"] == []
        assert len(told(forces, now_ns)) == 1

    run(scene())
