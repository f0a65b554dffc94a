"""Real sockets through simulated links."""

from __future__ import annotations

import asyncio
import random
import sys
from collections.abc import Awaitable, Callable

import pytest
from waiting import until

from vistel_sim.network import Conditions, DatagramProxy, StreamProxy
from vistel_sim.network.namespaces import Namespaces

SERVES = """
import socket, sys
server = socket.create_server((sys.argv[1], 7000))
print("open", flush=True)
near, _ = server.accept()
while data := near.recv(100):
    near.sendall(data)
"""
ASKS = """
import socket, sys, time
begun = time.monotonic()
far = socket.create_connection((sys.argv[1], 7000))
print(time.monotonic() - begun, flush=True)
sys.stdin.readline()
far.settimeout(0.3)
far.sendall(b"x")
try:
    far.recv(1)
except TimeoutError:
    print("no answer", flush=True)
far.settimeout(None)
if far.recv(1):
    print("answer", flush=True)
"""
SENT = bytes(random.Random(3).randbytes(200_000))


async def _echo_server() -> asyncio.Server:
    async def echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(4096):
            writer.write(data)
            await writer.drain()
        writer.close()

    return await asyncio.start_server(echo, "127.0.0.1", 0)


def _through_a_stream(conditions: Conditions, body: Callable[[StreamProxy, bytearray], Awaitable[None]]) -> bytes:
    """What comes back of SENT from an echo behind a link; `body` does things to the link meanwhile."""

    async def run() -> bytes:
        server = await _echo_server()
        got = bytearray()
        async with StreamProxy.open(server.sockets[0].getsockname(), conditions, random.Random(1)) as proxy:
            reader, writer = await asyncio.open_connection("127.0.0.1", proxy.port)

            async def read() -> None:
                while data := await reader.read(4096):
                    got.extend(data)

            reading = asyncio.ensure_future(read())
            writer.write(SENT)
            writer.write_eof()
            await body(proxy, got)
            await reading
            writer.close()
        server.close()
        return bytes(got)

    return asyncio.run(run())


def test_a_stream_arrives_whole_and_in_order_over_a_link_that_loses_and_shakes() -> None:
    async def nothing(proxy: StreamProxy, got: bytearray) -> None:
        pass

    assert _through_a_stream(Conditions(0.001, 0.002, loss=0.05), nothing) == SENT


def test_what_waited_behind_a_cut_arrives_when_it_heals() -> None:
    async def cut(proxy: StreamProxy, got: bytearray) -> None:
        await until(lambda: len(got) > 0)
        proxy.cut()
        before = len(got)
        await asyncio.sleep(0.3)  # what was on its way out of the proxy is out
        halted = len(got)
        await asyncio.sleep(0.3)  # that nothing comes needs time in which it could
        assert len(got) == halted < len(SENT), before
        proxy.heal()

    assert _through_a_stream(Conditions(0.01, bits_per_s=5e5), cut) == SENT


def test_datagrams_get_there_and_back_to_who_sent_them_and_not_over_a_cut() -> None:
    mirrored: list[bytes] = []

    class Mirror(asyncio.DatagramProtocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            self.transport = transport

        def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
            mirrored.append(data)
            self.transport.sendto(data[::-1], addr)  # type: ignore[attr-defined]

    class Sender(asyncio.DatagramProtocol):
        def __init__(self) -> None:
            self.got: list[bytes] = []

        def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
            self.got.append(data)

    async def run() -> None:
        loop = asyncio.get_running_loop()
        mirror, _ = await loop.create_datagram_endpoint(Mirror, local_addr=("127.0.0.1", 0))
        to = mirror.get_extra_info("sockname")
        async with DatagramProxy.open(to, Conditions(0.005), random.Random(1)) as proxy:
            ann, anns = await loop.create_datagram_endpoint(Sender, remote_addr=("127.0.0.1", proxy.port))
            ben, bens = await loop.create_datagram_endpoint(Sender, remote_addr=("127.0.0.1", proxy.port))
            ann.sendto(b"ann")
            ben.sendto(b"ben")
            await until(lambda: (anns.got, bens.got) == ([b"nna"], [b"neb"]))
            proxy.cut("down")
            ann.sendto(b"lost")
            await until(lambda: b"lost" in mirrored, "what is lost on its way back")
            await asyncio.sleep(0.1)  # long enough for it to have come
            proxy.heal()
            ann.sendto(b"here")
            await until(lambda: len(anns.got) == 2)
            assert anns.got[1] == b"ereh"
            ann.close()
            ben.close()
        mirror.close()

    asyncio.run(run())


def test_who_connects_during_a_cut_is_not_answered_until_it_heals() -> None:
    async def run() -> None:
        server = await _echo_server()
        async with StreamProxy.open(server.sockets[0].getsockname(), Conditions(0.001), random.Random(1)) as proxy:
            proxy.cut("down")
            connecting = asyncio.ensure_future(asyncio.open_connection("127.0.0.1", proxy.port))
            await asyncio.sleep(0.3)  # that no answer comes needs time in which it could
            assert not connecting.done()
            proxy.heal()
            reader, writer = await connecting
            writer.write(b"here")
            assert await reader.readexactly(4) == b"here"
            writer.close()
        server.close()

    asyncio.run(run())


def test_two_machines_reach_each_other_over_their_link_alone_and_not_over_a_cut() -> None:
    if missing := Namespaces.missing():
        pytest.skip(missing)

    async def run() -> None:
        async with Namespaces.open(Conditions(0.03), random.Random(1)) as machines:
            serve = machines.far.command([sys.executable, "-c", SERVES, machines.far.address])
            serving = await asyncio.create_subprocess_exec(*serve, stdout=asyncio.subprocess.PIPE)
            assert serving.stdout is not None
            try:
                await serving.stdout.readline()
                ask = machines.near.command([sys.executable, "-c", ASKS, machines.far.address])
                asking = await asyncio.create_subprocess_exec(*ask, stdout=asyncio.subprocess.PIPE, stdin=asyncio.subprocess.PIPE)
                assert asking.stdout is not None and asking.stdin is not None
                took_s = float(await asking.stdout.readline())
                assert took_s >= 2 * 0.03, "there and back"
                machines.cut()
                asking.stdin.write(b"\n")
                assert await asking.stdout.readline() == b"no answer\n"
                machines.heal()
                assert await asking.stdout.readline() == b"answer\n"
                await asking.wait()
            finally:
                serving.kill()
                await serving.wait()

    asyncio.run(run())
