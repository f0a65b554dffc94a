"""Starts processes, starts them again when they crash, and stops them in order.

With fork servers they are forked from a process that has loaded what they need, which takes milliseconds; without one, or
when it fails, each is started from nothing.
"""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from vistel.wire import alive, background
from vistel_services.process.forking import ForkServer, Process, send_signal

log = logging.getLogger("vistel.supervisor")

RESTART_FIRST_S = 0.1
"""Back-off before the first start that has to wait [s]; it doubles."""
RESTART_MOST_S = 5.0
"""The longest back-off [s]."""
SILENT_S = 60.0
"""A process whose event loop gave no sign of life for so long hangs [s]. Generous: a machine may be overloaded."""
STARTING_S = 300.0
"""As SILENT_S, before its first sign of life: it loads its modules until then, which may take long on a busy machine [s]."""
ABORT_S = 2.0
"""How long a process that hangs may take to write down what it was doing [s]."""
ENDING_S = 120.0
"""How long a process that gives signs of life may take to end [s]: on a busy machine a film's last pictures take long."""
STEADY_S = 10.0
"""A process that ran for less has failed early. The first failure in a row is mended at once, the next ones after a
back-off and from nothing: what is loaded may be the cause."""


@dataclass(frozen=True)
class ProcessSpec:
    """What to run. `stop_rank`: higher ranks are stopped first; `grace_s`: how long it may stay silent while it stops; `module`:
    what has the `main` that runs, with `arguments`, so that it can be forked, None if it cannot; `alive`: the file of its signs of
    life (`vistel.wire.alive`), None if it gives none; `server`: the fork server that has loaded what it needs."""

    name: str
    argv: tuple[str, ...]
    stop_rank: int = 0
    grace_s: float = 20.0
    env: dict[str, str] | None = None
    module: str | None = None
    arguments: tuple[str, ...] = ()
    alive: Path | None = None
    server: str = ""


@dataclass
class Child:
    """A supervised process and its history."""

    spec: ProcessSpec
    process: Process | None = None
    restarts: int = 0
    exits: list[int] = field(default_factory=list)
    killed: bool = False
    """By somebody else, while everything was about to stop."""
    halted: bool = False
    """By the host: it does not run until it is told to."""

    @property
    def pid(self) -> int | None:
        return self.process.pid if self.process and self.process.returncode is None else None


