"""Keeps one device running: finds it, starts it, watches it, starts it again, and publishes its status."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from google.protobuf.message import Message
from prometheus_client import Counter, Histogram

from vistel.devices.transport import OpenTransport, Transport, TransportError
from vistel.v1.device_pb2 import DeviceStatus, RawBytes
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep, within
from vistel.wire.raw_bytes import RawGatherer
from vistel.wire.topics import BY_NAME, Topic

T = TypeVar("T")

SILENCE_S = 0.5
"""A streaming device that is silent for this time is started again [s]."""
ABSENT_S = 5.0
"""A device that may be absent is, when it has been silent for this time [s]: pages in the background send seldom."""
_NEVER_S = 86_400.0
_REOPEN_S = 0.25
"""Wait before a port is opened again [s]."""
_FAULT_S = 2.0
"""Wait after a fault that a person must correct [s]."""
_RECENT = 512
"""Received bytes that are kept for identification."""

_FRAMES = Counter("vistel_device_frames_total", "Frames decoded", ["device"])
_SKIPPED = Counter("vistel_device_skipped_bytes_total", "Bytes that were part of no record", ["device"])
_RECONNECTS = Counter("vistel_device_reconnects_total", "Times the device came back", ["device"])
_LATENCY = Histogram(
    "vistel_device_publish_latency_seconds",
    "From a frame's last byte read to its message published",
    ["device"],
    buckets=(5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 5e-2),
)


class DeviceError(Exception):
    """A device answers and cannot be used as configured; one line for a person."""


class NoAnswerError(Exception):
    """Nothing on the port answers as the device would; one line for a person."""


class Decoder(Protocol):
    """The part of a driver that needs no port: bytes in, messages out. A replay feeds it recorded bytes."""

    @property
    def bytes_skipped(self) -> int: ...

    def feed(self, data: bytes, t_ns: int) -> Sequence[Message]:
        """Messages completed by bytes that were read at `t_ns`."""
        ...


class Link:
    """What a driver's start-up sequence sends and receives through."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.recent = bytearray()
        """The last bytes received."""
        self.frames = 0
        self.attached = 0
        """How often a transport was attached: the number of the present connection."""
        self._transport: Transport | None = None
        self._lost: str | None = None
        self._news, self._loss = asyncio.Event(), asyncio.Event()
        self._heard_ns = 0
        self.sent: Callable[[bytes], None] = lambda data: None

    def attach(self, transport: Transport) -> None:
        self._transport, self._lost = transport, None
        self.attached += 1
        self._loss.clear()
        self.recent.clear()

    def arrived(self, data: bytes, frames: int) -> None:
        self.recent += data
        del self.recent[:-_RECENT]
        if frames:
            self.frames += frames
            self._heard_ns = self.clock.steady_ns()
        self._news.set()

    def lose(self, reason: str) -> None:
        self._lost = reason
        self._loss.set()
        self._news.set()

    def send(self, data: bytes) -> None:
        """Raises TransportError when the port is gone."""
        assert self._transport is not None
        self._transport.write(data)
        self.sent(data)

    def set_baud(self, baud: int) -> None:
        assert self._transport is not None
        self._transport.set_baud(baud)

    async def news(self, timeout_s: float) -> bool:
        """Wait for bytes; False when none came in time. Raises TransportError when the device is lost."""
        try:
            async with within(self.clock, timeout_s):
                await self._arrival()
        except TimeoutError:
            return False
        return True

    async def _arrival(self) -> None:
        if self._lost is None:
            self._news.clear()
            await self._news.wait()
        if self._lost is not None:
            raise TransportError(self._lost)

    async def until_silent(self, silence_s: float) -> None:
        """Return when no frame has come for `silence_s`: not woken by each. Raises TransportError when the device is lost."""
        self._heard_ns = self.clock.steady_ns()
        while (left_s := silence_s - (self.clock.steady_ns() - self._heard_ns) * 1e-9) > 0.0:
            with contextlib.suppress(TimeoutError):
                async with within(self.clock, left_s):
                    await self._loss.wait()
            if self._lost is not None:
                raise TransportError(self._lost)

    async def quiet(self, for_s: float, at_most_s: float) -> None:
        """Return when nothing has come `for_s`, or after `at_most_s`."""
        with contextlib.suppress(TimeoutError):
            async with within(self.clock, at_most_s):
                while await self.news(for_s):
                    pass

    async def wait_for(self, look: Callable[[], T | None], timeout_s: float) -> T | None:
        """The first result of `look` that is not None, asked after each read; None when none came in time."""
        found = look()
        with contextlib.suppress(TimeoutError):
            async with within(self.clock, timeout_s):
                while found is None:
                    await self._arrival()
                    found = look()
        return found


