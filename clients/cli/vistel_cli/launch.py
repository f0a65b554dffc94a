"""The command lines of a conference's processes."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel_services.plan import ProcessPlan
from vistel_services.reserve import StandbySpec
from vistel_services.supervisor import ProcessSpec

# Devices first stop feeding, then services end, the recorder last so that it hears everything.
_STOP_RANK = {"sim": 4, "renderer": 3, "world": 2, "recorder": 0}


def host_spec(plan: ProcessPlan, file: Path, hub: str, paths: RunPaths, clock: str = "system") -> ProcessSpec:
    """How to run one process of services."""
    arguments = (str(file), plan.node, "--hub", hub, "--run", str(paths.run), "--out", str(paths.out),
                 "--clock", clock)  # fmt: skip
    argv = (sys.executable, "-m", "vistel_services.host", *arguments)
    rank = min(_STOP_RANK.get(s, 3) for s in plan.services)
    return ProcessSpec(plan.node, argv, rank, grace_s=10.0, env=_environment(), host=arguments)


def standby_spec(plans: Sequence[ProcessPlan], file: Path, paths: RunPaths, after_s: float) -> StandbySpec:
    """How to run a process that can become any of `plans`; the first one is started after `after_s`."""
    services = sorted({s for p in plans for s in p.services})
    argv = (sys.executable, "-m", "vistel_services.standby", str(file), *services,
            "--run", str(paths.run), "--out", str(paths.out))  # fmt: skip
    return StandbySpec(argv, _environment(), after_s)


def sim_spec(file: Path, paths: RunPaths, site: str | None = None) -> ProcessSpec:
    """How to run the simulated devices of a conference, or of one site of it."""
    argv = (sys.executable, "-m", "vistel_sim.process", str(file), "--run", str(paths.run))
    argv += ("--site", site) if site else ()
    return ProcessSpec("hub/sim", argv, _STOP_RANK["sim"], env=_environment())


def simulated_devices(conference: Conference, site: str | None = None) -> list[str]:
    """Names of the simulated devices, of one site or of all."""
    names: list[str] = []
    for s in conference.sites:
        for p in s.participants if site in (None, s.name) else []:
            names += [f"{p.name}-tracker"] if p.tracker and p.tracker.port == "sim" else []
            names += [f"{p.name}-tracker-2"] if p.tracker and p.tracker.second_port == "sim" else []
            names += [f"{p.name}-glove-{side}" for side, g in sorted(p.gloves.items()) if g.port == "sim"]
            names += [f"{p.name}-face"] if p.face and p.face.simulated else []
            names += [f"{p.name}-eye"] if p.eye and p.eye.simulated else []
        names += [p.device for p in s.props if p.tracker.port == "sim"] if site in (None, s.name) else []
    return names


def _environment() -> dict[str, str]:
    """One figure, one thread: teams of threads cost more than they bring for sub-millisecond kernels."""
    return {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"} | dict(os.environ)
