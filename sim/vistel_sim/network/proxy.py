"""Simulated links between real programs: a proxy on a port of this machine that passes on what it gets as a link would.

    async with DatagramProxy.open(("127.0.0.1", 7447), Conditions(delay_s=0.05, loss=0.05), random.Random(1)) as link:
        ...  # connect to link.port
        link.cut("up")

"up" is from who connects to who is connected to.
"""

import asyncio
import contextlib
import random
import socket
from collections import deque
from collections.abc import AsyncIterator
from typing import Any, Literal

from vistel.wire import background
from vistel_sim.network.link import SEGMENT_BYTES, Conditions, Link

Way = Literal["up", "down", "both"]
Address = tuple[str, int]

BACKLOG = 100
"""Connections that wait to be taken."""
FILLING = 4
"""More connections than have room in a queue for none."""
WAITING_BYTES = 256 * 1024
"""A stream takes nothing more while so much is on its way: what a socket's buffer holds."""


class Linked:
    """Both directions."""

    def __init__(self, conditions: Conditions, rng: random.Random, down: Conditions | None) -> None:
        self.up = Link(conditions, rng)
        self.down = Link(down or conditions, rng)

    def change(self, conditions: Conditions, way: Way = "both") -> None:
        """The link is another one from now on."""
        for link in self._links(way):
            link.conditions = conditions

    def cut(self, way: Way = "both") -> None:
        """Nothing passes any more, and nobody is told."""
        for link in self._links(way):
            link.cut(asyncio.get_running_loop().time())

    def _links(self, way: Way) -> list[Link]:
        return [link for name, link in (("up", self.up), ("down", self.down)) if way in (name, "both")]


class _Proxy(Linked):
    """A port of this machine that leads to another one, `to`."""

    def __init__(self, to: Address, conditions: Conditions, rng: random.Random, down: Conditions | None) -> None:
        super().__init__(conditions, rng, down)
        self.to = to
        self.port = 0


class DatagramProxy(_Proxy):
    """A link for UDP, and so for QUIC."""

    @staticmethod
    @contextlib.asynccontextmanager
    async def open(
        to: Address, conditions: Conditions, rng: random.Random, *, down: Conditions | None = None
    ) -> AsyncIterator["DatagramProxy"]:
        """A link to the port `to`, from a free port of the loopback interface. down: another one for the way back."""
        proxy = DatagramProxy(to, conditions, rng, down)
        transports: dict[Address, asyncio.DatagramTransport] = {}
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
            lambda: _Clients(proxy, transports), local_addr=("127.0.0.1", 0)
        )
        proxy.port = transport.get_extra_info("sockname")[1]
        try:
            yield proxy
        finally:
            for opened in (transport, *transports.values()):
                opened.close()

    def heal(self, way: Way = "both") -> None:
        """All passes again."""
        for link in self._links(way):
            link.heal(asyncio.get_running_loop().time())


class _Clients(asyncio.DatagramProtocol):
    """The side of who connects: each address there has a port of its own to the other side."""

    def __init__(self, proxy: DatagramProxy, transports: dict[Address, asyncio.DatagramTransport]) -> None:
        self._proxy = proxy
        self._transports = transports
        self._opening: dict[Address, list[bytes]] = {}

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if opened := self._transports.get(addr):
            pass_on(self._proxy.up, data, opened)
        elif addr in self._opening:
            self._opening[addr].append(data)
        else:
            self._opening[addr] = [data]
            background.current().start(self._open(addr), "link for another client")

    async def _open(self, addr: Address) -> None:
        back = _Answers(self._proxy, self._transport, addr)
        opened, _ = await asyncio.get_running_loop().create_datagram_endpoint(lambda: back, remote_addr=self._proxy.to)
        self._transports[addr] = opened
        for data in self._opening.pop(addr):
            pass_on(self._proxy.up, data, opened)


class _Answers(asyncio.DatagramProtocol):
    def __init__(self, proxy: DatagramProxy, near: asyncio.DatagramTransport, addr: Address) -> None:
        self._proxy = proxy
        self._near = near
        self._addr = addr

    def datagram_received(self, data: bytes, addr: Any) -> None:
        pass_on(self._proxy.down, data, self._near, self._addr)


def pass_on(link: Link, data: bytes, to: asyncio.DatagramTransport, address: Address | None = None) -> None:
    """A datagram, when the link lets it out."""
    loop = asyncio.get_running_loop()

    def leave() -> None:
        if not (link.is_cut or to.is_closing()):
            to.sendto(data, address)

    arrives_s = link.datagram(len(data), loop.time())
    if arrives_s is not None:
        loop.call_at(arrives_s, leave)


