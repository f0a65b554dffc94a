"""Three sites meet on one machine: pictures a second at each, with three figures that deform in every picture."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.row import Row, at_least

SECONDS = 20


def run() -> Iterator[Row]:
    """The demo conference for 20 s."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "vistel_cli.main", "up", "--seconds", str(SECONDS), "--out", folder, "--json"]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        report = json.loads((Path(folder) / "report.json").read_text())
    peer = "Singh's VISTEL (whole world, 1995)"
    for site, figures in report["sites"].items():
        rate = figures["frames_per_s_median"]
        yield Row("demo", site, "pictures at 640x360", "frames/s", rate, peer, 8.0, target=at_least(12))
        delay = max(figures["image_delay_s_median"].values()) * 1e3
        yield Row("demo", site, "capture to picture, median", "ms", delay)
    for node, process in report["processes"].items():
        if process["cpu_percent"] is not None:
            cpu = process["cpu_percent"]
            yield Row("demo", node, "processor use", "% of a core", cpu)
