"""Background tasks end with their service, and end it when they fail."""

from __future__ import annotations

import asyncio
import logging

import pytest
from virtual_time import run

from vistel.wire import background


async def _failing(after_s: float = 0.1) -> None:
    await asyncio.sleep(after_s)
    raise OSError("no room on the disk")


def test_a_task_that_fails_ends_its_service_and_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    ended: list[str] = []

    async def serve() -> None:
        background.start(_failing(), "save")
        try:
            await asyncio.sleep(10.0)
        finally:
            ended.append("service")

    async def scene() -> None:
        async with background.service("process"):
            await background.start(background.as_service("world", serve()), "services")

    with pytest.raises(background.TaskFailedError):
        run(scene())
    assert ended == ["service"]
    assert [r.getMessage() for r in caplog.records] == [
        "event=task_failed service=world task=save reason=OSError('no room on the disk')"
    ]
    assert caplog.records[0].exc_info is not None


def test_tasks_end_with_their_service() -> None:
    async def scene() -> tuple[bool, bool]:
        async with background.service("world"):
            task = background.start(asyncio.sleep(60.0), "sleep")
            await asyncio.sleep(1.0)
            before = task.done()
        return before, task.cancelled()

    assert run(scene()) == (False, True)


def test_a_service_raises_its_own_error_as_it_is() -> None:
    async def scene() -> None:
        async with background.service("world"):
            background.start(asyncio.sleep(60.0), "sleep")
            raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        run(scene())


def test_a_service_that_is_cancelled_is_cancelled() -> None:
    async def serve() -> None:
        background.start(asyncio.sleep(60.0), "sleep")
        await asyncio.sleep(60.0)

    async def scene() -> bool:
        task = asyncio.create_task(background.as_service("world", serve()))
        await asyncio.sleep(1.0)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return task.cancelled()

    assert run(scene())


def test_cleaning_up_after_a_failure_may_start_tasks() -> None:
    closed: list[bool] = []

    async def close() -> None:
        await asyncio.sleep(0.1)
        closed.append(True)

    async def scene() -> None:
        async with background.service("renderer"):
            background.start(_failing(), "stream")
            try:
                await asyncio.sleep(10.0)
            finally:
                await background.start(close(), "film")

    with pytest.raises(background.TaskFailedError):
        run(scene())
    assert closed == [True]


def test_without_a_service_a_failure_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    async def scene() -> None:
        background.start(_failing(), "repair")
        await asyncio.sleep(1.0)

    with caplog.at_level(logging.ERROR):
        run(scene())
    assert [r.getMessage() for r in caplog.records] == [
        "event=task_failed service=none task=repair reason=OSError('no room on the disk')"
    ]
