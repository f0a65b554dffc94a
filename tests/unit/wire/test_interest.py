"""Whom of a crowd a site receives in full."""

import asyncio
from collections import Counter

import numpy as np

from vistel.conference.model import CROWD, Conference
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.motion import MotionSample
from vistel.wire.motion.interest import LOUD, NEAR, MotionSubscriptions, loudest, nearest
from vistel.wire.motion.publication import MotionPublication

HERE = [np.zeros(3)]
ROW = {f"p{i:02d}": np.array([float(i), 0.0, 0.0]) for i in range(1, 20)}


def test_the_nearest_are_chosen_and_of_two_at_nearly_the_same_distance_who_was_chosen_before() -> None:
    assert nearest(HERE, ROW) == {f"p{i:02d}" for i in range(1, NEAR + 1)}
    ninth = f"p{NEAR + 1:02d}"
    assert ninth in nearest(HERE, ROW, {ninth}) and f"p{NEAR:02d}" not in nearest(HERE, ROW, {ninth})
    assert nearest([], ROW) == frozenset()


def test_a_loud_voice_far_away_counts_less_than_one_nearby() -> None:
    levels = dict.fromkeys(ROW, -20.0)
    far = {name: float(p[0]) for name, p in ROW.items()}
    assert loudest(levels, far) == {f"p{i:02d}" for i in range(1, LOUD + 1)}
    assert "p19" in loudest(levels | {"p19": 10.0}, far)


def test_more_than_twelve_are_a_crowd() -> None:
    sites = [{"name": f"s{i}", "participants": [{"name": f"p{i}"}]} for i in range(CROWD + 1)]
    assert Conference.model_validate({"room": {"seats": 20}, "sites": sites}).crowd["p12"] == "s12"
    assert not Conference.model_validate({"room": {"seats": 20}, "sites": sites[:CROWD]}).crowd


def test_a_site_of_a_crowd_receives_its_own_and_the_chosen_in_full_and_everybody_thin() -> None:
    async def meet() -> None:
        network, clock = MemoryNetwork(), SystemClock()
        heard = MotionSubscriptions(network.bus("c", "here", clock), {"me": "here", "ann": "a", "ben": "b"}, ["me"])
        people = {
            name: MotionPublication(network.bus("c", site, clock), name, crowded=True)
            for name, site in (("me", "here"), ("ann", "a"), ("ben", "b"))
        }
        heard.choose(["ann"])
        assert heard.chosen == {"ann"}
        start_ns = clock.now_ns()
        for k in range(61):
            for motion in people.values():
                motion.put(MotionSample(motion.next_seq, start_ns + k * 16_666_667, np.zeros(25), np.zeros((2, 20)), np.zeros(4)))
        count = Counter((s.names["participant"], s.topic.name) for s in heard.take())
        thin = {(name, "motion_thin"): 11 for name in people}
        assert count == thin | {("me", "motion"): 61, ("ann", "motion"): 61}
        heard.choose([])
        assert heard.chosen == frozenset()
        heard.close()

    asyncio.run(meet())


def test_everybody_of_a_small_conference_is_received_in_full() -> None:
    async def meet() -> None:
        network, clock = MemoryNetwork(), SystemClock()
        heard = MotionSubscriptions(network.bus("c", "here", clock), {}, ["me"])
        motion = MotionPublication(network.bus("c", "a", clock), "ann", crowded=False)
        heard.choose(["ann"])
        motion.put(MotionSample(motion.next_seq, clock.now_ns(), np.zeros(25), np.zeros((2, 20)), np.zeros(4)))
        assert [s.topic.name for s in heard.take()] == ["motion"]

    asyncio.run(meet())