class Driver(Protocol):
    """The part of the work that depends on the protocol; `keep_running` does the rest."""

    @property
    def name(self) -> str: ...

    @property
    def topic(self) -> Topic: ...

    @property
    def stop(self) -> bytes:
        """The bytes that make the device silent."""
        ...

    @property
    def beat(self) -> tuple[float, bytes] | None:
        """A period [s] and the bytes to send in each while the device streams; None: nothing."""
        ...

    @property
    def decoder(self) -> Decoder: ...

    async def start(self, link: Link) -> str:
        """Bring the device from any state to streaming. Returns a line about it. Raises NoAnswerError, DeviceError."""
        ...


class _Reporter:
    """Publishes DeviceStatus on change and each second."""

    def __init__(self, driver: Driver, link: Link, bus: Bus, clock: Clock, log: logging.Logger) -> None:
        self._driver, self._link, self._clock, self._log = driver, link, clock, log
        self._publication = bus.publish(BY_NAME["device_status"], device=driver.name)
        self._state = DeviceStatus.STATE_UNSPECIFIED
        self._detail = ""
        self._rate = 0.0
        self._skipped = 0
        self.reconnects = 0

    def set(self, state: DeviceStatus.State, detail: str) -> None:
        if (state, detail) == (self._state, self._detail):
            return
        expected = (DeviceStatus.STATE_STARTING, DeviceStatus.STATE_STREAMING, DeviceStatus.STATE_ABSENT)
        bad = state not in expected and (state != DeviceStatus.STATE_SEARCHING or self._link.frames > 0)
        name = DeviceStatus.State.Name(state).removeprefix("STATE_").lower()
        self._log.log(logging.WARNING if bad else logging.INFO, "device=%s state=%s detail=%r", self._driver.name, name, detail)
        self._state, self._detail = state, detail
        self._publish()

    async def run(self, each_second: Callable[[], None]) -> None:
        before, before_ns = self._link.frames, self._clock.now_ns()
        while True:
            await self._clock.sleep_until_ns(before_ns + 1_000_000_000)
            now, now_ns = self._link.frames, self._clock.now_ns()
            self._rate = (now - before) / ((now_ns - before_ns) * 1e-9)
            before, before_ns = now, now_ns
            self._publish()
            each_second()

    def _publish(self) -> None:
        skipped = self._driver.decoder.bytes_skipped
        _SKIPPED.labels(self._driver.name).inc(skipped - self._skipped)
        self._skipped = skipped
        message = DeviceStatus(
            device=self._driver.name,
            state=self._state,
            detail=self._detail,
            rate_hz=self._rate,
            frames=self._link.frames,
            bytes_skipped=skipped,
            reconnects=self.reconnects,
        )
        message.header.t_ns = self._clock.now_ns()
        self._publication.put(message)


