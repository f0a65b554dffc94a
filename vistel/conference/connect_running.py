"""How a command joins a conference that runs on this machine without its file, which takes long to load."""

from vistel.conference.running import Running
from vistel.host import HOST
from vistel.wire.clock import Clock
from vistel.wire.owners import Owners
from vistel.wire.zenoh.access import HUB_NAME, WORLD_NAME
from vistel.wire.zenoh.bus import ZenohBus


async def connect_running(running: Running, site: str, clock: Clock, hub: str) -> ZenohBus:
    """Join as `site`, over the router `hub`. Messages of a participant are received from their own site only. Raises BusError."""
    own = {
        at: {"participant": frozenset(p for p, there in running.people.items() if there == at)} for at in running.people.values()
    }
    owners = Owners({HUB_NAME: {"participant": frozenset({HOST})}, WORLD_NAME: {}} | own)
    return await ZenohBus.open(conference=running.name, site=site, clock=clock, endpoints=hub.split(","), owners=owners)