class Supervisor:
    """Runs `specs`; each process's output goes to `log_folder`/NAME.log. `fork_servers`: by name, stopped with the rest;
    `silent_s`, `starting_s`: see SILENT_S, STARTING_S."""

    def __init__(
        self,
        specs: Sequence[ProcessSpec],
        log_folder: Path,
        fork_servers: Mapping[str, ForkServer] = MappingProxyType({}),
        silent_s: float = SILENT_S,
        starting_s: float = STARTING_S,
    ) -> None:
        self._silent_s, self._starting_s = silent_s, starting_s
        self.children = {s.name: Child(s) for s in specs}
        self._folder = log_folder
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self.fork_servers = fork_servers
        self.on_exit: Callable[[str, int], None] | None = None

    async def start(self) -> None:
        """Start all, in the order given, but those of each fork server as soon as it has loaded."""
        self._folder.mkdir(parents=True, exist_ok=True)
        await asyncio.gather(*(self._start(server) for server in {c.spec.server for c in self.children.values()}))

    async def _start(self, server: str) -> None:
        if server in self.fork_servers:
            await self.fork_servers[server].settled()
        for name, child in self.children.items():
            if child.spec.server == server and not child.halted:
                await self._begin(name)

    async def _begin(self, name: str) -> None:
        await self._spawn(self.children[name])
        self._tasks[name] = background.start(self._watch(self.children[name]), f"watch {name}")

    async def halt(self, name: str) -> None:
        """Stop one process, as `stop` does, until `resume`."""
        child = self.children[name]
        child.halted = True
        if (watching := self._tasks.pop(name, None)) is not None:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
        await _stop(child, asyncio.Event())
        log.info("halted process=%s", name)

    async def resume(self, name: str) -> None:
        """Start one that was halted. Raises OSError where the system cannot."""
        await self._begin(name)
        self.children[name].halted = False

    def log_file(self, name: str) -> Path:
        return self._folder / f"{name.replace('/', '-')}.log"

    async def _spawn(self, child: Child, *, afresh: bool = False) -> None:
        """afresh: from nothing, even if it could be forked."""
        starting = asyncio.gather(self._started(child.spec, afresh=afresh))
        try:
            await asyncio.shield(starting)
        finally:  # where everything stops meanwhile, it is asked to end as the others are
            (child.process,) = await starting

    async def _started(self, spec: ProcessSpec, *, afresh: bool) -> Process:
        log_file, server = self.log_file(spec.name), self.fork_servers.get(spec.server)
        if server is not None and spec.module is not None and not afresh:
            forked = await server.fork(spec.module, log_file, spec.arguments, f"vistel: {spec.name}")
            if forked is not None:
                log.info("forked process=%s pid=%d", spec.name, forked.pid)
                return forked
        with log_file.open("ab") as out:
            process = await asyncio.create_subprocess_exec(
                *spec.argv, stdin=asyncio.subprocess.DEVNULL, stdout=out, stderr=out, env=spec.env, process_group=0
            )
        log.info("started process=%s pid=%d", spec.name, process.pid)
        return process

    async def _spawned(self, child: Child, *, afresh: bool) -> bool:
        """Whether it could be started: the system may be short of processes, memory or files for a while."""
        try:
            await self._spawn(child, afresh=afresh)
        except OSError as e:
            log.error("not started process=%s reason=%r", child.spec.name, str(e))
            return False
        return True

    async def _watch(self, child: Child) -> None:
        loop = asyncio.get_running_loop()
        early = 0
        while child.process is not None:
            started = loop.time()
            watchdog = background.start(self._watchdog(child.spec, child.process), f"watchdog {child.spec.name}")
            try:
                code = await child.process.wait()
            finally:
                watchdog.cancel()
            child.exits.append(code)
            if self.on_exit:
                self.on_exit(child.spec.name, code)
            early = early + 1 if loop.time() - started < STEADY_S else 0
            wait_s = 0.0 if early < 2 else min(RESTART_MOST_S, RESTART_FIRST_S * 2 ** (early - 2))
            name, file = child.spec.name, self.log_file(child.spec.name)
            log.error("crashed process=%s %s restart_in_s=%.1f log=%s", name, _exit_text(code), wait_s, file)
            await asyncio.sleep(wait_s)
            child.restarts += 1
            while not await self._spawned(child, afresh=wait_s > 0):
                wait_s = min(RESTART_MOST_S, max(RESTART_FIRST_S, 2 * wait_s))
                await asyncio.sleep(wait_s)

    async def _watchdog(self, spec: ProcessSpec, process: Process) -> None:
        """End `process` when it has fallen silent. Looks are counted, not time: while this process is paused, or the machine
        sleeps, nobody counts as silent."""
        if spec.alive is None:
            return
        period_s = min(alive.PERIOD_S, self._silent_s / 4)
        before = seen = alive.last(spec.alive)
        silent, most_s = 0, self._starting_s
        while silent * period_s < most_s:
            await asyncio.sleep(period_s)
            last = alive.last(spec.alive)
            silent, seen = silent + 1 if last == seen else 0, last
            most_s = self._starting_s if seen == before else self._silent_s
        log.error("event=process_hangs process=%s silent_s=%.0f log=%s", spec.name, most_s, self.log_file(spec.name))
        send_signal(process, signal.SIGABRT)
        await asyncio.sleep(ABORT_S)
        send_signal(process, signal.SIGKILL)

    async def stop(self, at_once: asyncio.Event | None = None) -> dict[str, int]:
        """Stop rank by rank: SIGTERM, then SIGKILL for one that gives no sign of life for its grace time, takes longer than
        ENDING_S, or is not to be waited for any longer because `at_once` is set. Returns the exit code of each; 0 for one that
        somebody else killed just before: it would have been started again."""
        hurry = at_once or asyncio.Event()
        for task in self._tasks.values():
            task.cancel()
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)
        await asyncio.gather(*(server.stop() for server in self.fork_servers.values()))
        for rank in sorted({c.spec.stop_rank for c in self.children.values()}, reverse=True):
            await asyncio.gather(*(_stop(c, hurry) for c in self.children.values() if c.spec.stop_rank == rank))
        return {n: 0 if c.killed or c.halted else c.process.returncode or 0 for n, c in self.children.items() if c.process}


async def _stop(child: Child, hurry: asyncio.Event) -> None:
    if child.process is None or (child.halted and child.pid is None):
        return
    send_signal(child.process, signal.SIGTERM)
    if impatience := await _not_ended(child.process, child.spec, hurry):
        send_signal(child.process, signal.SIGKILL)
        await child.process.wait()
        log.error("killed process=%s reason=%r", child.spec.name, impatience)
    elif child.process.returncode == -signal.SIGKILL:
        child.killed = True
        log.error("crashed process=%s signal=SIGKILL restart=no, everything stops", child.spec.name)


async def _not_ended(process: Process, spec: ProcessSpec, hurry: asyncio.Event) -> str:
    """Wait while `process` ends; why that is not worth waiting for any longer, empty when it has ended. Looks are counted, not
    time, as the watchdog does."""
    period_s = min(alive.PERIOD_S, spec.grace_s / 4)
    seen, silent, looks = 0, 0, 0
    ended, hurried = background.start(process.wait(), "end"), background.start(hurry.wait(), "hurry")
    try:
        while True:
            await asyncio.wait({ended, hurried}, timeout=period_s, return_when=asyncio.FIRST_COMPLETED)
            last = alive.last(spec.alive) if spec.alive is not None else 0
            silent, seen, looks = silent + 1 if last == seen else 0, last, looks + 1
            if ended.done():
                return ""
            if hurried.done():
                return "not waited for"
            if silent * period_s >= spec.grace_s:
                return f"silent for {spec.grace_s:.0f} s while it stopped"
            if looks * period_s >= ENDING_S:
                return f"did not stop within {ENDING_S:.0f} s"
    finally:
        ended.cancel()
        hurried.cancel()


def _exit_text(code: int) -> str:
    return f"signal={signal.Signals(-code).name}" if code < 0 else f"exit_code={code}"
