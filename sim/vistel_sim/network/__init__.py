"""A network between sites, simulated in this process: delay, jitter, loss, thin lines and cuts, for TCP and for datagrams."""

from vistel_sim.network.link import Conditions, Link
from vistel_sim.network.proxy import DatagramProxy, StreamProxy

__all__ = ["Conditions", "DatagramProxy", "Link", "StreamProxy"]
