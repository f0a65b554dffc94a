"""A log that has become too large is kept beside a new one, and nothing of it is lost."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from vistel_cli.run.logged_errors import LoggedErrors

SPEAK = """
import logging, os
from vistel_services.process import logs
logs.MOST_BYTES = 5000
logs.configure("tokyo/capture", redirected=True)
for number in range(300):
    logging.getLogger("vistel.test").info("line %03d", number)
    if number % 100 == 50:
        os.write(2, b"from a library\\n")
"""


def test_a_log_that_is_too_large_is_kept_and_a_new_one_begins(tmp_path: Path) -> None:
    log = tmp_path / "tokyo-capture.log"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with log.open("ab") as out:
        subprocess.run([sys.executable, "-c", SPEAK], stdout=out, stderr=out, check=True, env=environment)
    files = [*sorted(tmp_path.glob("*.log.*"), reverse=True), log]
    assert [f.name for f in files] == ["tokyo-capture.log.3", "tokyo-capture.log.2", "tokyo-capture.log.1", "tokyo-capture.log"]
    assert all(f.stat().st_size < 5200 for f in files)
    text = "".join(f.read_text() for f in files)
    numbers = [int(line[-3:]) for line in text.splitlines() if "line" in line]
    assert numbers == list(range(numbers[0], 300)), "only the oldest are gone"
    assert "from a library" in text


def test_errors_of_a_log_that_began_anew_are_reported(tmp_path: Path) -> None:
    errors, log = LoggedErrors(tmp_path), tmp_path / "hub-recorder.log"
    line = "2026-11-21T09:15:02.123Z ERROR   hub/recorder vistel.recorder event=log_failed path={} reason='full'\n"
    log.write_text(line.format("a.mcap") * 3)
    assert len(list(errors.new())) == 1
    log.replace(tmp_path / "hub-recorder.log.1")
    log.write_text(line.format("b.mcap"))
    assert list(errors.new()) == ["hub/recorder: log failed (b.mcap): full"]
