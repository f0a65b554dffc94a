"""A log re-runs to the same bytes; a log that was tampered with does not."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from itertools import pairwise

import pytest
from world_site import WorldSite

from vistel.messages.world.verify import Record, verify
from vistel.v1.command_pb2 import Command, MoveThing, ResetRoom
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.v1.world_pb2 import HandForce
from vistel.wire.motion import MotionDecoder, MotionEncoder
from vistel.wire.topics import BY_NAME


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> list[Record]:
    """Five seconds with a grasp, commands, somebody leaving, and a world killed and started again."""

    async def record() -> list[Record]:
        site = WorldSite(tmp_path_factory.mktemp("world"))
        async with site.open():
            await site.play(1.6, from_s=2.2)
            command = Command(id="x", participant="chidi")
            command.move.CopyFrom(MoveThing(thing="box", pose=Pose(position=Vec3(x=0.1, y=0.9, z=0.2))))
            site.buses["chidi"].publish(BY_NAME["command"], participant="chidi").put(command)
            await site.play(1.2)
            await site.kill()
            await site.play(0.4)
            await site.start()
            await site.play(0.5)
            site.buses["bruno"].publish(BY_NAME["command"], participant="bruno").put(
                Command(id="y", participant="bruno", reset=ResetRoom())
            )
            await site.play(1.5)
        return site.log

    return asyncio.run(record())


def test_every_state_of_a_log_is_the_same_again(log: list[Record]) -> None:
    report = verify(log)
    assert report.difference == ""
    assert report.equal
    assert report.lives == 2
    assert report.skipped == 0
    assert report.steps == sum(topic in ("world_state", "world_key") for topic, *_ in log)
    assert report.hand_forces == sum(topic == "hand_force" for topic, *_ in log) > 100


def test_a_hand_force_that_was_changed_is_found(log: list[Record]) -> None:
    at = [i for i, r in enumerate(log) if r[0] == "hand_force" and r[2].touches][40]
    topic, names, message, log_ns = log[at]
    changed = HandForce.FromString(message.SerializeToString())
    changed.force.y += 0.01
    report = verify([*log[:at], (topic, names, changed, log_ns), *log[at + 1 :]])
    assert not report.equal
    assert f"{message.participant}'s" in report.difference and "feels" in report.difference


def test_a_hand_that_stops_touching_publishes_that_once(log: list[Record]) -> None:
    by_hand: dict[str, list[HandForce]] = {}
    for topic, names, message, _ in log:
        if topic == "hand_force":
            assert names == {"conference": "demo", "participant": message.participant, "hand": "right" if message.right else "left"}
            by_hand.setdefault(names["participant"] + names["hand"], []).append(message)
    ended = [m for said in by_hand.values() for m in said if not m.touches]
    assert ended
    for said in by_hand.values():
        for before, after in pairwise(said):
            assert before.touches or after.touches
            if not before.touches:
                assert after.step > before.step
    assert all(m.force.x == m.force.y == m.force.z == 0.0 for m in ended)


def test_a_log_that_begins_in_the_middle_is_compared_from_the_next_state(log: list[Record]) -> None:
    report = verify(log[len(log) // 4 :])
    assert report.equal
    assert 0 < report.skipped < 130
    assert report.steps > 80


def test_a_log_that_is_cut_off_is_compared_as_far_as_it_goes(log: list[Record]) -> None:
    report = verify(log[: len(log) * 2 // 3])
    assert report.equal
    assert report.steps > 80


def test_a_motion_missing_from_the_log_costs_less_than_a_second(log: list[Record]) -> None:
    gone = [i for i, r in enumerate(log) if r[0] == "motion"][150]
    report = verify(log[:gone] + log[gone + 1 :])
    assert report.equal
    assert 0 < report.skipped <= 75
    assert "motion" in " ".join(report.skipped_because)


def test_a_state_missing_from_the_log_is_not_a_difference(log: list[Record]) -> None:
    gone = [i for i, r in enumerate(log) if r[0] == "world_state"][50]
    report = verify(log[:gone] + log[gone + 1 :])
    assert report.equal
    assert report.skipped == 1


def test_motions_written_after_the_step_that_used_them_are_found(log: list[Record]) -> None:
    late = sorted(log, key=lambda r: (r[3] // 500_000_000, r[0] == "motion"))
    assert verify(late).equal


def test_a_changed_state_is_found_and_named(log: list[Record]) -> None:
    index = [i for i, r in enumerate(log) if r[0] == "world_key"][1]
    topic, names, message, log_ns = log[index]
    changed = type(message).FromString(message.SerializeToString())
    changed.states[5].pose.position.x += 1e-6
    report = verify([*log[:index], (topic, names, changed, log_ns), *log[index + 1 :]])
    assert not report.equal
    assert f"step {message.step}: states" in report.difference


def test_a_changed_motion_is_found(log: list[Record]) -> None:
    index = [i for i, r in enumerate(log) if r[0] == "motion" and r[1]["participant"] == "aiko"][70]
    topic, names, message, log_ns = log[index]
    decoder = MotionDecoder()
    before = [r[2] for r in log[: index + 1] if r[0] == "motion" and r[1]["participant"] == "aiko"]
    sample = [decoder.decode(m) for m in before][-1]
    assert sample is not None
    body = sample.body.copy()
    body[2] += math.radians(4.0)
    changed = MotionEncoder().encode(replace(sample, body=body))
    changed.header.version = message.header.version
    report = verify([*log[:index], (topic, names, changed, log_ns), *log[index + 1 :]])
    assert not report.equal


def test_a_log_without_a_world_says_so() -> None:
    report = verify([])
    assert not report.equal
    assert "world_inputs" in report.difference
