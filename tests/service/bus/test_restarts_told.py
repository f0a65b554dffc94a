"""The terminal says that a process has ended, and that it is back."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from pathlib import Path

from waiting import until

from vistel_cli.run.restarts import Restarts
from vistel_services.process.supervisor import ProcessSpec, Supervisor

ALIVE = "import asyncio, sys; from pathlib import Path; from vistel.wire import alive; asyncio.run(alive.report(Path(sys.argv[1])))"


def test_a_process_that_was_killed_is_said_to_be_back_once_it_gives_signs_of_life(tmp_path: Path) -> None:
    async def scene() -> None:
        file, told = tmp_path / "alive", list[str]()
        supervisor = Supervisor(
            [ProcessSpec("tokyo/world", (sys.executable, "-c", ALIVE, str(file)), alive=file)], tmp_path / "logs"
        )
        restarts = Restarts(supervisor, told.append, iter((3.0, 10.4)).__next__)
        await supervisor.start()
        await until(file.exists)
        restarts.look()
        assert told == []
        pid = supervisor.children["tokyo/world"].pid
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        await until(lambda: bool(told))
        assert told == ["tokyo/world ended (SIGKILL); starting it again"]

        def back() -> bool:
            restarts.look()
            return len(told) > 1

        await until(back)
        restarts.look()
        assert told[1:] == ["tokyo/world is back, after 7.4 s"]
        await supervisor.stop()

    asyncio.run(scene())
