"""USB HID devices that only talk: hidapi reads them on a thread, the event loop gets their reports."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Sequence
from typing import Protocol

from vistel.wire.clock import Clock
from vistel_services.devices.transport import OpenTransport, Received, TransportError

_REPORT_LENGTH = 64
_WAIT_MS = 100


class HidDevice(Protocol):
    """What is needed of an open device; hidapi's `device` has it."""

    def read(self, length: int, timeout_ms: int) -> Sequence[int]:
        """A report's bytes, none when none came in time. Raises OSError or ValueError when the device is gone."""
        ...

    def close(self) -> None: ...


OpenDevice = Callable[[], HidDevice]
"""Finds and opens a device. Raises TransportError, with a line for a person."""


class HidTransport:
    """An open HID device; what is written to it goes nowhere, for none of these listens."""

    def __init__(self, device: HidDevice, clock: Clock, received: Received, lost: Callable[[str], None]) -> None:
        self._device, self._clock = device, clock
        self._received, self._lost = received, lost
        self._loop = asyncio.get_running_loop()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._read, name="hid", daemon=True)
        self._thread.start()

    def write(self, data: bytes) -> None:
        pass

    def set_baud(self, baud: int) -> None:
        pass

    def close(self) -> None:
        self._closed.set()

    def _read(self) -> None:
        try:
            while not self._closed.is_set():
                report = bytes(self._device.read(_REPORT_LENGTH, _WAIT_MS))
                if report:
                    self._give(self._take, report, self._clock.now_ns())
        except (OSError, ValueError):
            self._give(self._gone)
        finally:
            with contextlib.suppress(OSError, ValueError):
                self._device.close()

    def _give(self, call: Callable[..., None], *arguments: object) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(call, *arguments)

    def _take(self, report: bytes, t_ns: int) -> None:
        if not self._closed.is_set():
            self._received(report, t_ns)

    def _gone(self) -> None:
        if not self._closed.is_set():
            self._lost("USB: unplugged")


def open_hid(find: OpenDevice, clock: Clock) -> OpenTransport:
    """How a driver opens (and opens again) its HID device."""
    return lambda received, lost: HidTransport(find(), clock, received, lost)


def find_hid(
    vendor_id: int, wanted: Callable[[int], bool], what: str, name: Callable[[int], str | None] = lambda product_id: None
) -> OpenDevice:
    """Opens the first device of a vendor whose product id is `wanted`; `what`: it, in words; `name`: of any product id."""

    def find() -> HidDevice:
        try:
            import hid  # noqa: PLC0415
        except ImportError as e:
            raise TransportError(f"{what}: reading USB HID devices needs hidapi: pip install 'vistel[capture]'") from e
        found = hid.enumerate(vendor_id, 0)
        right = [d for d in found if wanted(d["product_id"])]
        if not right:
            others = ", ".join(name(d["product_id"]) or f"{vendor_id:04x}:{d['product_id']:04x}" for d in found)
            raise TransportError(f"{what} is not on USB" + (f"; {others} is" if others else "; plug it in"))
        device = hid.device()
        try:
            device.open_path(right[0]["path"])
        except OSError as e:
            raise TransportError(f"{what} may not be opened: {e}; give yourself access with a udev rule") from e
        return device

    return find
