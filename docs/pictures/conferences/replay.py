"""The page of a recorded meeting: plots and a note, another log as ghosts, and what presses on somebody: replay-*.png.

Takes a log of the demo, else records one. Needs Chromium and the console's page (`make web`); takes two minutes."""

import asyncio
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import tomli_w

import vistel.log
from vistel.conference.files import DEMO_FILE, load
from vistel.log.numbers import tracks

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))
from browser import Page, page

HERE = Path(__file__).parent
COMMAND = [sys.executable, "-m", "vistel_cli.main"]
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
SIZE, TALL, PHONE = (980, 880), (980, 1150), (390, 844)
"""TALL: for a large picture of the room above the lanes."""
SECONDS = "30"
HELD = "thing.baton.held"
PLOTS = ("participant.ben.motion.left_hand.speed", "participant.aiko.motion.right_hand.speed", "thing.baton.y")
NOTE = "Look at the two hands: the baton is taken"
LATER_S = 1.5
SETTLED_S = 8.0
"""For walls and things, and a sharp picture."""


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = shutil.copy(sys.argv[1] if len(sys.argv) > 1 else recorded(folder), folder / "meeting.mcap")
        other = shutil.copy(log, folder / "other.mcap")
        moment_s = handed_over(Path(log))
        with served(log) as url:
            asyncio.run(plots(folder / "plots", url, moment_s))
        with served(log, "--beside", str(other)) as url:
            asyncio.run(two_logs(folder / "two", url, moment_s))
        with served(log) as url:
            asyncio.run(touch(folder / "touch", url, moment_s))


def recorded(folder: Path) -> Path:
    """A meeting of the demo's people whose sites draw nothing, so that no machine is too slow for it."""
    data = load(DEMO_FILE).model_dump(mode="json", exclude_none=True)
    for site in data["sites"]:
        site["processes"] = [["tracker", "glove", "posture"]]
    (folder / "demo.toml").write_text(tomli_w.dumps(data))
    run = [*COMMAND, "up", str(folder / "demo.toml"), "--no-console", "--seconds", SECONDS, "--out", str(folder / "out")]
    subprocess.run(run, check=True)
    return folder / "out/conference.mcap"


def handed_over(log: Path) -> float:
    """When the baton is taken for the last time, from somebody's hand where it was given at all [s of the log]."""
    held = tracks(vistel.log.open(log), [HELD])[HELD]
    begun = [np.flatnonzero((held.value[1:] > hands) & (held.value[:-1] <= hands)) for hands in (1.0, 0.0)]
    return float(held.t[next(n for n in begun if n.size)[-1] + 1]) + 0.1


@contextmanager
def served(log: Path, *options: str) -> Iterator[str]:
    """The address of its page."""
    command = [*COMMAND, "replay", str(log), *options, "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield next(line.split(" at ")[1].split()[0] for line in process.stdout or () if " at http" in line)
        finally:
            process.send_signal(signal.SIGINT)


async def plots(folder: Path, url: str, moment_s: float) -> None:
    """A note, the lanes and plots, on a desk and on a phone. folder: of the browser."""
    async with page(folder, *SOFTWARE_GL) as tab:
        await tab.open(f"{url}#t={moment_s:.2f}" + "".join(f"&plot={name}" for name in PLOTS), *SIZE)
        await tab.until("window.vistel && window.vistel.ready() === 3")
        await tab.until(f"window.vistelTravel.curves().length === {len(PLOTS)}")
        await tab.value("document.querySelector('[name=note]').focus()")
        await tab.call("Input.insertText", text=NOTE)
        await tab.value("document.querySelector('.note button').click()")
        await tab.until("document.querySelectorAll('ol.notes li').length === 1")
        await kept(tab, "replay-plots")
        await resize(tab, PHONE)
        await kept(tab, "replay-phone")


async def two_logs(folder: Path, url: str, moment_s: float) -> None:
    """Somebody's view of those of two logs."""
    async with page(folder, *SOFTWARE_GL) as tab:
        await tab.open(f"{url}#t={moment_s:.2f}", *SIZE)
        await tab.until("window.vistel && window.vistel.ready() === 3")
        await later(tab, LATER_S)
        await resize(tab, TALL)
        await press(tab, "#views", "Ben’s eyes")
        await kept(tab, "replay-two-logs", "main")


async def touch(folder: Path, url: str, moment_s: float) -> None:
    async with page(folder, *SOFTWARE_GL) as tab:
        await tab.open(f"{url}#t={moment_s:.2f}", *SIZE)
        await tab.until("window.vistel && window.vistel.ready() === 3")
        await tab.until("document.querySelectorAll('#views button').length === 5")
        await press(tab, "#views", "Aiko’s eyes")
        await press(tab, ".choices", "Ben")
        await tab.until("window.vistel.contacts()[0] > 0")
        await kept(tab, "replay-contact", "main")


async def press(tab: Page, part: str, text: str) -> None:
    """The button that begins so: people stand in the order in which they came."""
    await tab.value(f"[...document.querySelectorAll('{part} button')].find((b) => b.innerText.startsWith('{text}')).click()")


async def resize(tab: Page, size: tuple[int, int]) -> None:
    await tab.call("Emulation.setScrollbarsHidden", hidden=size == PHONE)
    await tab.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)


async def later(tab: Page, seconds: float) -> None:
    """The other log's people stand where they were so much later."""
    set_field = f"field.value = '{seconds}'; field.dispatchEvent(new Event('change', {{ bubbles: true }}))"
    await tab.value(f"(field => {{ {set_field} }})(document.querySelector('.beside input'))")


async def kept(tab: Page, name: str, part: str = "html") -> None:
    await tab.value("document.activeElement.blur(), scrollTo(0, 0), window.vistel.sharp()")
    await tab.value("document.getElementById('language').style.visibility = 'hidden'")  # the machine may lack its letters
    await asyncio.sleep(SETTLED_S)
    box = await tab.value(
        f"(r => [r.x, r.y, r.width, r.height].map(Math.round))(document.querySelector('{part}').getBoundingClientRect())"
    )
    x, y, width, height = (max(0, n) for n in box)
    picture = (await tab.picture())[y : y + height, x : x + width, ::-1]
    cv2.imwrite(str(HERE / f"{name}.png"), np.ascontiguousarray(picture), [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
