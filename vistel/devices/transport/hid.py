"""USB HID devices that only talk: hidapi reads them on a thread, the event loop gets their reports."""

import contextlib
from collections.abc import Callable, Sequence
from typing import Protocol

from vistel.devices.transport import OpenTransport, Received, ThreadTransport, TransportError
from vistel.wire.clock import Clock

_REPORT_LENGTH = 64
_WAIT_MS = 100


class HidDevice(Protocol):
    """What is needed of an open device; hidapi's `device` has it."""

    def read(self, length: int, timeout_ms: int) -> Sequence[int]:
        """A report's bytes, none when none came in time. Raises OSError or ValueError when the device is gone."""
        ...

    def close(self) -> None:
        """Let it go."""
        ...


OpenDevice = Callable[[], HidDevice]
"""Finds and opens a device. Raises TransportError, with a line for a person."""


class HidTransport(ThreadTransport):
    """An open HID device."""

    def __init__(self, device: HidDevice, clock: Clock, received: Received, lost: Callable[[str], None]) -> None:
        self._device, self._clock = device, clock
        super().__init__("hid", received, lost)

    def _read(self) -> None:
        try:
            with contextlib.closing(self._device):  # before anybody hears that it is gone, and looks for it again
                while not self._closed.is_set():
                    report = bytes(self._device.read(_REPORT_LENGTH, _WAIT_MS))
                    if report:
                        self._later(self._received, report, self._clock.now_ns())
        except (OSError, ValueError):
            self._later(self._lost, "USB: unplugged")


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
