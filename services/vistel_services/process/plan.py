"""From a conference file to the processes that run it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vistel.conference.model import HUB_PLACE, Conference, Site

HUB = HUB_PLACE
"""The site name of what belongs to no site: router, world, recorder."""


@dataclass(frozen=True)
class ProcessPlan:
    """One process: `node` is "site/label", `services` are package names in vistel_services, in start order; `place`: the site
    on whose machine a process of the hub runs, empty for the hub's own."""

    site: str
    label: str
    services: tuple[str, ...]
    place: str = ""

    @property
    def node(self) -> str:
        return f"{self.site}/{self.label}"


def further_recorder(site: str) -> ProcessPlan:
    """That of `vistel record`, on the machine of a site or of the hub: beside the conference's own, under a name of its own."""
    return ProcessPlan(site, "record", ("recorder",))


def process_token(label: str) -> str:
    """The presence token of a process."""
    return f"process-{label}"


def site_processes(conference: Conference, site: str) -> list[ProcessPlan]:
    """The processes of one site, as the conference file groups its services, and a world if one is to run there."""
    for s in conference.sites:
        if s.name == site:
            world = [ProcessPlan(HUB, f"world-{site}", ("world",), site)] if site in conference.world.all else []
            return world + [ProcessPlan(site, _label(group), tuple(group)) for group in _groups(s)]
    names = ", ".join(s.name for s in conference.sites)
    raise ValueError(f"site: no site {site!r} in this conference; there are {names}")


def _groups(site: Site) -> list[list[str]]:
    """As the file groups them; a site with sound whose file names no process for it has one for it all the same."""
    groups: list[list[str]] = [list(group) for group in site.groups]
    if site.audio is None:
        return groups
    named = {service for group in groups for service in group}
    missing = [n for n in ("audio", "delay") if n not in named and (n == "audio" or site.audio.equipment)]
    if missing == ["delay"]:
        next(group for group in groups if "audio" in group).append("delay")
    elif missing:
        groups.append(missing)
    return groups


def hub_processes(conference: Conference) -> list[ProcessPlan]:
    """World, unless it runs at sites, recorder when the conference is recorded, and console where it has an address."""
    plans = [ProcessPlan(HUB, "world", ("world",))] if HUB in conference.world.all else []
    if conference.record:
        plans.append(ProcessPlan(HUB, "recorder", ("recorder",)))
    if conference.console.at:
        plans.append(ProcessPlan(HUB, "console", ("console",)))
    return plans


def _label(group: Sequence[str]) -> str:
    return "capture" if "posture" in group and len(group) > 1 else group[0] if len(group) == 1 else "-".join(group)


def find(conference: Conference, node: str) -> ProcessPlan:
    """The plan of `node`. Raises ValueError naming the nodes there are."""
    plans = hub_processes(conference)
    for site in conference.sites:
        plans += site_processes(conference, site.name)
    further = [further_recorder(site) for site in (HUB, *(s.name for s in conference.sites))]
    for plan in (*plans, *further):
        if plan.node == node:
            return plan
    raise ValueError(f"node: no process {node!r} in this conference; there are {', '.join(p.node for p in plans)}")
