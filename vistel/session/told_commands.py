"""Commands to the world and its answers, as pages are told them."""

from __future__ import annotations

import json
from collections import OrderedDict

from vistel.messages.commands import command_text
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME

_KEPT = 16
"""Answers, the newest: a page that is slow gets the newest message only, and misses none of them."""
_ASKED = 64
"""Commands that wait for their answer."""


class ToldCommands:
    """Lives on the event loop."""

    def __init__(self, bus: Bus) -> None:
        self._commands = bus.subscribe(BY_NAME["command"], queue_all=True, polled=True)
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, polled=True)
        self._asked = OrderedDict[tuple[str, str], str]()
        self._answered = OrderedDict[tuple[str, str], dict[str, object]]()
        self._words = json.dumps({"kind": "answers", "answers": []})

    def words(self) -> str:
        """JSON of the newest answers, the oldest first."""
        for sample in self._commands.take():
            self._asked[sample.names["participant"], sample.message.id] = command_text(sample.message)
            while len(self._asked) > _ASKED:
                self._asked.popitem(last=False)
        results = self._results.take()
        for sample in results:
            result: CommandResult = sample.message
            key = sample.names["participant"], result.id
            row: dict[str, object] = {"id": result.id, "who": key[0], "text": self._asked.pop(key, "")}
            done = result.outcome == CommandResult.OUTCOME_DONE
            self._answered.setdefault(key, row | {"done": done, "reason": result.reason})
            while len(self._answered) > _KEPT:
                self._answered.popitem(last=False)
        if results:
            self._words = json.dumps({"kind": "answers", "answers": list(self._answered.values())})
        return self._words

    def close(self) -> None:
        """Receive no more."""
        self._commands.close()
        self._results.close()
