"""The order in which the processes of a conference end."""

from __future__ import annotations

from pathlib import Path

from vistel.conference.paths import RunPaths
from vistel_cli.run.launch import host_spec, sim_spec
from vistel_services.process.plan import ProcessPlan


def test_a_simulated_device_is_there_until_nothing_reads_it(tmp_path: Path) -> None:
    paths, file = RunPaths(tmp_path / "run", tmp_path / "out"), tmp_path / "conference.toml"
    devices = sim_spec(file, paths)
    for reader in (
        ProcessPlan("here", "capture", ("tracker", "glove", "posture")),
        ProcessPlan("here", "all", ("tracker", "renderer")),
    ):
        assert host_spec(reader, file, "tcp/127.0.0.1:7447", paths).stop_rank > devices.stop_rank
