"""A virtual camera: the bytes and requests at the device's wire, and one clear line where there is no device."""

from __future__ import annotations

import errno
import os
import shutil
import struct
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest

from vistel.render.film.virtual_camera import FileDevice, NoCameraError, VirtualCamera, find_device

QUERYCAP, S_FMT = 0x80685600, 0xC0D05605
WIDTH, HEIGHT = 64, 48


class Loopback:
    """A v4l2loopback device's answers, its pictures into a pipe. takes: another size than is asked for."""

    def __init__(self, capabilities: int = 0x85200003, own: int = 0x05200002, takes: tuple[int, int] | None = None) -> None:
        self.readable, self._fd = os.pipe()
        self._capabilities, self._own, self._takes = capabilities, own, takes
        self.format: bytes = b""

    def ioctl(self, request: int, data: bytearray) -> None:
        if request == QUERYCAP:
            assert len(data) == 104
            data[:] = struct.pack("<16s32s32sIII12x", b"v4l2 loopback", b"VISTEL", b"platform", 1, self._capabilities, self._own)
        elif request == S_FMT:
            assert len(data) == 208
            if self._takes is not None:
                struct.pack_into("<II", data, 8, *self._takes)
            self.format = bytes(data)
        else:
            raise OSError(errno.ENOTTY, "Inappropriate ioctl for device")

    def write(self, data: bytes | memoryview) -> int:
        return os.write(self._fd, data)

    def close(self) -> None:
        os.close(self._fd)


def picture() -> np.ndarray:
    """Red above, blue below, first row at the bottom."""
    out = np.full((HEIGHT, WIDTH, 4), 255, np.uint8)
    out[HEIGHT // 2 :, :, :3], out[: HEIGHT // 2, :, :3] = (200, 30, 30), (30, 30, 200)
    return out


def test_the_device_gets_its_format_and_planes_that_any_player_shows() -> None:
    device = Loopback()
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append(os.fdopen(device.readable, "rb").read()))
    reader.start()
    camera = VirtualCamera(device, WIDTH + 1, HEIGHT)
    camera.put(picture())
    camera.put(picture())
    camera.close()
    reader.join()
    kind, _, width, height, pixels, field, stride, size = struct.unpack_from("<8I", device.format)
    assert (kind, width, height, field, stride, size) == (2, WIDTH, HEIGHT, 1, WIDTH, WIDTH * HEIGHT * 3 // 2)
    assert pixels.to_bytes(4, "little") == b"YU12"
    assert camera.written == 2
    assert len(read[0]) == 2 * WIDTH * HEIGHT * 3 // 2
    shown = subprocess.run(
        [
            shutil.which("ffmpeg") or pytest.skip("no ffmpeg"),
            "-v",
            "error",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "yuv420p",
            "-s",
            f"{WIDTH}x{HEIGHT}",
            "-i",
            "-",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
            "-",
        ],
        input=read[0],
        capture_output=True,
        check=True,
    )
    first = np.frombuffer(shown.stdout, np.uint8)[: WIDTH * HEIGHT * 3].reshape(HEIGHT, WIDTH, 3).astype(int)
    assert np.abs(first[: HEIGHT // 2 - 2] - (200, 30, 30)).max() < 12
    assert np.abs(first[HEIGHT // 2 + 2 :] - (30, 30, 200)).max() < 12


def test_requests_and_structures_are_the_kernels(tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    if compiler is None or not Path("/usr/include/linux/videodev2.h").exists():
        pytest.skip("no C compiler with the kernel's headers")
    source = tmp_path / "v.c"
    source.write_text(
        "#include <linux/videodev2.h>\n#include <stdio.h>\n#include <stddef.h>\n"
        'int main(void) { printf("%zu %zu %zu %zu %lu %lu\\n", sizeof(struct v4l2_capability), sizeof(struct v4l2_format),'
        " offsetof(struct v4l2_format, fmt), offsetof(struct v4l2_capability, device_caps),"
        " (unsigned long)VIDIOC_QUERYCAP, (unsigned long)VIDIOC_S_FMT); }"
    )
    subprocess.run([compiler, source, "-o", tmp_path / "v"], check=True)
    said = subprocess.run([tmp_path / "v"], capture_output=True, text=True, check=True).stdout
    assert [int(n) for n in said.split()] == [104, 208, 8, 88, QUERYCAP, S_FMT]


@pytest.mark.parametrize(
    ("device", "reason"),
    [(Loopback(0x84200001, 0x04200001), "takes no pictures"), (Loopback(takes=(320, 240)), "takes 320x240 only")],
)
def test_a_device_that_cannot_is_named_with_what_to_do(device: Loopback, reason: str) -> None:
    with pytest.raises(NoCameraError, match=reason):
        VirtualCamera(device, WIDTH, HEIGHT)


def test_a_file_is_no_camera(tmp_path: Path) -> None:
    (tmp_path / "video9").write_bytes(b"")
    with pytest.raises(NoCameraError, match="v4l2loopback"):
        VirtualCamera(FileDevice(find_device(str(tmp_path / "video9"))), WIDTH, HEIGHT)


def test_a_device_that_fails_ends_the_camera_with_a_line(caplog: pytest.LogCaptureFixture) -> None:
    class Unplugged(Loopback):
        def write(self, data: bytes | memoryview) -> int:
            raise OSError(errno.ENODEV, "No such device")

    camera = VirtualCamera(Unplugged(), WIDTH, HEIGHT)
    camera.put(picture())
    camera.put(picture())
    camera.close()
    assert [r.message for r in caplog.records] == ["event=virtual_camera_failed reason='No such device' written=0"]


def test_devices_are_found_by_what_they_are_and_by_label(tmp_path: Path) -> None:
    for name, tree, label in (("video0", "pci0", "HD Webcam"), ("video10", "virtual", "VISTEL"), ("video11", "virtual", "OBS")):
        folder = tmp_path / "devices" / tree / name
        folder.mkdir(parents=True)
        (folder / "name").write_text(label + "\n")
        (tmp_path / "class").mkdir(exist_ok=True)
        (tmp_path / "class" / name).symlink_to(folder)
    assert find_device("auto", tmp_path / "class") == Path("/dev/video10")
    assert find_device("OBS", tmp_path / "class") == Path("/dev/video11")
    for said in ("auto", "VISTEL", "/dev/no-such-device"):
        with pytest.raises(NoCameraError, match="sudo modprobe v4l2loopback"):
            find_device(said, tmp_path / "none")
