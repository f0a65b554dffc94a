"""The supervisor's side of the fork server: starts it, orders processes of it, watches what it forked."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import json
import logging
import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vistel.wire import background

log = logging.getLogger("vistel.supervisor")

READY = b"ready\n"
"""What a fork server says on its standard output when it has loaded."""

LOADING_S = 60.0
"""Until then processes wait for it to be ready; afterwards they are started without it."""
RETRY_FIRST_S = 5.0
"""Wait before a fork server that ended is started again; it doubles each time that it was not ready."""
RETRY_MOST_S = 300.0
"""Longest such wait."""
ANSWER_S = 5.0
STOP_S = 2.0
_PR_SET_CHILD_SUBREAPER = 36


@dataclass(frozen=True)
class ForkServerSpec:
    """argv: of vistel_services.process.fork_server; env: None for this process's."""

    argv: tuple[str, ...]
    env: dict[str, str] | None = None


class ForkedProcess:
    """A process that was forked for this one, with as much of `asyncio.subprocess.Process` as supervising takes."""

    def __init__(self, pid: int) -> None:
        """Raises ProcessLookupError when `pid` is not there, ChildProcessError when it is not a child of this process."""
        self.pid = pid
        self.returncode: int | None = None
        os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        self._fd = os.pidfd_open(pid)
        self._ended = asyncio.Event()
        asyncio.get_running_loop().add_reader(self._fd, self._reap)

    def _reap(self) -> None:
        asyncio.get_running_loop().remove_reader(self._fd)
        os.close(self._fd)
        _, status = os.waitpid(self.pid, 0)
        self.returncode = os.waitstatus_to_exitcode(status)
        self._ended.set()

    async def wait(self) -> int:
        """The exit code, negative for a signal."""
        await self._ended.wait()
        assert self.returncode is not None
        return self.returncode


Process = asyncio.subprocess.Process | ForkedProcess


def send_signal(process: Process, signum: int) -> None:
    """To a process that may have ended. asyncio's own `send_signal` asks first whether it has, which takes its exit code away
    from who waits for it (they are told 255)."""
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, signum)


async def end(process: Process, grace_s: float) -> bool:
    """SIGTERM, then SIGKILL after the grace time; whether it took that."""
    if process.returncode is not None:
        return False
    send_signal(process, signal.SIGTERM)
    try:
        async with asyncio.timeout(grace_s):
            await process.wait()
        return False
    except TimeoutError:
        send_signal(process, signal.SIGKILL)
        await process.wait()
        return True


def _can_fork() -> bool:
    """Whether this system can hand a forked process to its supervisor; makes this process the reaper of orphans."""
    if sys.platform != "linux" or not hasattr(os, "pidfd_open"):
        return False
    try:
        return ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0
    except (OSError, AttributeError):
        return False


class ForkServer:
    """Keeps one fork server; its own words go to `log_file`."""

    @staticmethod
    def open(spec: ForkServerSpec, log_file: Path) -> ForkServer | None:
        """Begins to load at once; None where processes cannot be had this way."""
        return ForkServer(spec, log_file) if _can_fork() else None

    def __init__(self, spec: ForkServerSpec, log_file: Path) -> None:
        self._spec, self._log_file = spec, log_file
        self._process: asyncio.subprocess.Process | None = None
        self._loaded = asyncio.Event()
        self._settled = asyncio.Event()
        self._turn = asyncio.Lock()
        self._task = background.start(self._keep(), "fork server")

    @property
    def ready(self) -> bool:
        """Whether it forks at once."""
        return self._loaded.is_set() and self.pid is not None

    @property
    def pid(self) -> int | None:
        """Of the server, also while it loads."""
        return self._process.pid if self._process is not None and self._process.returncode is None else None

    async def settled(self) -> None:
        """Wait until the first one is ready or it is clear that it will not be."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(LOADING_S):
                await self._settled.wait()

    def fork(self, module: str, log_file: Path, arguments: Sequence[str], title: str) -> asyncio.Task[ForkedProcess | None]:
        """Begin to fork a process that is `module` with `arguments`; None when none can be had this way now. Who is cancelled
        meanwhile has to await it all the same: nobody else knows of the process."""
        order = {"module": module, "log": str(log_file), "arguments": list(arguments), "title": title}
        return background.start(self._fork(json.dumps(order).encode() + b"\n", title), "fork")

    async def _fork(self, order: bytes, title: str) -> ForkedProcess | None:
        async with self._turn:
            process = self._process
            if not self.ready or process is None or process.stdin is None or process.stdout is None:
                return None
            try:
                process.stdin.write(order)
                async with asyncio.timeout(ANSWER_S):
                    pid = int(await process.stdout.readline())
                return ForkedProcess(pid) if pid else None
            except (TimeoutError, ValueError, OSError) as e:
                log.error("not forked process=%s reason=%r log=%s", title, e, self._log_file)
                send_signal(process, signal.SIGKILL)
                return None

    async def stop(self) -> None:
        """End it; what it forked lives on."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)
        if self._process is not None:
            await end(self._process, STOP_S)

    async def _keep(self) -> None:
        retry_s = RETRY_FIRST_S
        while True:
            was_ready = await self._one()
            self._settled.set()
            if was_ready:
                retry_s = RETRY_FIRST_S
            log.error("fork server ended restart_in_s=%.0f log=%s", retry_s, self._log_file)
            await asyncio.sleep(retry_s)
            retry_s = min(RETRY_MOST_S, 2 * retry_s)

    async def _one(self) -> bool:
        """Start one and keep it until it ends; whether it was ready in its time."""
        self._loaded.clear()
        started = asyncio.get_running_loop().time()
        try:
            with self._log_file.open("ab") as out:
                process = self._process = await asyncio.create_subprocess_exec(
                    *self._spec.argv,
                    stdin=asyncio.subprocess.PIPE,
                    stdout=asyncio.subprocess.PIPE,
                    stderr=out,
                    env=self._spec.env,
                    process_group=0,
                )
        except OSError as e:
            log.error("fork server not started reason=%s", e)
            return False
        assert process.stdout is not None
        if await process.stdout.readline() == READY:
            self._loaded.set()
            self._settled.set()
            log.info("fork server ready pid=%d after_s=%.1f", process.pid, asyncio.get_running_loop().time() - started)
        await process.wait()
        return self._loaded.is_set()
