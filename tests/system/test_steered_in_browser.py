"""The host steers a running conference in a real browser: real processes, a real bus, and clicks and keys on the console's page."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import psutil
import pytest
from browser import Page, page
from waiting import until

from vistel.conference.running import Running, running_conferences
from vistel.wire.log import LogReader
from vistel.wire.zenoh.endpoints import answers
from vistel_services.console import bundle

pytestmark = pytest.mark.slow

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
CONFERENCE = """name = "steered"

[[sites]]
name = "lab"
[[sites.participants]]
name = "guest-1"
guest = true
"""


@contextlib.asynccontextmanager
async def running(folder: Path) -> AsyncIterator[tuple[Running, psutil.Process]]:
    """`vistel up`, once everything has begun, and its process."""
    (folder / "steered.toml").write_text(CONFERENCE)
    with (folder / "up.log").open("wb") as output:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "vistel_cli.main", "up", "steered.toml", cwd=folder, stdout=output, stderr=output
        )
    try:
        log = folder / "up.log"
        await until(lambda: "everybody sees everybody" in log.read_text() or process.returncode is not None, "the conference")
        assert process.returncode is None, log.read_text()
        (run,) = running_conferences("steered")
        served = run.console.replace("http://", "tcp/").strip("/")
        await until(lambda: answers(served, 1.0) or process.returncode is not None, "its console")
        yield run, psutil.Process(process.pid)
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGINT)
        await process.wait()


def pids(node: str, up: psutil.Process) -> set[int]:
    """Of the processes that are the node of this conference: others of the same name may run beside it."""
    found: set[int] = set()
    for process in up.children(recursive=True):
        with contextlib.suppress(psutil.Error):
            words = process.cmdline()
            if f"vistel: {node}" in words or node in words:
                found.add(process.pid)
    return found


async def typed(tab: Page, text: str) -> None:
    for letter in text:
        await tab.call("Input.insertText", text=letter)


async def key(tab: Page, name: str, code: int) -> None:
    text = {"text": "\r"} if name == "Enter" else {}
    for kind in ("keyDown", "keyUp"):
        await tab.call("Input.dispatchKeyEvent", type=kind, key=name, code=name, windowsVirtualKeyCode=code, **text)


def answered(text: str) -> str:
    """JavaScript: whether there is an answer that says this."""
    return f"document.querySelector('.answers')?.innerText.includes({text!r})"


def row(node: str) -> str:
    """JavaScript: the row of a process."""
    return f"[...document.querySelectorAll('.steer-services tr')].find(r => r.cells[0].innerText === {node!r})"


async def choose(tab: Page, words: str, wanted: str) -> None:
    """Type these words, and take the one that is offered first."""
    await typed(tab, words)
    await tab.until(f"document.querySelector('#ask-found li')?.innerText === {wanted!r}")
    await key(tab, "ArrowDown", 40)
    await tab.until("document.querySelector('[name=ask]').getAttribute('aria-activedescendant') === 'ask-0'")
    await key(tab, "Enter", 13)
    await tab.until(f"document.querySelector('[name=ask]').value.endsWith({wanted + ' '!r})")


async def press(tab: Page, button: str) -> None:
    """Click what may still be moved by what comes above it, once it can be clicked; button: JavaScript."""
    await tab.until(f"((button) => button && !button.disabled && (button.click(), true))({button})")


async def steer(tab: Page, run: Running, up: psutil.Process) -> None:
    """What the host does on the page, and what comes of it outside of it."""
    await tab.open(run.console, 1280, 800)
    await tab.until("document.querySelector('.steer-services')")
    await tab.value("document.querySelector('[name=ask]').focus()")
    await choose(tab, "pai", "paint")
    await choose(tab, "the red bat", "red baton")
    await choose(tab, "bl", "blue")
    await key(tab, "Enter", 13)
    await tab.until(answered("done: baton"))
    await typed(tab, "paint the elephant blue")
    await key(tab, "Enter", 13)
    await tab.until("document.querySelector('.answers .bad')?.innerText.includes('elephant')")

    await tab.value("document.querySelectorAll('.steer details').forEach(group => (group.open = true))")
    await until(lambda: len(pids("hub/world", up)) == 1, "the world's process")
    world = pids("hub/world", up)
    await tab.until("document.querySelector('.faults select')")
    assert await tab.value("document.querySelector('.faults select').value") == "kill"
    await tab.until("document.querySelectorAll('.faults select')[1]?.value === 'hub/world'")
    await press(tab, "document.querySelector('.faults .grave')")
    await tab.until("document.querySelector('dialog[open]')")
    await tab.click("dialog .choices button:first-child")
    await tab.until("!document.querySelector('dialog')")
    assert not await tab.value(answered("Fault")) and pids("hub/world", up) == world
    await press(tab, "document.querySelector('.faults .grave')")
    await tab.until("document.querySelector('dialog[open]')")
    await tab.click("dialog .grave")
    await tab.until(answered("Fault kill hub/world done"))
    await until(lambda: len(pids("hub/world", up) - world) == 1, "another process of the world")

    capture = pids("lab/capture", up)
    await tab.until(f"{row('lab/capture')}?.innerText.includes('runs')")
    await press(tab, f"{row('lab/capture')}?.querySelector('button')")
    await tab.until("document.querySelector('dialog[open]')")
    await tab.click("dialog .grave")
    await tab.until(answered("Restart lab/capture done"))
    await until(lambda: len(pids("lab/capture", up) - capture) == 1, "another process of the site")
    await tab.until(f"{row('lab/capture')}?.innerText.includes('runs')")
    await tab.value(
        "Object.assign(document.querySelector('.filters input'), { value: 'event=host_request' }).dispatchEvent(new Event('input'))"
    )
    await tab.until("document.querySelector('.loglines')?.innerText.includes('restarting process=lab/capture')")


def test_the_host_asks_causes_a_fault_and_restarts_a_service_in_a_browser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))

    async def play() -> Path:
        async with running(tmp_path) as (run, up), page(tmp_path, *SOFTWARE_GL) as tab:
            await steer(tab, run, up)
            assert not [m for m in tab.messages if "Error" in m and "WebSocket" not in m], tab.messages
            return Path(run.folder)

    folder = asyncio.run(play())
    records = LogReader(folder / "conference.mcap").records(("host_action",))
    acts = [(r.message.action, r.message.text, r.message.done) for r in records]
    assert acts == [
        ("ask", "paint the red baton blue", True),
        ("ask", "paint the elephant blue", False),
        ("fault", "kill hub/world", True),
        ("restart", "lab/capture", True),
    ]
