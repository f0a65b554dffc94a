"""From a conference file to the processes that run it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vistel.conference.model import Conference

HUB = "hub"
"""The site name of what belongs to no site: router, world, recorder."""


@dataclass(frozen=True)
class ProcessPlan:
    """One process: `node` is "site/label", `services` are package names in vistel_services, in start order."""

    site: str
    label: str
    services: tuple[str, ...]

    @property
    def node(self) -> str:
        return f"{self.site}/{self.label}"


def site_processes(conference: Conference, site: str) -> list[ProcessPlan]:
    """The processes of one site, as the conference file groups its services."""
    for s in conference.sites:
        if s.name == site:
            return [ProcessPlan(site, _label(group), group) for group in s.groups]
    names = ", ".join(s.name for s in conference.sites)
    raise ValueError(f"site: no site {site!r} in this conference; there are {names}")


def hub_processes(conference: Conference) -> list[ProcessPlan]:
    """World, and recorder when the conference is recorded."""
    plans = [ProcessPlan(HUB, "world", ("world",))]
    if conference.record:
        plans.append(ProcessPlan(HUB, "recorder", ("recorder",)))
    return plans


def _label(group: Sequence[str]) -> str:
    return "capture" if "posture" in group and len(group) > 1 else group[0] if len(group) == 1 else "-".join(group)


def find(conference: Conference, node: str) -> ProcessPlan:
    """The plan of `node`. Raises ValueError naming the nodes there are."""
    plans = hub_processes(conference)
    for site in conference.sites:
        plans += site_processes(conference, site.name)
    for plan in plans:
        if plan.node == node:
            return plan
    raise ValueError(f"node: no process {node!r} in this conference; there are {', '.join(p.node for p in plans)}")
