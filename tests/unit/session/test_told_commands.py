"""Pages are told commands with their answers."""

import json
from typing import Any

from virtual_time import LoopClock, run

from vistel.messages.commands import message_of
from vistel.session.told_commands import ToldCommands
from vistel.space.actions import Undo
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME


def test_an_answer_is_told_with_what_was_asked_once_and_the_newest_are_kept() -> None:
    async def scene() -> list[list[dict[str, Any]]]:
        network, clock = MemoryNetwork(), LoopClock()
        site, world = network.bus("demo", "tokyo", clock), network.bus("demo", "hub", clock)
        told = ToldCommands(network.bus("demo", "page", clock))
        asks = site.publish(BY_NAME["command"], participant="ann")
        answers = world.publish(BY_NAME["command_result"], participant="ann")
        out = list[list[dict[str, Any]]]()
        for n in range(20):
            asks.put(message_of(Undo(), str(n), "ann"))
            for _ in range(2):
                answers.put(CommandResult(id=str(n), outcome=CommandResult.OUTCOME_REFUSED, reason="nothing to undo"))
            out.append(json.loads(told.words())["answers"])
        told.close()
        return out

    first, *_, last = run(scene())
    assert first == [{"id": "0", "who": "ann", "text": "undo", "done": False, "reason": "nothing to undo"}]
    assert [row["id"] for row in last] == [str(n) for n in range(4, 20)]
