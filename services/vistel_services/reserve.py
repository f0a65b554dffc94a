"""Keeps one warm process waiting (`vistel_services.standby`) and hands it out when another has died."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import signal
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

log = logging.getLogger("vistel.supervisor")

Process = asyncio.subprocess.Process

READY = b"ready\n"
"""What a standby says on its standard output when it has loaded."""

REFILL_AFTER_S = 2.0
"""The next one is loaded when the one that took over has had the machine for a while."""
RETRY_FIRST_S, RETRY_MOST_S = 5.0, 300.0
STOP_S = 2.0


@dataclass(frozen=True)
class StandbySpec:
    """argv: of vistel_services.standby; env: None for this process's; after_s: when the first one is started."""

    argv: tuple[str, ...]
    env: dict[str, str] | None = None
    after_s: float = 3.0


def order(log_file: Path, arguments: Sequence[str]) -> bytes:
    """The line that makes a standby the process that `arguments` of vistel_services.host describe."""
    return json.dumps({"log": str(log_file), "arguments": list(arguments)}).encode() + b"\n"


class Reserve:
    """One process that waits, or is loading; its own words go to `log_file` until it takes over."""

    def __init__(self, spec: StandbySpec, log_file: Path) -> None:
        self._spec, self._log_file = spec, log_file
        self._process: Process | None = None
        self._ready = False
        self._taken = asyncio.Event()
        self._task = asyncio.create_task(self._keep(), name="standby")

    @property
    def ready(self) -> bool:
        """Whether one waits now."""
        return self._ready and self._process is not None and self._process.returncode is None

    @property
    def pid(self) -> int | None:
        """Of the one that waits or loads."""
        return self._process.pid if self._process is not None and self._process.returncode is None else None

    def take(self, log_file: Path, arguments: Sequence[str]) -> Process | None:
        """The process that waited, from now on what `arguments` say; None when there is none.

        If it dies of the order, it dies as what it became: whoever watches that starts it again.
        """
        process = self._process
        if not self.ready or process is None or process.stdin is None:
            return None
        process.stdin.write(order(log_file, arguments))
        process.stdin.close()
        self._process, self._ready = None, False
        self._taken.set()
        return process

    async def stop(self) -> None:
        """End the one that waits or loads."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)
        process, self._process, self._ready = self._process, None, False
        if process is None or process.returncode is not None:
            return
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGTERM)
        try:
            await asyncio.wait_for(process.wait(), STOP_S)
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
        log.info("standby stopped pid=%d", process.pid)

    async def _keep(self) -> None:
        wait_s, retry_s = self._spec.after_s, RETRY_FIRST_S
        while True:
            await asyncio.sleep(wait_s)
            if await self._one():
                wait_s, retry_s = REFILL_AFTER_S, RETRY_FIRST_S
                continue
            log.error("standby died restart_in_s=%.0f log=%s", retry_s, self._log_file)
            wait_s, retry_s = retry_s, min(RETRY_MOST_S, 2 * retry_s)

    async def _one(self) -> bool:
        """Start one and keep it until it is taken (True) or dies (False)."""
        self._taken.clear()
        started = asyncio.get_running_loop().time()
        try:
            with self._log_file.open("ab") as out:
                process = self._process = await asyncio.create_subprocess_exec(
                    *self._spec.argv, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=out,
                    env=self._spec.env, process_group=0,
                )  # fmt: skip
        except OSError as e:
            log.error("standby not started reason=%s", e)
            return False
        assert process.stdout is not None
        if await process.stdout.readline() == READY:
            self._ready = True
            log.info("standby ready pid=%d after_s=%.1f", process.pid, asyncio.get_running_loop().time() - started)
        exited, taken = asyncio.create_task(process.wait()), asyncio.create_task(self._taken.wait())
        try:
            await asyncio.wait((exited, taken), return_when=asyncio.FIRST_COMPLETED)
            return self._taken.is_set()
        finally:
            exited.cancel()
            taken.cancel()
            if not self._taken.is_set():
                self._ready = False
