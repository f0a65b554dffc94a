"""How a process of a conference joins its bus: with the conference's certificates, and receiving only from those in its file."""

from vistel.conference.device_list import devices_of_site
from vistel.conference.model import HUB_PLACE, RESERVED, Conference
from vistel.host import HOST
from vistel.wire.clock import Clock
from vistel.wire.owners import Owners
from vistel.wire.zenoh.bus import BusError, ZenohBus
from vistel.wire.zenoh.common_names import AUTHORITY
from vistel.wire.zenoh.config import TlsFiles
from vistel.wire.zenoh.endpoints import objection


def owners_of(conference: Conference) -> Owners:
    """Which site may publish for which participants."""
    sites: dict[str, dict[str, frozenset[str]]] = {name: {} for name in RESERVED}
    sites[HUB_PLACE]["participant"] = frozenset({HOST})
    for site in conference.sites:
        sites[site.name] = {
            "participant": frozenset(p.name for p in site.participants),
            "device": frozenset(device.name for device in devices_of_site(site)),
            "equipment": frozenset(e.name for e in site.audio.equipment) if site.audio is not None else frozenset(),
            "prop": frozenset(p.thing for p in site.props),
        }
    return Owners(sites)


def tls_files(conference: Conference, site: str) -> TlsFiles | None:
    """The certificates that processes of `site` show on this machine: in a folder those of its name, else the only ones, for a
    world on a site's machine. Raises BusError where there are none."""
    tls = conference.bus.tls
    if tls is None or tls.folder is None:
        return TlsFiles(tls.ca, tls.certificate, tls.key) if tls and tls.ca and tls.certificate and tls.key else None
    name = name_shown(conference, site)
    return TlsFiles(*(tls.folder / f for f in (f"{AUTHORITY}.pem", f"{name}.pem", f"{name}.key")))


def name_shown(conference: Conference, site: str) -> str:
    """Whose certificate processes of `site` show on this machine: its own, or that of the folder's only name; `site` itself where
    no folder has them. Raises BusError where the folder has none that could be meant."""
    folder = conference.bus.tls.folder if conference.bus.mode == "routed" and conference.bus.tls else None
    if folder is None:
        return site
    found = sorted(k.stem for k in folder.glob("*.key") if k.stem != AUTHORITY)
    if site not in found and len(found) != 1:
        of_hub = "`vistel site certs init` with the conference file makes it, on the router's machine"
        mend = of_hub if site == HUB_PLACE else "the host's invitation brings it (vistel site invite)"
        raise BusError(f"{folder}: no certificate of {site} is here; {mend}")
    return site if site in found else found[0]


def endpoints_of(conference: Conference, site: str, *routers: str) -> tuple[list[str], TlsFiles | None]:
    """Where `site` may connect to, and with which certificates. A router is an endpoint, or several with commas between them.
    Raises BusError, also for plain TCP beyond this machine that the file does not allow."""
    tls = tls_files(conference, site) if conference.bus.mode == "routed" else None
    endpoints = [endpoint for each in routers for endpoint in each.split(",")]
    for endpoint in endpoints:
        if fault := objection(endpoint, tls=tls is not None, insecure=conference.bus.insecure):
            raise BusError(fault)
    return endpoints, tls


async def connect(conference: Conference, site: str, clock: Clock, *routers: str) -> ZenohBus:
    """Join as `site`, over the first of `routers` that answers, and over another one when it is gone. Raises BusError, as
    `endpoints_of` does."""
    endpoints, tls = endpoints_of(conference, site, *routers)
    return await ZenohBus.open(
        conference=conference.name, site=site, clock=clock, endpoints=endpoints, tls=tls, owners=owners_of(conference)
    )
