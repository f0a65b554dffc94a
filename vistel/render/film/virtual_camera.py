"""The site's picture as a camera that other programs can choose: a v4l2loopback device (Linux), written to directly.

The package pyvirtualcam does the same. It is not used because its licence is the GPL, version 2, and VISTEL's is Apache-2.0.
"""

from __future__ import annotations

import logging
import os
import queue
import struct
import threading
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from vistel.arrays import U8

log = logging.getLogger("vistel.renderer")


_DEVICES = Path("/sys/class/video4linux")
# linux/videodev2.h
_QUERYCAP = 0x80685600
_S_FMT = 0xC0D05605
_CAP_VIDEO_OUTPUT = 0x00000002
_CAP_DEVICE_CAPS = 0x80000000
_BUF_TYPE_VIDEO_OUTPUT = 2
_FIELD_NONE = 1
_COLORSPACE_SMPTE170M = 1
_YUV420 = int.from_bytes(b"YU12", "little")
_FORMAT = struct.Struct("<II 12I 152x")
"""struct v4l2_format of 64-bit systems with a v4l2_pix_format: type; width, height, pixelformat, field, bytesperline, sizeimage,
colorspace, priv, flags, ycbcr_enc, quantization, xfer_func."""
_CAPABILITY = struct.Struct("<16s32s32sIII12x")
"""struct v4l2_capability: driver, card, bus_info, version, capabilities, device_caps."""
_QUEUE = 2

NO_DEVICE = "no v4l2loopback device (Linux): install it, then sudo modprobe v4l2loopback exclusive_caps=1 card_label=VISTEL"


class NoCameraError(RuntimeError):
    """There is no virtual camera to write to; the text says what to install."""


class Device(Protocol):
    """The kernel's side of a device that is open."""

    def ioctl(self, request: int, data: bytearray) -> None:
        """Raises OSError."""
        ...

    def write(self, data: bytes | memoryview) -> int:
        """Raises OSError."""
        ...

    def close(self) -> None:
        """Let it go."""
        ...


class FileDevice:
    """A device of this machine."""

    def __init__(self, path: Path) -> None:
        """Raises OSError."""
        self._fd = os.open(path, os.O_RDWR)

    def ioctl(self, request: int, data: bytearray) -> None:
        """See `Device.ioctl`."""
        import fcntl  # noqa: PLC0415  where there are such devices, there is this

        fcntl.ioctl(self._fd, request, data, True)

    def write(self, data: bytes | memoryview) -> int:
        """See `Device.write`."""
        return os.write(self._fd, data)

    def close(self) -> None:
        """See `Device.close`."""
        os.close(self._fd)


def find_device(wanted: str, devices: Path = _DEVICES) -> Path:
    """The device that is meant by "auto" (the first of v4l2loopback), a path, or the label of one. Raises NoCameraError."""
    if wanted.startswith("/"):
        if not Path(wanted).exists():
            raise NoCameraError(f"{wanted} is not there; {NO_DEVICE}")
        return Path(wanted)
    found = sorted(p for p in devices.glob("video*") if (p / "name").exists())
    labels = {p.name: (p / "name").read_text("utf-8", "replace").strip() for p in found}
    for name, label in labels.items():
        # Its devices are no hardware's: they hang in the tree of virtual ones.
        if (wanted == "auto" and "/virtual/" in str((devices / name).resolve())) or (wanted != "auto" and wanted in label):
            return Path("/dev") / name
    raise NoCameraError(NO_DEVICE if wanted == "auto" else f"no camera is called {wanted!r}; {NO_DEVICE}")


def set_format(device: Device, width: int, height: int) -> None:
    """Pictures of this size in planes of Y, U and V come from now on. Raises NoCameraError when the device takes none."""
    data = bytearray(_CAPABILITY.size)
    try:
        device.ioctl(_QUERYCAP, data)
        driver, _, _, _, every, own = _CAPABILITY.unpack(bytes(data))
        if not (own if every & _CAP_DEVICE_CAPS else every) & _CAP_VIDEO_OUTPUT:
            whose = driver.rstrip(bytes(1)).decode("utf-8", "replace")
            raise NoCameraError(f"it is a camera of {whose}, and takes no pictures; {NO_DEVICE}")
        data = bytearray(
            _FORMAT.pack(
                _BUF_TYPE_VIDEO_OUTPUT,
                0,
                width,
                height,
                _YUV420,
                _FIELD_NONE,
                width,
                width * height * 3 // 2,
                _COLORSPACE_SMPTE170M,
                0,
                0,
                0,
                0,
                0,
            )
        )
        device.ioctl(_S_FMT, data)
    except OSError as e:
        raise NoCameraError(f"it is no camera to write to ({e.strerror}); {NO_DEVICE}") from e
    taken = _FORMAT.unpack(bytes(data))
    if taken[2:5] != (width, height, _YUV420):
        raise NoCameraError(f"it takes {taken[2]}x{taken[3]} only; is another program using it with that size?")


class VirtualCamera:
    """Writes in a thread of its own; `put` never waits. A device that fails ends the camera with one line, not the renderer."""

    def __init__(self, device: Device, width: int, height: int) -> None:
        """Raises NoCameraError."""
        self.size = width - width % 2, height - height % 2
        self._device = device
        try:
            set_format(device, *self.size)
        except NoCameraError:
            device.close()
            raise
        self._queue: queue.Queue[U8 | None] = queue.Queue(_QUEUE)
        self.left_out = self.written = 0
        self._thread = threading.Thread(target=self._work, name="camera", daemon=True)
        self._thread.start()

    def put(self, rgba: U8) -> None:
        """A picture (h, w, 4) RGBA, first row at the bottom. It is not changed."""
        try:
            self._queue.put_nowait(rgba)
        except queue.Full:
            self.left_out += 1

    def close(self) -> None:
        """Write what waits and let go of the device."""
        self._queue.put(None)
        self._thread.join(timeout=5.0)

    def _work(self) -> None:
        failed = False
        while (rgba := self._queue.get()) is not None:
            if failed:
                continue
            width, height = self.size
            upright = np.ascontiguousarray(cv2.flip(rgba, 0)[:height, :width])
            data = np.asarray(cv2.cvtColor(upright, cv2.COLOR_RGBA2YUV_I420), np.uint8)
            try:
                self._device.write(data.data.cast("B"))
                self.written += 1
            except OSError as e:
                failed = True
                log.error("event=virtual_camera_failed reason=%r written=%d", e.strerror or str(e), self.written)
        self._device.close()
