"""window.png, watch.png and watch-phone.png: one conference as it is seen in a window, where somebody moves a thing by mouse, and
in a browser that watches another site's stream, on a desk and on a phone. Needs Xvfb and Chromium; takes a minute."""

import asyncio
import contextlib
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
import tomli_w

from vistel.conference.files import DEMO_FILE, load
from vistel.render.view.camera import overview
from vistel.space.room import meeting_room

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))
from browser import page
from x_server import Hands, x_server

HERE = Path(__file__).parent
WIDTH, HEIGHT, PORT = 1280, 720, 8099
TRY_S = 20.0
"""Longest wait for a stream that is fast."""
SETTLED_S = 6.0
"""The first pictures come while everything else is still starting."""


def main() -> None:
    with tempfile.TemporaryDirectory() as name, pytest.MonkeyPatch.context() as patch, x_server(patch, WIDTH, HEIGHT) as hands:
        folder = Path(name)
        command = [sys.executable, "-m", "vistel_cli.main", "up", str(_conference(folder)), "--out", str(folder / "out")]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
            try:
                asyncio.run(_watch(folder, process))
                _use_the_window(hands)
            finally:
                process.send_signal(signal.SIGINT)


def _conference(folder: Path) -> Path:
    """The demo: tokyo in a window, columbus streamed, with all their pixels however slow the machine is."""
    data = load(DEMO_FILE).model_dump(mode="json", exclude_none=True)
    data["record"] = False
    tokyo, columbus, zurich = data["sites"]
    tokyo["display"] = {"width": WIDTH, "height": HEIGHT, "window": True, "video": False, "resolution": "full"}
    columbus["display"] = {"width": 1024, "height": 576, "stream": str(PORT), "video": False, "resolution": "full"}
    zurich["display"] = {"width": 320, "height": 180, "video": False}
    file = folder / "live.toml"
    file.write_text(tomli_w.dumps(data))
    return file


def _is_seen(folder: Path, site: str) -> bool:
    log = folder / "out" / "logs" / f"{site}-renderer.log"
    return log.exists() and "event=picture people=3 stand_ins=0" in log.read_text()


async def _watch(folder: Path, process: subprocess.Popen[bytes]) -> None:
    """The page of the stream, once the conference is there."""
    while not all(_is_seen(folder, site) for site in ("tokyo", "columbus")):
        if process.poll() is not None:
            sys.exit("the conference ended; `vistel up` says why")
        await asyncio.sleep(0.2)
    await asyncio.sleep(SETTLED_S)
    async with page(folder) as tab:
        await tab.open(f"http://127.0.0.1:{PORT}/", 1024, 576 + 48)
        await tab.until("Number(document.getElementById('state').dataset.rate) > 1")
        await asyncio.sleep(SETTLED_S)
        with contextlib.suppress(TimeoutError):  # a slow machine shows what it can
            async with asyncio.timeout(TRY_S):
                await tab.until("Number(document.getElementById('state').dataset.rate) > 12")
        _write("watch.png", await tab.picture())
        await tab.call("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=False)
        await asyncio.sleep(SETTLED_S)
        _write("watch-phone.png", await tab.picture())


def _use_the_window(hands: Hands) -> None:
    """Look from above, and lift the ball by mouse."""
    ball = meeting_room(3).by_id["ball"]
    x, y = overview().project(ball.position[None], WIDTH, HEIGHT)[0, :2]
    hands.key("3", True)
    hands.key("3", False)
    hands.move(x, y)
    time.sleep(3.0)
    hands.button(1, True)
    for k in range(1, 31):
        hands.move(x - 2 * k, y - 4 * k)
        time.sleep(0.1)
    time.sleep(4.0)
    _write("window.png", hands.screen())
    hands.button(1, False)


def _write(name: str, rgb: np.ndarray) -> None:
    cv2.imwrite(str(HERE / name), cv2.cvtColor(rgb.astype(np.uint8), cv2.COLOR_RGB2BGR))
    print((HERE / name).relative_to(ROOT))


if __name__ == "__main__":
    main()
