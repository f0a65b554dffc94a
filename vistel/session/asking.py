"""Giving commands to a running world and waiting for its answers; it loads no mathematics."""

from __future__ import annotations

import secrets
from dataclasses import dataclass

from vistel.host import HOST
from vistel.messages.commands import message_of
from vistel.space.actions import Action, absent, unseen
from vistel.space.commands.phrase import read
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME

ANSWER_NS = 10_000_000_000
"""How long `ask` waits for the world's answer: a world that starts on a busy machine takes as long."""
AGAIN_NS = 1_000_000_000
"""How often a command without an answer is given again; the world does it once."""
ENTER_NS = 5_000_000_000
"""How long `ask` waits for its participant to be in the room: just after a conference has started they are on their way."""
ENTER_AGAIN_NS = 100_000_000
"""How often `ask` tries again meanwhile."""
POLL_NS = 20_000_000
"""How often `ask` looks for an answer: a little more often than the world steps."""


@dataclass(frozen=True)
class Answer:
    """The result of a command. things: ids of those it changed or made. reason: why it was refused, else empty."""

    done: bool
    things: tuple[str, ...]
    reason: str


class Asker:
    """Gives commands in the name of `participant`."""

    def __init__(self, bus: Bus, clock: Clock, participant: str) -> None:
        self.participant = participant
        self._clock = clock
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, participant=participant)
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._answers: dict[str, CommandResult] = {}

    def close(self) -> None:
        """End the subscription."""
        self._results.close()

    async def ask(self, command: str | Action) -> Answer:
        """Give a command, as a line that `vistel ask` takes or as an action, and wait for the world's answer.

        Raises PhraseError for a line that is no command.
        """
        action = read(command) if isinstance(command, str) else command
        who, begin_ns = self.participant, self._clock.now_ns()
        coming = () if who == HOST else (absent(who), unseen(who))
        while True:
            answer = await self._answer(action)
            if answer.reason not in coming or self._clock.now_ns() > begin_ns + ENTER_NS:
                return answer
            await self._clock.sleep_until_ns(self._clock.now_ns() + ENTER_AGAIN_NS)

    async def _answer(self, action: Action) -> Answer:
        message = message_of(action, secrets.token_hex(8), self.participant)
        now_ns = again_ns = self._clock.now_ns()
        until_ns = now_ns + ANSWER_NS
        while now_ns < until_ns:
            if now_ns >= again_ns:
                message.header.t_ns = now_ns
                self._commands.put(message)
                again_ns = now_ns + AGAIN_NS
            self._answers |= {sample.message.id: sample.message for sample in self._results.take()}
            result = self._answers.pop(message.id, None)
            if result is not None:
                return Answer(result.outcome == CommandResult.OUTCOME_DONE, tuple(result.things), result.reason)
            await self._clock.sleep_until_ns(now_ns + POLL_NS)
            now_ns = self._clock.now_ns()
        return Answer(False, (), "the world did not answer; `vistel world where` says whether there is one")
