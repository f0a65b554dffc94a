"""A guest who has entered with a headset, before somebody at the table: guest-headset.png, what the headset shows to both eyes.
npm's iwer is the headset. Needs Chromium and clients/web/node_modules (`make web`); takes a minute or more."""

import asyncio
import sys
import tempfile
from pathlib import Path

import cv2
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests")]
from browser import page
from guest_room import GuestRoom, at_the_door

from vistel.protocol.pages.headset import JOINTS
from vistel.protocol.pages.pointer import Pointed, posture_record

HERE = Path(__file__).parent
IWER = ROOT / "clients/web/node_modules/iwer/build/iwer.min.js"
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
WORN = "window.worn = new IWER.XRDevice(IWER.metaQuest3); worn.stereoEnabled = true; worn.installRuntime({ forceInstall: true }); 0"
QUICK = (320, 200)
"""While nothing is looked at."""
SIZE = (1280, 640)
HANDS = (
    "(worn.primaryInputMode = 'hand', worn.quaternion.set(-0.1, -0.09, 0, 0.99),"
    " worn.hands.left.position.set(-0.17, 1.38, -0.42), worn.hands.right.position.set(0.16, 1.36, -0.40), 1)"
)
LINE = "Can you hear me, Ann? Then let us begin with what we did not finish last time."
PICTURES = 3
"""Until what is seen is of where the hands are now."""


async def visit(folder: Path) -> None:
    """Enter, raise both hands, and keep what both eyes see."""
    room = GuestRoom(folder)
    async with (
        page(folder, *SOFTWARE_GL) as tab,
        room.serving(pytest.MonkeyPatch()),
        room.opened(room.invited("guest-2", "Eve")) as eve,
    ):
        await eve.enter("carla")
        async with eve.listening():
            await eve.socket.send_bytes(posture_record(0.0, 0.0, right=Pointed((-0.25, 1.25, 0.3))))
            await tab.call("Page.addScriptToEvaluateOnNewDocument", source=f"{IWER.read_text('utf-8')};{WORN}")
            await at_the_door(tab, room, room.invited(), *QUICK)
            await tab.click(".people button[aria-current=true]")
            await tab.until("window.guest.ready() === 2")
            await tab.until("!document.querySelector('#headset').disabled")
            await tab.call("Emulation.setDeviceMetricsOverride", width=SIZE[0], height=SIZE[1], deviceScaleFactor=1, mobile=False)
            await tab.click("#headset")
            await tab.until("window.guest.headset.state === 'on' && window.guest.headset.pictures > 1")
            await tab.value(HANDS)
            await room.until(lambda: room.worn and len(room.worn[-1].right.joints) == 3 * JOINTS, "both hands")
            await asyncio.sleep(3.0)  # until the figure's hands are there
            drawn = await tab.value("window.guest.headset.pictures")
            await tab.until(f"window.guest.headset.pictures >= {drawn + PICTURES}")
            await eve.socket.send_json({"write": LINE})
            await tab.until(f"window.guest.headset.signOf('guest-2').endsWith({LINE!r})")
            drawn = await tab.value("window.guest.headset.pictures")
            await tab.until(f"window.guest.headset.pictures > {drawn}")
            cv2.imwrite(str(HERE / "guest-headset.png"), cv2.cvtColor(await tab.picture(), cv2.COLOR_RGB2BGR))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        asyncio.run(visit(Path(name)))
