"""Background tasks: work beside a service's own, such as a heartbeat, a repair or a fetch.

A background task belongs to the service within which it was started. When it raises, that is logged once
(`event=task_failed`) and the service ends with `TaskFailedError`; who supervises the service starts it anew, with
back-off. Every task whose result nobody awaits is started here, so that none can fail unseen.
"""

import asyncio
import logging
from collections.abc import AsyncGenerator, Awaitable, Coroutine
from contextlib import asynccontextmanager
from contextvars import ContextVar
from typing import Any, TypeVar

log = logging.getLogger("vistel.background")

T = TypeVar("T")


class TaskFailedError(RuntimeError):
    """A background task failed, which ended its service. The failure has been logged."""


class Background:
    """The background tasks of one service. Made by `service`; found by `current`."""

    def __init__(self, name: str, group: asyncio.TaskGroup | None) -> None:
        """name: of the service. group: holds the tasks; None where no service is running: failures are logged, no more."""
        self.name = name
        self._group = group
        self._tasks: set[asyncio.Task[Any]] = set()
        self.failed = ""
        """The first task that failed; empty while none has."""

    def start(self, coroutine: Coroutine[Any, Any, T], name: str) -> asyncio.Task[T]:
        """Run `coroutine` beside the service, until it returns, its task is cancelled or the service ends. Event loop only."""
        make = asyncio.get_running_loop() if self._group is None else self._group
        task = make.create_task(coroutine, name=name)
        self._tasks.add(task)  # the loop holds its tasks weakly
        task.add_done_callback(self._ended)
        return task

    def _ended(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        error = None if task.cancelled() else task.exception()
        if error is None:
            return
        self._group = None  # a group with a failed task takes no more
        self.failed = self.failed or task.get_name()
        if not _logged(error):
            log.error("event=task_failed service=%s task=%s reason=%r", self.name, task.get_name(), error, exc_info=error)

    def end(self) -> None:
        """Cancel the tasks; those that are started from now on belong to no service."""
        self._group = None
        for task in self._tasks:
            task.cancel()


_NONE = Background("none", None)
_current: ContextVar[Background] = ContextVar("background", default=_NONE)


def current() -> Background:
    """The background tasks of the service that is running here. Objects that are called from other threads keep it."""
    return _current.get()


def start(coroutine: Coroutine[Any, Any, T], name: str) -> asyncio.Task[T]:
    """Run `coroutine` as a background task of the service that is running here."""
    return current().start(coroutine, name)


@asynccontextmanager
async def service(name: str) -> AsyncGenerator[Background]:
    """Code within the block is the service `name`. Its background tasks end with the block; one that fails ends the block.

    Raises TaskFailedError for a background task, and what the block itself raises.
    """
    background = _NONE
    try:
        async with asyncio.TaskGroup() as group:
            background = Background(name, group)
            before = _current.set(background)
            try:
                yield background
            finally:
                _current.reset(before)
                background.end()
    except BaseExceptionGroup as errors:
        first = errors.exceptions[0]
        if background.failed:
            raise TaskFailedError(f"{name}: background task {background.failed!r} failed") from first
        raise first from first.__cause__


async def as_service(name: str, coroutine: Awaitable[T]) -> T:
    """Await `coroutine` as the service `name`. Raises as `service` does."""
    async with service(name):
        return await coroutine


def _logged(error: BaseException) -> bool:
    group: tuple[BaseException, ...] | None = getattr(error, "exceptions", None)
    return isinstance(error, TaskFailedError) if group is None else all(_logged(e) for e in group)
