"""Starts processes, starts them again when they crash, and stops them in order."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from vistel_services.reserve import Reserve, StandbySpec

log = logging.getLogger("vistel.supervisor")

RESTART_FIRST_S, RESTART_MOST_S = 0.1, 5.0
STEADY_S = 10.0
"""A process that ran for less has failed early. The first failure in a row is mended at once, the next ones after a
back-off and without the standby, which would only die of the same cause."""


@dataclass(frozen=True)
class ProcessSpec:
    """What to run. `stop_rank`: higher ranks are stopped first; `grace_s`: how long it may take to stop; `host`: the
    arguments of vistel_services.host if that is what runs, so that a standby can take over."""

    name: str
    argv: tuple[str, ...]
    stop_rank: int = 0
    grace_s: float = 8.0
    env: dict[str, str] | None = None
    host: tuple[str, ...] | None = None


@dataclass
class Child:
    """A supervised process and its history."""

    spec: ProcessSpec
    process: asyncio.subprocess.Process | None = None
    restarts: int = 0
    exits: list[int] = field(default_factory=list)

    @property
    def pid(self) -> int | None:
        return self.process.pid if self.process and self.process.returncode is None else None


class Supervisor:
    """Runs `specs`; each process's output goes to `log_folder`/NAME.log."""

    def __init__(self, specs: Sequence[ProcessSpec], log_folder: Path) -> None:
        self.children = {s.name: Child(s) for s in specs}
        self._folder = log_folder
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._reserve: Reserve | None = None
        self.on_exit: Callable[[str, int], None] | None = None

    async def start(self) -> None:
        """Start all, in the order given."""
        self._folder.mkdir(parents=True, exist_ok=True)
        for name, child in self.children.items():
            await self._spawn(child)
            self._tasks[name] = asyncio.create_task(self._watch(child), name=f"watch {name}")

    def keep_standby(self, spec: StandbySpec) -> None:
        """From now on have one warm process waiting that takes over from the next one that dies."""
        self._reserve = Reserve(spec, self.log_file("standby"))

    @property
    def standby(self) -> Reserve | None:
        """What waits, if anything."""
        return self._reserve

    def log_file(self, name: str) -> Path:
        return self._folder / f"{name.replace('/', '-')}.log"

    async def _spawn(self, child: Child) -> None:
        with self.log_file(child.spec.name).open("ab") as out:
            child.process = await asyncio.create_subprocess_exec(
                *child.spec.argv, stdin=asyncio.subprocess.DEVNULL, stdout=out, stderr=out,
                env=child.spec.env, process_group=0,
            )  # fmt: skip
        log.info("started process=%s pid=%d", child.spec.name, child.process.pid)

    async def _watch(self, child: Child) -> None:
        loop = asyncio.get_running_loop()
        early = 0
        while child.process is not None:
            started = loop.time()
            code = await child.process.wait()
            child.exits.append(code)
            if self.on_exit:
                self.on_exit(child.spec.name, code)
            early = early + 1 if loop.time() - started < STEADY_S else 0
            wait_s = 0.0 if early < 2 else min(RESTART_MOST_S, RESTART_FIRST_S * 2 ** (early - 2))
            log.error("crashed process=%s %s restart_in_s=%.1f log=%s",
                      child.spec.name, _exit_text(code), wait_s, self.log_file(child.spec.name))  # fmt: skip
            await asyncio.sleep(wait_s)
            child.restarts += 1
            if wait_s > 0 or not self._take_over(child):
                await self._spawn(child)

    def _take_over(self, child: Child) -> bool:
        """Let the standby become `child`; False when none is ready or it cannot."""
        if self._reserve is None or child.spec.host is None:
            return False
        process = self._reserve.take(self.log_file(child.spec.name), child.spec.host)
        if process is None:
            return False
        child.process = process
        log.info("standby took over process=%s pid=%d", child.spec.name, process.pid)
        return True

    async def stop(self) -> dict[str, int]:
        """Stop rank by rank: SIGTERM, then SIGKILL after the grace time. Returns the exit code of each."""
        for task in self._tasks.values():
            task.cancel()
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)
        if self._reserve is not None:
            await self._reserve.stop()
        for rank in sorted({c.spec.stop_rank for c in self.children.values()}, reverse=True):
            await asyncio.gather(*(_stop(c) for c in self.children.values() if c.spec.stop_rank == rank))
        return {n: c.process.returncode or 0 for n, c in self.children.items() if c.process}


async def _stop(child: Child) -> None:
    process = child.process
    if process is None or process.returncode is not None:
        return
    with contextlib.suppress(ProcessLookupError):
        process.send_signal(signal.SIGTERM)
    try:
        await asyncio.wait_for(process.wait(), child.spec.grace_s)
    except TimeoutError:
        log.error("killed process=%s reason=did not stop within %.0f s", child.spec.name, child.spec.grace_s)
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()


def _exit_text(code: int) -> str:
    return f"signal={signal.Signals(-code).name}" if code < 0 else f"exit_code={code}"
