"""Random faults under a room, the same in every run: what must hold does, and each thing that does not is found in its log."""

from __future__ import annotations

import asyncio
import copy
import random
from collections.abc import Callable
from typing import Any

import pytest
from test_world_life import another_world
from world_site import PEOPLE, WorldSite

from vistel.messages.world.verify import Record, verify
from vistel.v1.command_pb2 import Command, CommandResult
from vistel.wire.topics import BY_NAME
from vistel_sim.chaos.invariants import commands_once_and_in_order, one_leader

DONE = CommandResult.OUTCOME_DONE


class Askers:
    """Everybody creates things and has them taken away."""

    def __init__(self, site: WorldSite, rng: random.Random) -> None:
        self._site, self._rng = site, rng
        self._number = 0
        self._things: list[str] = []
        self._read = 0

    async def play(self, seconds: float) -> None:
        for _ in range(round(seconds * 10)):
            for result in self._site.results()[self._read :]:
                self._things += result.things if result.id.startswith("create") else []
            self._read = len(self._site.results())
            self._ask(self._rng.choice(PEOPLE)[1])
            await self._site.play(0.1)

    def _ask(self, who: str) -> None:
        self._number += 1
        command = Command(id=f"create-{self._number}", participant=who)
        command.create.shape = "box"
        if len(self._things) > 2:
            command = Command(id=f"delete-{self._number}", participant=who)
            command.delete.thing = self._things.pop(0)
        command.header.t_ns = self._site.clock.now_ns()
        self._site.buses[who].publish(BY_NAME["command"], participant=who).put(command)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> list[Record]:
    """What was heard of some seconds in which the world is killed, the room moves, and sites are cut off."""
    folder = tmp_path_factory.mktemp("chaos")
    rng = random.Random(22)

    async def play() -> list[Record]:
        site = WorldSite(folder)
        async with site.open():
            askers = Askers(site, rng)
            await askers.play(1.0)
            for fault in ("kill", "move", "cut", "kill", "cut", "move"):
                if fault == "kill":
                    await site.kill()
                    await askers.play(rng.uniform(0.1, 0.6))
                    await site.start()
                elif fault == "move":
                    async with another_world(site, folder / f"elsewhere-{rng.random()}"):
                        await askers.play(rng.uniform(0.3, 0.6))
                else:
                    away = rng.choice(PEOPLE)[1]
                    site.away.add(away)
                    await askers.play(rng.uniform(0.1, 0.5))
                    site.away.discard(away)
                await askers.play(rng.uniform(0.2, 0.6))
            await site.play(1.0)
        return site.log

    return asyncio.run(play())


def test_a_room_under_faults_keeps_what_must_hold(log: list[Record]) -> None:
    assert one_leader(log) == []
    assert commands_once_and_in_order(log) == []
    report = verify(log)
    assert report.equal and report.lives >= 3, report.difference
    assert sum(m.outcome == DONE for topic, _, m, _ in log if topic == "command_result") > 20
    assert {m.header.term for topic, _, m, _ in log if topic == "world_inputs"} >= {0, 1}


def changed(
    log: list[Record], topic: str, change: Callable[[Any], object], which: Callable[[Any], bool] = lambda _: True
) -> list[Record]:
    """The log, in which the middle one of the messages of `topic` that are meant is another one."""
    at = [i for i, r in enumerate(log) if r[0] == topic and which(r[2])]
    i = at[len(at) // 2]
    message = copy.deepcopy(log[i][2])
    change(message)
    return [*log[:i], (topic, log[i][1], message, log[i][3]), *log[i + 1 :]]


def done_ids(log: list[Record]) -> list[str]:
    """Ids of the commands that were done, in the order in which they were answered."""
    return list(dict.fromkeys(m.id for topic, _, m, _ in log if topic == "command_result" and m.outcome == DONE))


def made_last(log: list[Record]) -> set[str]:
    """Ids of the commands that made what is there at the end."""
    made: dict[str, str] = {}
    results = {m.id: m for topic, _, m, _ in log if topic == "command_result"}
    for name in done_ids(log):
        for thing in results[name].things:
            if name.startswith("create"):
                made[thing] = name
            else:
                made.pop(thing, None)
    return set(made.values())


@pytest.mark.parametrize("topic", ["world_inputs", "world_state"])
def test_a_second_leader_is_found(log: list[Record], topic: str) -> None:
    last = [r for r in log if r[0] == topic][-1]
    assert "was told after step" in one_leader([*log, last])[0]
    old = copy.deepcopy(last[2])
    old.step += 1
    old.header.term = 0
    assert f"step {old.step} was told under term 0, after step" in one_leader([*log, (topic, last[1], old, last[3])])[0]


def test_a_world_that_lost_steps_which_it_had_told_is_found(log: list[Record]) -> None:
    inputs = [r for r in log if r[0] == "world_inputs"]
    assert "was told after step" in one_leader([*inputs, *inputs[-5:]])[0]


def test_a_command_that_was_acknowledged_and_never_done_is_found(log: list[Record]) -> None:
    done = done_ids(log)
    lost = changed(log, "world_inputs", lambda m: m.ClearField("command_ids"), lambda m: any(i in done for i in m.command_ids))
    assert any("was acknowledged as done" in line for line in commands_once_and_in_order(lost))


def test_a_command_that_was_done_twice_is_found(log: list[Record]) -> None:
    result = next(r for r in log if r[0] == "command_result" and r[2].outcome == DONE)
    again = copy.deepcopy(result[2])
    again.step += 10
    again.things[:] = ["box-99"]
    assert "was answered as" in commands_once_and_in_order([*log, ("command_result", result[1], again, result[3])])[0]


def test_commands_of_one_person_in_another_order_are_found(log: list[Record]) -> None:
    done = done_ids(log)
    first, second = [i for i, r in enumerate(log) if r[0] == "command" and r[1]["participant"] == "aiko" and r[2].id in done][:2]
    earlier = [*log[:first], log[second], *log[first:second], *log[second + 1 :]]
    assert any("which was asked earlier" in line for line in commands_once_and_in_order(earlier))


def test_a_thing_that_was_made_and_has_gone_is_found(log: list[Record]) -> None:
    lost = changed(log, "command_result", lambda m: m.things.__setitem__(0, "box-99"), lambda m: m.id in made_last(log))
    assert "box-99 was made, and is not there at the end" in commands_once_and_in_order(lost)


def test_a_thing_that_nobody_asked_for_is_found(log: list[Record]) -> None:
    known = set(done_ids(log)) - made_last(log)
    unasked = [r for r in log if r[0] != "command" or r[2].id in known]
    assert any("never acknowledged as made" in line for line in commands_once_and_in_order(unasked))


def test_an_answer_that_is_heard_before_the_question_and_a_deed_that_nobody_was_told_of_are_no_violations(
    log: list[Record],
) -> None:
    first = {r[2].id: i for i, r in reversed([*enumerate(log)]) if r[0] == "command_result"}
    asked = {r[2].id: i for i, r in enumerate(log) if r[0] == "command"}
    places = {i: float(i) for i in range(len(log))} | {at: first[name] + 0.5 for name, at in asked.items() if name in first}
    late = [log[i] for i in sorted(places, key=lambda i: places[i])]
    assert commands_once_and_in_order(late) == []
    gone = next(i for i in done_ids(log) if not i.startswith("create"))
    untold = [r for r in log if r[0] != "command_result" or r[2].id != gone]
    assert commands_once_and_in_order(untold) == []
