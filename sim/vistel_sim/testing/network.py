"""Links beside a test: a port of this machine that passes on to another port what a real link would."""

import asyncio
import random
from collections.abc import Callable, Generator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import TypeVar

from vistel_sim.network.link import Conditions
from vistel_sim.network.proxy import DatagramProxy, StreamProxy, Way
from vistel_sim.testing.device_thread import DeviceThread

R = TypeVar("R")
_ANSWER_S = 30.0
"""A link's thread does what it is told within this time [s]."""


class NetworkLink:
    """A link that runs from the construction until `end`: connect to `port` instead of the port it leads to."""

    def __init__(self, opened: type[StreamProxy] | type[DatagramProxy], to: int, conditions: Conditions, seed: int) -> None:
        self._ready: Future[tuple[asyncio.AbstractEventLoop, StreamProxy | DatagramProxy]] = Future()
        self._opened, self._to, self._conditions, self._seed = opened, to, conditions, seed
        self._thread = DeviceThread(f"link to {to}", self._run())
        self._loop, self._proxy = self._ready.result(_ANSWER_S)

    @property
    def port(self) -> int:
        """Of 127.0.0.1."""
        return self._proxy.port

    @property
    def address(self) -> str:
        """127.0.0.1:PORT."""
        return f"127.0.0.1:{self.port}"

    def change(self, conditions: Conditions, way: Way = "both") -> None:
        """From now on it is such a link. way: "up" is from who connects."""
        self._call(lambda: self._proxy.change(conditions, way))

    @contextmanager
    def cut(self, way: Way = "both") -> Generator[None]:
        """Within the block nothing passes, and nobody is told."""
        self._call(lambda: self._proxy.cut(way))
        try:
            yield
        finally:
            self._call(lambda: self._proxy.heal(way))

    def reset(self) -> None:
        """Close all connections at both ends. Raises ValueError for a link of datagrams, which has none."""
        proxy = self._proxy
        if not isinstance(proxy, StreamProxy):
            raise ValueError("a link of datagrams has no connections")
        self._call(proxy.reset)

    def end(self) -> None:
        """Close it. Raises RuntimeError when it failed before."""
        self._thread.end()

    async def _run(self) -> None:
        async with self._opened.open(("127.0.0.1", self._to), self._conditions, random.Random(self._seed)) as proxy:
            self._ready.set_result((asyncio.get_running_loop(), proxy))
            await asyncio.Event().wait()

    def _call(self, what: Callable[[], R]) -> R:
        self._thread.check()

        async def on_loop() -> R:
            return what()

        return asyncio.run_coroutine_threadsafe(on_loop(), self._loop).result(_ANSWER_S)


class Network:
    """Makes links; they end with `end`. seed: same seed, same losses."""

    def __init__(self, seed: int = 1) -> None:
        self._seed = seed
        self._links: list[NetworkLink] = []

    def tcp(self, to: int, conditions: Conditions | None = None) -> NetworkLink:
        """A link to a TCP port of this machine; without conditions, one that only passes on."""
        return self._link(StreamProxy, to, conditions)

    def udp(self, to: int, conditions: Conditions | None = None) -> NetworkLink:
        """As `tcp`, to a UDP port."""
        return self._link(DatagramProxy, to, conditions)

    def end(self) -> None:
        """Close all links."""
        while self._links:
            self._links.pop().end()

    def _link(self, opened: type[StreamProxy] | type[DatagramProxy], to: int, conditions: Conditions | None) -> NetworkLink:
        link = NetworkLink(opened, to, conditions or Conditions(), self._seed + len(self._links))
        self._links.append(link)
        return link
