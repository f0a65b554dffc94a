"""Two machines on one: network namespaces of Linux, and a link between them that carries their packets. It needs root.

    async with Namespaces.open(Conditions(delay_s=0.05, loss=0.05), random.Random(1)) as machines:
        subprocess.run(machines.near.command(["vistel", "doctor"]))
        machines.cut()

Unlike over the proxies, TCP is the system's own: it sends lost packets again, and after a cut, as it does.
"""

import asyncio
import contextlib
import fcntl
import os
import random
import struct
import subprocess
from collections.abc import AsyncIterator, Sequence
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from vistel_sim.network.link import Conditions, Link
from vistel_sim.network.proxy import Linked

TUN = Path("/dev/net/tun")
SET_INTERFACE = 0x400454CA
PACKETS_ALONE = 0x0001 | 0x1000
"""IP packets without a header of their own (Linux: IFF_TUN, IFF_NO_PI)."""
PACKET_BYTES = 65_536
"""No packet is longer."""
NETWORK = "10.77.0"
"""Of the two addresses; nothing else is in the namespaces."""


@dataclass(frozen=True)
class Machine:
    """name: of the namespace; address: at which the other one reaches it."""

    name: str
    address: str

    def command(self, command: Sequence[str]) -> list[str]:
        """The same command, run there."""
        return ["ip", "netns", "exec", self.name, *command]


class Namespaces(Linked):
    """`near` and `far`; "up" is from near to far."""

    def __init__(self, conditions: Conditions, rng: random.Random) -> None:
        super().__init__(conditions, rng, None)
        self.near, self.far = (Machine(f"vistel-{os.getpid()}-{n}", f"{NETWORK}.{n}") for n in (1, 2))

    @staticmethod
    @asynccontextmanager
    async def open(conditions: Conditions, rng: random.Random) -> AsyncIterator["Namespaces"]:
        """Both machines, until the end of the block. Raises OSError or CalledProcessError without the rights."""
        machines, loop = Namespaces(conditions, rng), asyncio.get_running_loop()
        with ExitStack() as stack:
            near, far = (_interface(m, stack) for m in (machines.near, machines.far))
            for link, source, target in ((machines.up, near, far), (machines.down, far, near)):
                loop.add_reader(source, _pass_on, link, source, target)
                stack.callback(loop.remove_reader, source)
            yield machines

    @staticmethod
    def missing() -> str:
        """Why there can be none here; empty where there can."""
        return "" if TUN.exists() and os.geteuid() == 0 else f"network namespaces need root and {TUN}"

    def heal(self) -> None:
        """All passes again."""
        for link in (self.up, self.down):
            link.heal(asyncio.get_running_loop().time())


def _interface(machine: Machine, stack: ExitStack) -> int:
    """The namespace with its one interface, whose packets are read and written here."""
    _ip("netns", "add", machine.name)
    stack.callback(_ip, "netns", "delete", machine.name)
    device = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
    stack.callback(os.close, device)
    name = f"vt{os.getpid() % 1_000_000}{machine.address[-1]}"
    fcntl.ioctl(device, SET_INTERFACE, struct.pack("16sH22x", name.encode(), PACKETS_ALONE))
    _ip("link", "set", name, "netns", machine.name)
    for words in (
        ["address", "add", f"{machine.address}/24", "dev", name],
        ["link", "set", name, "up"],
        ["link", "set", "lo", "up"],
    ):
        _ip("-netns", machine.name, *words)
    return device


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True)


def _pass_on(link: Link, source: int, target: int) -> None:
    """A packet, when the link lets it out."""
    packet, loop = os.read(source, PACKET_BYTES), asyncio.get_running_loop()

    def leave() -> None:
        if not link.is_cut:
            with contextlib.suppress(OSError):  # the machine there is gone
                os.write(target, packet)

    arrives_s = link.datagram(len(packet), loop.time())
    if arrives_s is not None:
        loop.call_at(arrives_s, leave)
