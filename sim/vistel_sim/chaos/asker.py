"""Somebody who asks the room for things all the time: creates them, and has them taken away."""

import asyncio
import random
import secrets

from vistel.conference.connect import connect
from vistel.conference.model import Conference
from vistel.v1.command_pb2 import Command, CommandResult
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import set_clock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus

ANSWER_S = 4.0
"""An answer that has not come by then is not waited for; it may still come."""
PAUSE_S = (0.3, 1.5)
"""Between two commands [s]."""
MOST_THINGS = 3
"""Of one asker in the room."""


class Asker:
    """Asks as `participant`, one command after the other, until cancelled."""

    def __init__(self, bus: ZenohBus, clock: SystemClock, participant: str, rng: random.Random) -> None:
        self._bus, self._clock, self._who, self._rng = bus, clock, participant, rng
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, participant=participant)
        self._things: list[str] = []
        self.asked = 0
        self.done = 0
        self.refused = 0
        self.late = 0
        """Without an answer in time."""

    @staticmethod
    async def open(conference: Conference, site: str, router: str, participant: str, rng: random.Random) -> "Asker":
        """router: the endpoint at which the site finds it."""
        clock = SystemClock()
        bus = await connect(conference, site, clock, router)
        return Asker(bus, clock, participant, rng)

    async def run(self) -> None:
        """Ask until cancelled."""
        while True:
            await set_clock(self._bus, self._clock)
            command = Command(id=secrets.token_hex(8), participant=self._who)
            if len(self._things) < MOST_THINGS and self._rng.random() < 0.6:
                command.create.shape, command.create.size = "box", 0.02
            elif self._things:
                command.delete.thing = self._things.pop(0)
            else:
                continue
            command.header.t_ns = self._clock.now_ns()
            self._commands.put(command)
            self.asked += 1
            await self._answer(command)
            await asyncio.sleep(self._rng.uniform(*PAUSE_S))

    async def close(self) -> None:
        """Leave."""
        await self._bus.close()

    async def _answer(self, command: Command) -> None:
        try:
            async with asyncio.timeout(ANSWER_S):
                async for sample in self._results:
                    result: CommandResult = sample.message
                    if result.id != command.id:
                        continue
                    if result.outcome == CommandResult.OUTCOME_DONE:
                        self.done += 1
                        self._things += result.things if command.HasField("create") else []
                    else:
                        self.refused += 1
                    return
        except TimeoutError:
            self.late += 1