async def keep_running(
    driver: Driver, open_transport: OpenTransport, bus: Bus, clock: Clock, log: logging.Logger, *, raw: bool, absent: str = ""
) -> None:
    """Run a device until cancelled. raw: publish its bytes in both directions too; absent: what its silence means, in a line, where
    that is no fault of it."""
    link = Link(clock)
    reporter = _Reporter(driver, link, bus, clock, log)
    frames = bus.publish(driver.topic, device=driver.name)
    count, latency = _FRAMES.labels(driver.name), _LATENCY.labels(driver.name)
    gathered = RawGatherer(driver.name, bus.publish(BY_NAME["device_raw"], device=driver.name).put) if raw else None

    def record(data: bytes, t_ns: int, direction: RawBytes.Direction) -> None:
        if gathered is not None:
            gathered.add(data, t_ns, direction)

    def received(data: bytes, t_ns: int) -> None:
        messages = driver.decoder.feed(data, t_ns)
        for message in messages:
            frames.put(message)
        if messages:
            count.inc(len(messages))
            latency.observe((clock.now_ns() - t_ns) * 1e-9)
        link.arrived(data, len(messages))
        record(data, t_ns, RawBytes.DIRECTION_FROM_DEVICE)

    link.sent = lambda data: record(data, clock.now_ns(), RawBytes.DIRECTION_TO_DEVICE)
    report = background.start(reporter.run(gathered.flush if gathered is not None else lambda: None), f"report {driver.name}")
    reporter.set(DeviceStatus.STATE_SEARCHING, "looking for its port")
    lost = False
    try:
        while True:
            try:
                transport = open_transport(received, link.lose)
            except TransportError as e:
                reporter.set(DeviceStatus.STATE_SEARCHING, str(e))
                await sleep(clock, _REOPEN_S)
                continue
            if lost:
                reporter.reconnects += 1
                _RECONNECTS.labels(driver.name).inc()
            lost = False
            link.attach(transport)
            try:
                await (_run_visited(driver, link, reporter, absent) if absent else _run_open(driver, link, reporter))
            except TransportError as e:
                lost = True
                reporter.set(DeviceStatus.STATE_SEARCHING, str(e))
                await sleep(clock, _REOPEN_S)
            except DeviceError as e:
                reporter.set(DeviceStatus.STATE_FAULT, str(e))
                await sleep(clock, _FAULT_S)
            finally:
                _stop(link, driver.stop)
                transport.close()
    finally:
        report.cancel()
        if gathered is not None:
            gathered.flush()


async def _run_open(driver: Driver, link: Link, reporter: _Reporter) -> None:
    while True:
        reporter.set(DeviceStatus.STATE_STARTING, "starting")
        try:
            about = await driver.start(link)
        except NoAnswerError as e:
            reporter.set(DeviceStatus.STATE_STALLED if link.frames else DeviceStatus.STATE_SEARCHING, str(e))
            continue
        reporter.set(DeviceStatus.STATE_STREAMING, about)
        beating = background.start(_send_again(link, *driver.beat), f"beat {driver.name}") if driver.beat is not None else None
        try:
            await link.until_silent(SILENCE_S)
        finally:
            if beating is not None:
                beating.cancel()
        reporter.set(DeviceStatus.STATE_STALLED, f"silent for {SILENCE_S} s")


async def _run_visited(driver: Driver, link: Link, reporter: _Reporter, absent: str) -> None:
    """One that sends when somebody comes; absent: what is said of it else."""
    about = await driver.start(link)
    while True:
        reporter.set(DeviceStatus.STATE_ABSENT, absent)
        seen = link.frames
        if await link.wait_for(lambda seen=seen: link.frames > seen or None, _NEVER_S):
            reporter.set(DeviceStatus.STATE_STREAMING, about)
            await link.until_silent(ABSENT_S)


async def _send_again(link: Link, period_s: float, data: bytes) -> None:
    with contextlib.suppress(TransportError):  # the loop that waits for frames reports it
        while True:
            link.send(data)
            await sleep(link.clock, period_s)


def _stop(link: Link, command: bytes) -> None:
    with contextlib.suppress(TransportError):  # gone already
        link.send(command)