class StreamProxy(_Proxy):
    """A link for TCP, and so for TLS."""

    def __init__(self, to: Address, conditions: Conditions, rng: random.Random, down: Conditions | None) -> None:
        super().__init__(to, conditions, rng, down)
        self._streams: set[_Stream] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._listening = socket.create_server(("127.0.0.1", 0), backlog=BACKLOG)
        self._listening.setblocking(False)
        self._filling: list[socket.socket] = []
        self._fillers = set[Address]()

    @staticmethod
    @contextlib.asynccontextmanager
    async def open(
        to: Address, conditions: Conditions, rng: random.Random, *, down: Conditions | None = None
    ) -> AsyncIterator["StreamProxy"]:
        """A link to the port `to`, from a free port of the loopback interface. down: another one for the way back."""
        proxy = StreamProxy(to, conditions, rng, down)
        proxy.port = proxy._listening.getsockname()[1]
        proxy._take()
        try:
            yield proxy
        finally:
            asyncio.get_running_loop().remove_reader(proxy._listening)
            proxy._end_filling()
            proxy._listening.close()
            for task in tuple(proxy._tasks):
                task.cancel()
            await asyncio.gather(*proxy._tasks, return_exceptions=True)

    def cut(self, way: Way = "both") -> None:
        """Nothing passes any more, and nobody is told. Who connects is not answered and tries again, as the system does: the queue
        of connections that are to be taken is made short, and filled."""
        super().cut(way)
        if self._filling:
            return
        asyncio.get_running_loop().remove_reader(self._listening)
        self._listening.listen(0)
        for _ in range(FILLING):
            filling = socket.socket()
            filling.setblocking(False)
            filling.connect_ex(("127.0.0.1", self.port))
            self._filling.append(filling)
        self._fillers = {filling.getsockname() for filling in self._filling}

    def heal(self, way: Way = "both") -> None:
        """All passes again; what waits goes on when TCP tries again."""
        for link in self._links(way):
            goes_on_s = link.heal(asyncio.get_running_loop().time())
            for stream in self._streams:
                if stream.link is link:
                    stream.go_on(goes_on_s)
        if not (self.up.is_cut or self.down.is_cut):
            self._end_filling()
            self._listening.listen(BACKLOG)
            self._take()

    def _end_filling(self) -> None:
        while self._filling:
            self._filling.pop().close()

    def _take(self) -> None:
        asyncio.get_running_loop().add_reader(self._listening, self._taken)

    def _taken(self) -> None:
        with contextlib.suppress(BlockingIOError):
            near, address = self._listening.accept()
            if address in self._fillers:
                near.close()
            else:
                background.current().start(self._carry(near), "connection over a link")

    def reset(self) -> None:
        """All connections are closed at both ends; new ones are taken."""
        for task in self._tasks:
            task.cancel()

    async def _carry(self, near: socket.socket) -> None:
        """One connection, from when it was taken to its end."""
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        ends: list[asyncio.StreamWriter] = []
        try:
            reader, writer = await asyncio.open_connection(sock=near)
            ends.append(writer)
            now_s = asyncio.get_running_loop().time()
            await asyncio.sleep(self.down.first(self.up.first(now_s)) - now_s)
            far_reader, far_writer = await asyncio.open_connection(*self.to)
            ends.append(far_writer)
            up, down = _Stream(self.up, reader, far_writer), _Stream(self.down, far_reader, writer)
            self._streams |= {up, down}
            try:
                async with asyncio.TaskGroup() as both:  # a connection that is reset in one direction ends in both
                    both.create_task(up.run())
                    both.create_task(down.run())
            finally:
                self._streams -= {up, down}
        except* (OSError, asyncio.CancelledError):
            pass
        finally:
            self._tasks.discard(task)
            for end in ends:
                end.close()


class _Stream:
    """One direction of one connection."""

    def __init__(self, link: Link, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.link = link
        self._reader = reader
        self._writer = writer
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._bytes = 0
        self._changed = asyncio.Event()
        self._ended = False

    async def run(self) -> None:
        """Until one end closes or is cut off."""
        async with asyncio.TaskGroup() as both:
            both.create_task(self._read())
            both.create_task(self._write())

    def go_on(self, at_s: float) -> None:
        """What waits behind a cut leaves from then on, in order."""
        self._waiting = deque((max(t, at_s), data) for t, data in self._waiting)
        self._changed.set()

    async def _read(self) -> None:
        loop = asyncio.get_running_loop()
        while data := await self._reader.read(SEGMENT_BYTES):
            self._waiting.append((self.link.segment(len(data), loop.time()), data))
            self._bytes += len(data)
            self._changed.set()
            while self._bytes > WAITING_BYTES:
                self._changed.clear()
                await self._changed.wait()
        self._ended = True
        self._changed.set()

    async def _write(self) -> None:
        loop = asyncio.get_running_loop()
        while self._waiting or not self._ended:
            if not self._waiting or self.link.is_cut:
                self._changed.clear()
                await self._changed.wait()
                continue
            wait_s = self._waiting[0][0] - loop.time()
            if wait_s > 0.0:
                await asyncio.sleep(wait_s)
                continue
            _, data = self._waiting.popleft()
            self._bytes -= len(data)
            self._changed.set()
            self._writer.write(data)
            await self._writer.drain()
        if self._writer.can_write_eof():
            self._writer.write_eof()
