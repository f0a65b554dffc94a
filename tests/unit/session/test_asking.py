"""Commands to a world that is just starting, or is not there."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from virtual_time import LoopClock, run

from vistel.session.asking import ANSWER_NS, ENTER_NS, Answer, Asker
from vistel.space.actions import absent, unseen
from vistel.v1.command_pb2 import Command, CommandResult
from vistel.wire import background
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME

Reply = Callable[[Command, float], CommandResult | None]
"""What a world says to a command that reaches it after so many seconds."""


def asked(reply: Reply) -> tuple[Answer, float, list[str]]:
    """The answer, after how many seconds, and the ids of what reached the world."""
    ids: list[str] = []

    async def ask() -> tuple[Answer, float]:
        network, clock = MemoryNetwork(), LoopClock()
        begin_ns, there = clock.now_ns(), network.bus("c", "hub", clock)
        answers = there.publish(BY_NAME["command_result"], participant="ada")

        async def world() -> None:
            async for sample in there.subscribe(BY_NAME["command"], queue_all=True):
                ids.append(sample.message.id)
                if said := reply(sample.message, (clock.now_ns() - begin_ns) * 1e-9):
                    answers.put(said)

        task = background.start(world(), "world")
        asker = Asker(network.bus("c", "here", clock), clock, "ada")
        answer = await asker.ask("undo")
        task.cancel()
        return answer, (clock.now_ns() - begin_ns) * 1e-9

    answer, took = run(ask())
    return answer, took, ids


def result(command: Command, reason: str = "") -> CommandResult:
    outcome = CommandResult.OUTCOME_REFUSED if reason else CommandResult.OUTCOME_DONE
    return CommandResult(id=command.id, outcome=outcome, reason=reason)


def test_a_world_that_starts_later_gets_the_same_command_again_and_does_it_once() -> None:
    answer, took, ids = asked(lambda command, t: result(command) if t > 3.5 else None)
    assert answer.done
    assert 3.5 < took < 4.6
    assert len(ids) > 2
    assert len(set(ids)) == 1


@pytest.mark.parametrize("reason", [absent("ada"), unseen("ada")])
def test_somebody_on_their_way_into_the_room_is_waited_for(reason: str) -> None:
    answer, took, _ = asked(lambda command, t: result(command, reason if t < 2.0 else ""))
    assert answer.done
    assert 2.0 <= took < 2.7


def test_somebody_who_never_comes_is_refused_after_a_while() -> None:
    answer, took, _ = asked(lambda command, t: result(command, absent("ada")))
    assert (answer.done, answer.reason) == (False, "ada is not in the room")
    assert took == pytest.approx(ENTER_NS * 1e-9, abs=1.0)


def test_another_refusal_is_told_at_once() -> None:
    answer, took, ids = asked(lambda command, t: result(command, "there is nothing to undo"))
    assert answer.reason == "there is nothing to undo"
    assert took < 0.1
    assert len(ids) == 1


def test_where_no_world_is_the_answer_says_so() -> None:
    answer, took, _ = asked(lambda command, t: None)
    assert "did not answer" in answer.reason
    assert took == pytest.approx(ANSWER_NS * 1e-9, abs=0.1)
