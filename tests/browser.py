"""A headless Chromium that a test drives through the DevTools protocol."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import ctypes
import itertools
import json
import os
import shutil
import signal
from collections.abc import AsyncIterator, Callable
from functools import partial
from pathlib import Path
from typing import Any

import aiohttp
import cv2
import numpy as np
import pytest
from waiting import until

_DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of prctl(2): no browser stays behind a test that is killed."""
_LOSE_CAPABILITY = 24
"""PR_CAPBSET_DROP of prctl(2)."""
_OF_NICENESS = 23
"""CAP_SYS_NICE of capabilities(7). Where tests run as root, Chromium would give the process that draws a priority of -8, and in
software GL that one starves all others."""


def chromium() -> str:
    """Its program; the test is skipped where there is none."""
    found = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)
    if found is None:
        pytest.skip("no Chromium on this machine")
    return found


_DRAWN_EVERY_MS = 100
"""Least time between two pictures of a page that is drawn seldom: without a graphics card sixty a second keep every core busy."""
_SELDOM = f"""
(() => {{
  const soon = window.requestAnimationFrame.bind(window);
  let last = -{_DRAWN_EVERY_MS};
  window.requestAnimationFrame = (draw) => soon(function show(now) {{
    if (now !== last && now - last < {_DRAWN_EVERY_MS}) return soon(show);
    last = now;
    draw(now);
  }});
}})();
"""


_AT_REST = """async (selector) => {
  const e = document.querySelector(selector);
  if (!e) return null;
  e.scrollIntoView({ block: "nearest", inline: "nearest" });
  const drawn = () => Promise.race([
    new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))),
    new Promise((done) => setTimeout(done, 500)), // a page that is not seen draws nothing
  ]);
  const middle = () => (({ x, y, width, height }) => [x + width / 2, y + height / 2])(e.getBoundingClientRect());
  await drawn(); // what is not drawn yet is not hit
  const [x, y] = middle();
  await drawn();
  const [nowX, nowY] = middle();
  const hit = document.elementFromPoint(x, y);
  return Math.hypot(nowX - x, nowY - y) < 0.5 && hit && e.contains(hit) ? [x, y] : null;
}"""
"""JavaScript: the middle of an element; null while it moves, as what comes above it may make it do, or something lies over it."""


class TabEndedError(Exception):
    """The tab crashed, or its browser ended: nothing is ever answered again."""


class Page:
    """One tab. messages: what its console said, errors included; events: whom to tell of what else it says of itself, by method."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self._socket, self._ids = socket, itertools.count(1)
        self._answers: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._ended = False
        self.messages: list[str] = []
        self.events: dict[str, Callable[[dict[str, Any]], None]] = {}

    async def listen(self) -> None:
        """Take answers until the tab or the browser goes; what is asked then raises TabEndedError."""
        async for said in self._socket:
            message = json.loads(said.data)
            if message.get("id") in self._answers:
                answer = self._answers.pop(message["id"])
                if not answer.done():  # who asked may have been cancelled
                    answer.set_result(message)
            elif message.get("method") == "Runtime.exceptionThrown":
                self.messages.append(message["params"]["exceptionDetails"].get("exception", {}).get("description", "error"))
            elif message.get("method") == "Log.entryAdded":
                self.messages.append(message["params"]["entry"]["text"])
            elif message.get("method") == "Inspector.targetCrashed":
                break
            elif message.get("method") in self.events:
                self.events[message["method"]](message["params"])
        self._ended = True
        for answer in self._answers.values():
            if not answer.done():
                answer.set_exception(TabEndedError())

    async def call(self, method: str, **params: Any) -> dict[str, Any]:
        """A method of the protocol. Raises RuntimeError with what the browser says against it, and TabEndedError."""
        if self._ended:
            raise TabEndedError
        number = next(self._ids)
        self._answers[number] = asyncio.get_running_loop().create_future()
        await self._socket.send_json({"id": number, "method": method, "params": params})
        answer = await self._answers[number]
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    async def open(self, url: str, width: int = 800, height: int = 520) -> None:
        await self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        await self.call("Page.navigate", url=url)

    async def value(self, expression: str) -> Any:
        """Of JavaScript; promises are awaited."""
        result = await self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description", expression))
        return result["result"].get("value")

    async def until(self, expression: str) -> Any:
        """The value of JavaScript once it is true."""
        try:
            while True:
                with contextlib.suppress(RuntimeError):  # the page is being loaded
                    if value := await self.value(expression):
                        return value
                await asyncio.sleep(0.05)  # a page does not say when it has changed
        except asyncio.CancelledError:
            print(f"given up waiting for {expression}; the page has said {self.messages}")
            raise

    async def picture(self) -> np.ndarray:
        """What is seen, (h, w, 3) RGB."""
        data = base64.b64decode((await self.call("Page.captureScreenshot", format="png"))["data"])
        return cv2.cvtColor(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)

    async def click(self, selector: str) -> None:
        """As somebody's mouse does, once it is there and has stayed where it is for a picture, with nothing over it."""
        place = await self.until(f"({_AT_REST})({json.dumps(selector)})")
        for kind in ("mousePressed", "mouseReleased"):
            await self.call("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], button="left", clickCount=1)


@contextlib.asynccontextmanager
async def page(folder: Path, *more: str, seldom: bool = True) -> AsyncIterator[Page]:
    """A tab of a browser of its own, which keeps what it keeps in `folder`; more: arguments of it; seldom: it draws as on a slow
    screen, which leaves room for other tests."""
    profile = folder / "chromium"
    process = await asyncio.create_subprocess_exec(
        chromium(),
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--mute-audio",
        "--disable-dev-shm-usage",
        "--remote-debugging-port=0",
        f"--user-data-dir={profile}",
        *more,
        "about:blank",
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=partial(_as_a_child, ctypes.CDLL(None).prctl),
    )
    try:
        port = await _port(profile / "DevToolsActivePort", process)
        async with aiohttp.ClientSession() as session:
            async with session.get(f"http://127.0.0.1:{port}/json/list") as answer:
                tab = next(t for t in await answer.json() if t["type"] == "page")
            async with session.ws_connect(tab["webSocketDebuggerUrl"], max_msg_size=0) as socket:
                opened = Page(socket)
                listening = asyncio.create_task(opened.listen())
                for domain in ("Inspector", "Page", "Runtime", "Log"):
                    await opened.call(f"{domain}.enable")
                if seldom:
                    await opened.call("Page.addScriptToEvaluateOnNewDocument", source=_SELDOM)
                yield opened
                listening.cancel()
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        await process.wait()


def _as_a_child(prctl: Callable[[int, int], int]) -> None:
    """What the browser's process does before it becomes the browser."""
    prctl(_DIE_WITH_PARENT, signal.SIGKILL)
    prctl(_LOSE_CAPABILITY, _OF_NICENESS)  # refused where it is not root, and not needed there


async def _port(file: Path, process: asyncio.subprocess.Process) -> int:
    def lines() -> list[str]:
        assert process.returncode is None, "Chromium ended"
        return file.read_text().splitlines() if file.exists() else []

    await until(lambda: len(lines()) == 2, "Chromium's port")
    return int(lines()[0])
