"""A whole conference beside a test: `vistel up` in processes of its own, which end with the test, however that ends."""

import json
import os
import re
import signal
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from vistel.conference.model import Site
from vistel_sim.testing.waiting import wait_until

if TYPE_CHECKING:
    from vistel.session import Session

START_S = 600.0
"""A conference is there within this time, on a machine that has to compile everything first [s]."""
_STOP_S = 120.0
"""It ends within this time [s]."""
_SHOWN = 15
"""Lines of its output that an error shows."""
TWO = """
name = "test"

[[sites]]
name = "here"

[[sites.participants]]
name = "aiko"

[[sites]]
name = "there"

[[sites.participants]]
name = "ben"
"""
"""Two people at two sites, with simulated devices."""


class LiveConference:
    """Runs from the construction until `end`. file: its conference file; out: folder of its log and of its processes' logs."""

    def __init__(self, file: Path, out: Path) -> None:
        self.file, self.out = file, out
        self._output = out.with_name(f"{out.name}.txt")
        up = [sys.executable, "-m", "vistel_cli.main", "up", str(file), "--out", str(out), "--no-console"]
        with self._output.open("wb") as output:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "vistel_sim.testing.guarded", *up],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )

    @property
    def log(self) -> Path:
        """The log that is being recorded; `vistel.log.open` reads it."""
        return self.out / "conference.mcap"

    @property
    def hub(self) -> str:
        """Address of its router, such as "tcp/127.0.0.1:7447"."""
        found = re.search(r"^ +bus +(tcp/\S+)", self.output(), re.MULTILINE)
        if found is None:
            raise RuntimeError(f"the conference has no router yet; its output: {self._last()}")
        return found[1]

    def output(self) -> str:
        """What `vistel up` has printed so far."""
        return self._output.read_text("utf-8", "replace")

    def wait_until_running(self, *, within_s: float = START_S) -> None:
        """Return when every site sees everybody. Raises RuntimeError when it ends before."""

        def runs() -> bool:
            there = "everybody sees everybody" in self.output()
            if not there and self._process.poll() is not None:
                raise RuntimeError(f"the conference ended with exit code {self._process.returncode}: {self._last()}")
            return there

        wait_until(runs, "everybody to see everybody", within_s=within_s)

    def join(self, participant: str | None = None) -> "Session":
        """Join it (`vistel.join`); use it in a `with`."""
        from vistel.session import join

        return join(self.file, participant=participant, hub=self.hub)

    def stop(self) -> dict[str, Any]:
        """Stop it, as Ctrl-C does; its report, empty when it never came so far. Raises RuntimeError when it failed."""
        self.end()
        if self._process.returncode not in (0, -signal.SIGTERM):
            raise RuntimeError(f"the conference ended with exit code {self._process.returncode}: {self._last()}")
        report = self.out / "report.json"
        return json.loads(report.read_text()) if report.exists() else {}

    def end(self) -> None:
        """Stop it, and wait until its processes have ended."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.wait(_STOP_S)

    def kept(self) -> list[Path]:
        """The log, what `vistel up` printed, and the logs of its processes."""
        return [p for p in (self.log, self._output, *sorted((self.out / "logs").glob("*.log"))) if p.exists()]

    def _last(self) -> str:
        return "\n".join(self.output().splitlines()[-_SHOWN:])


def without_renderers(text: str) -> str:
    """A conference file whose sites draw nothing. Raises tomllib.TOMLDecodeError."""
    table = tomllib.loads(text)
    usual = Site.model_fields["processes"].default
    for site in table.get("sites", []):
        groups = [[s for s in group if s != "renderer"] for group in site.get("processes", usual)]
        site["processes"] = [group for group in groups if group]
    return tomli_w.dumps(table)
