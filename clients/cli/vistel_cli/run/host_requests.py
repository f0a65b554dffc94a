"""Starts, stops and restarts the processes of a run of `vistel up` as the host asks over the bus, and answers what runs."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable

from google.protobuf.message import DecodeError

from vistel.v1.service_pb2 import RunFault, RunProcess, RunReply, RunRequest
from vistel.wire import background
from vistel.wire.bus import Bus, Subscription
from vistel.wire.topics import BY_NAME
from vistel_cli.faults.links import Links
from vistel_services.process.plan import HUB
from vistel_services.process.supervisor import Child, Supervisor
from vistel_sim.chaos.kinds import KINDS, Target

log = logging.getLogger("vistel.supervisor")

CONSOLE = f"{HUB}/console"
"""Where the host sits: one that is stopped could not be started again."""
RECORDERS = (f"{HUB}/recorder", f"{HUB}/record")
"""What writes who ended it into the log that ends: it is halted once that has been recorded."""
RECORDED_S = 3.0
"""How long that may take [s]."""
_DOING = {RunRequest.ACTION_START: "starting", RunRequest.ACTION_STOP: "stopping", RunRequest.ACTION_RESTART: "restarting"}


class HostRequests:
    """Answers the console for one run."""

    def __init__(self, supervisor: Supervisor, links: Links, bus: Bus, show: Callable[[str], None]) -> None:
        """links: of sites, empty where none are simulated; show: shows a line in the terminal."""
        self._supervisor, self._links, self._show = supervisor, links, show
        self._under_way: dict[str, asyncio.Task[None]] = {}
        self._recorded = {name: asyncio.Event() for name in RECORDERS}
        self._listening = background.start(self._listen(bus.subscribe(BY_NAME["host_action"])), "host acts")
        bus.serve(BY_NAME["run"], self.answer)

    def answer(self, request: bytes) -> RunReply:
        """Begin what is asked, or say why not; and what runs."""
        reply = RunReply(faults=self._faults())
        try:
            asked = RunRequest.FromString(request)
        except DecodeError:
            return RunReply(refused="no request for a process")
        if asked.action:
            reply.refused = self._objection(asked)
            if not reply.refused:
                reply.done = f"{_DOING[asked.action]} {asked.process}"
                log.warning("event=host_request by=%r action=%s process=%s", asked.by, _DOING[asked.action], asked.process)
                self._show(f"host: {reply.done}")
                if asked.process in self._recorded:
                    self._recorded[asked.process].clear()
                self._under_way[asked.process] = background.start(self._do(asked), f"host request {asked.process}")
        reply.processes.extend(
            RunProcess(name=name, state=self._state(name, child), restarts=child.restarts)
            for name, child in self._supervisor.children.items()
        )
        return reply

    async def end(self) -> None:
        """Finish what is under way."""
        await asyncio.gather(*self._under_way.values(), return_exceptions=True)
        self._listening.cancel()

    def _objection(self, asked: RunRequest) -> str:
        name, child = asked.process, self._supervisor.children.get(asked.process)
        if child is None:
            return f"no process {name[:64]!r}; there are {', '.join(self._supervisor.children)}"
        if asked.action not in _DOING:
            return f"{name}: expected start, stop or restart"
        if name in self._under_way:
            return f"{name}: the last order is still being carried out; wait a moment"
        if asked.action == RunRequest.ACTION_STOP and name == CONSOLE:
            return f"{name}: is this console, which nobody could start again; restart it, or end `vistel up`"
        if child.halted != (asked.action == RunRequest.ACTION_START):
            return f"{name}: {'is stopped; start it' if child.halted else 'runs already'}"
        return ""

    async def _do(self, asked: RunRequest) -> None:
        try:
            if asked.action != RunRequest.ACTION_START:
                if asked.process in self._recorded:  # the console publishes it after it is answered
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(self._recorded[asked.process].wait(), RECORDED_S)
                await self._supervisor.halt(asked.process)
            if asked.action != RunRequest.ACTION_STOP:
                await self._supervisor.resume(asked.process)
        except OSError as e:
            log.error("event=not_started process=%s reason=%r", asked.process, str(e))
        finally:
            del self._under_way[asked.process]

    async def _listen(self, acts: Subscription) -> None:
        async for act in acts:
            if act.message.text in self._recorded:
                self._recorded[act.message.text].set()

    def _state(self, name: str, child: Child) -> RunProcess.State:
        if child.halted and child.pid is not None:
            return RunProcess.STATE_ENDING
        if child.halted and name not in self._under_way:
            return RunProcess.STATE_STOPPED
        return RunProcess.STATE_RUNNING if child.pid is not None else RunProcess.STATE_STARTING

    def _faults(self) -> list[RunFault]:
        targets = {Target.PROCESS: list(self._supervisor.children), Target.SITE: list(self._links), Target.CONFERENCE: []}
        return [
            RunFault(name=k.name, about=k.about, seconds=k.seconds, amount=k.amount, unit=k.unit, targets=targets[k.target])
            for k in KINDS.values()
            if k.target is not Target.SITE or self._links
        ]
