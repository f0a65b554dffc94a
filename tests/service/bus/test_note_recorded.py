"""A note that the host writes in a terminal is in the log that is being recorded."""

from __future__ import annotations

import asyncio
import tomllib
from pathlib import Path

from waiting import until

from vistel.conference.connect import connect
from vistel.conference.model import Conference
from vistel.log.notes import notes_of
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.log import LogReader
from vistel.wire.zenoh.bus import Router
from vistel_cli.main import app
from vistel_services.process.plan import HUB
from vistel_services.recorder.service import Config, run

FILE = """
name = "noted"
[[sites]]
name = "lab"
[[sites.participants]]
name = "ben"
avatar = "builtin:person=ben"
program = true
"""
TEXT = "Ben drops the <baton>"


async def _recorded(folder: Path) -> Path:
    router, clock = Router.open(), SystemClock()
    conference = Conference.model_validate(tomllib.loads(FILE))
    bus = await connect(conference, HUB, clock, router.endpoint)
    serve_clock(bus, clock)
    log = folder / "noted.mcap"
    recording = asyncio.create_task(run(Config(log), bus, clock))
    file = folder / "noted.toml"
    file.write_text(FILE)
    try:
        said = [str(file), "--hub", router.endpoint, "--note", TEXT]
        assert await asyncio.to_thread(_command, "record", *said) == 0
        assert await asyncio.to_thread(_command, "record", *said[:-1], "x" * 501) == 2
        await until(lambda: log.exists() and notes_of(LogReader(log))[0], "the note in the log", tasks=[recording])
    finally:
        recording.cancel()
        await asyncio.gather(recording, return_exceptions=True)
        await bus.close()
        router.close()
    return log


def _command(*words: str) -> int:
    try:
        app(list(words))
    except SystemExit as e:
        return int(e.code or 0)
    return 0


def test_it_is_recorded_with_its_time_and_who_wrote_it(tmp_path: Path) -> None:
    log = asyncio.run(_recorded(tmp_path))
    (note,) = notes_of(LogReader(log))[0]
    assert note.text == TEXT and note.author
    assert abs(note.t_ns - LogReader(log).begin_ns) < 60e9
