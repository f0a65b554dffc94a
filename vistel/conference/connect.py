"""How a process of a conference joins its bus: with the conference's certificates, and receiving only from those in its file."""

from vistel.conference.device_list import devices_of_site
from vistel.conference.model import RESERVED, Conference
from vistel.wire.clock import Clock
from vistel.wire.owners import Owners
from vistel.wire.zenoh.bus import ZenohBus
from vistel.wire.zenoh.config import TlsFiles


def owners_of(conference: Conference) -> Owners:
    """Which site may publish for which participants."""
    sites: dict[str, dict[str, frozenset[str]]] = {name: {} for name in RESERVED}
    for site in conference.sites:
        sites[site.name] = {
            "participant": frozenset(p.name for p in site.participants),
            "device": frozenset(device.name for device in devices_of_site(site)),
            "equipment": frozenset(e.name for e in site.audio.equipment) if site.audio is not None else frozenset(),
            "prop": frozenset(p.thing for p in site.props),
        }
    return Owners(sites)


def tls_files(conference: Conference) -> TlsFiles | None:
    """The certificates of links to the routers that the file names."""
    tls = conference.bus.tls if conference.bus.mode == "routed" else None
    return TlsFiles(tls.ca, tls.certificate, tls.key) if tls is not None else None


async def connect(conference: Conference, site: str, clock: Clock, *endpoints: str) -> ZenohBus:
    """Join as `site`, over the first router of `endpoints` that answers. Raises BusError."""
    return await ZenohBus.open(
        conference=conference.name,
        site=site,
        clock=clock,
        endpoints=endpoints,
        tls=tls_files(conference),
        owners=owners_of(conference),
    )
