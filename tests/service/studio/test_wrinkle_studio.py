"""The wrinkle studio in a real browser: a page is opened, a point dragged, the figure creases, the file is saved."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from aiohttp import web
from avatar_fixture import long_armed, same
from browser import Page, page

from vistel.figure.avatar.texture import island_of
from vistel.figure.formats.usd import load_usd, save_usd
from vistel.wrinkle.wrinkle_sets import load_sets, sets_in, wrinkle_sets
from vistel_cli.studio.pages import studios
from vistel_cli.studio.wrinkles.opened import Opened
from vistel_cli.studio.wrinkles.server import WrinkleStudio

READY = "!!window.studio && window.studio.link.idle && window.studio.state.sets.length > 0"
CONTROL, SHIFT = 2, 8
"""Modifier keys, as the browser counts them."""


@dataclass
class Tab:
    """The studio's page."""

    page: Page
    path: Path
    address: str

    async def settled(self) -> None:
        """Shows what the server computed of all that was asked."""
        await self.page.until(READY)

    async def state(self, what: str) -> Any:
        return await self.page.value(f"(() => {{ const {{ state, plane }} = window.studio; void plane; return {what}; }})()")

    async def on_screen(self, view: str, place: str) -> tuple[float, float]:
        """Where a place of a view, JavaScript of `state` and `view`, is on the page."""
        x, y = await self.page.value(
            f"(() => {{ const {{ state, {view} }} = window.studio, b = document.getElementById('{view}').getBoundingClientRect();"
            f" const view = {view}, p = view.toScreen({place}); return [p[0] + b.left, p[1] + b.top]; }})()"
        )
        return x, y

    async def mouse(self, kind: str, x: float, y: float, clicks: int = 1) -> None:
        held = "none" if kind == "mouseMoved" else "left"
        await self.page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=held, buttons=1, clickCount=clicks)

    async def click(self, x: float, y: float, clicks: int = 1) -> None:
        for kind in ("mousePressed", "mouseReleased"):
            await self.mouse(kind, x, y, clicks)

    async def drag(self, start: tuple[float, float], by: tuple[float, float]) -> None:
        await self.mouse("mousePressed", *start)
        for share in (0.5, 1.0):
            await self.mouse("mouseMoved", start[0] + share * by[0], start[1] + share * by[1])
        await self.mouse("mouseReleased", start[0] + by[0], start[1] + by[1])
        await self.settled()

    async def key(self, key: str, modifiers: int = 0) -> None:
        for kind in ("keyDown", "keyUp"):
            await self.page.call("Input.dispatchKeyEvent", type=kind, key=key, modifiers=modifiers)
        await self.settled()

    async def choose(self, name: str) -> None:
        await self.page.value(f"document.querySelector({json.dumps(f'[data-set={name}]')}).click()")
        await self.settled()

    async def figure(self, such: Callable[[np.ndarray], bool] = lambda shown: True) -> np.ndarray:
        """What the figure's canvas shows, once it is such: a slow machine draws what is settled some pictures later."""
        while not such(shown := await self._figure()):
            await asyncio.sleep(0.05)  # taking a picture of the page is work for the machine that is to draw it
        return shown

    async def _figure(self) -> np.ndarray:
        box = await self.page.value("document.getElementById('figure').getBoundingClientRect().toJSON()")
        x, y, w, h = (round(box[k]) for k in ("x", "y", "width", "height"))
        return (await self.page.picture())[y : y + h, x : x + w].astype(float)


@contextlib.asynccontextmanager
async def studio(folder: Path) -> AsyncIterator[Tab]:
    path = folder / "somebody.usda"
    save_usd(long_armed(), path)
    hosts: set[str] = set()
    part = WrinkleStudio(Opened(load_usd(path), path, path.name, wrinkle_sets(["shirt", "face"]))).app()
    runner = web.AppRunner(studios({"wrinkles": part}, hosts, "wrinkles"))
    await runner.setup()
    try:
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        address = f"127.0.0.1:{runner.addresses[0][1]}"
        hosts.add(address)
        async with page(folder, "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader") as tab:
            out = Tab(tab, path, f"http://{address}/")
            await tab.open(out.address, 1440, 900)
            await out.settled()
            yield out
            assert [m for m in tab.messages if "GL Driver Message" not in m] == []  # slow to read back: no fault
    finally:
        await runner.cleanup()


def test_a_dragged_point_creases_the_figure_undo_takes_it_back_and_the_file_holds_what_was_drawn(tmp_path: Path) -> None:
    asyncio.run(_drag_undo_save(tmp_path))


async def _drag_undo_save(folder: Path) -> None:
    async with studio(folder) as tab:
        await tab.choose("sleeve_deep")
        seen = await tab.figure(lambda shown: shown.std() > 5.0)
        while not np.array_equal(seen, newer := await tab.figure()):
            seen = newer  # until it stands still
        form = await tab.state("JSON.stringify(state.form)")
        start = await tab.on_screen("plane", "state.pointsOf(1)[2][2]")
        await tab.drag(start, (10.0, 60.0))
        assert await tab.state("state.wrinkle.shape") == "elbow_star_2"
        assert await tab.state("state.faults.filter((f) => f.set !== null)") == []
        assert "no texture coordinates" in await tab.page.value("document.getElementById('faults').textContent")  # of the face
        there = await tab.on_screen("plane", "state.pointsOf(1)[2][2]")
        np.testing.assert_allclose(there, (start[0] + 10.0, start[1] + 60.0), atol=1.5)
        changed = np.abs(await tab.figure(lambda shown: np.abs(shown - seen).max() > 8.0) - seen)

        await tab.key("z", CONTROL)
        assert await tab.state("JSON.stringify(state.form)") == form
        await tab.figure(lambda shown: np.abs(shown - seen).mean() < 0.2 * changed.mean())
        await tab.key("z", CONTROL | SHIFT)
        assert await tab.state("state.form.shapes.length") == 1

        await tab.key("b")
        on_curve = await tab.on_screen("plane", "state.curvesOf(1)[2][30].at")
        for by in ((0, 0), (30, 25), (45, 60)):
            await tab.click(on_curve[0] + by[0], on_curve[1] + by[1])
        await tab.key("Enter")
        assert await tab.state("state.shape.branches.length") == 7
        knot = await tab.on_screen("drive", "state.set.drive.curve.knots[1]")
        await tab.drag(knot, (0.0, -20.0))
        assert await tab.state("state.faults.filter((f) => f.set !== null)") == []

        before = load_usd(tab.path)
        await tab.page.click("#mode-photograph")
        await tab.page.until("document.getElementById('notice').textContent.startsWith('Click the net')")
        own = "view.laid.island.findIndex((n) => n === view.island)"
        corner = f"[0, 1].map((k) => view.laid.uv[2 * {own} + k] * view.laid.size[k])"
        await tab.drag(await tab.on_screen("pins", corner), (30.0, 12.0))
        pin = await tab.state("state.form.pins[0]")
        await tab.page.click("#mode-wrinkles")
        await tab.settled()

        await tab.key("s", CONTROL)
        await tab.page.until("document.getElementById('notice').className === 'good'")
        saved = load_usd(tab.path)
        sets = sets_in(saved.wrinkles, "saved")
        assert [s.entry for s in sets] == [s.entry for s in load_sets(tab.path.with_name("somebody_wrinkles.toml"))]
        deep = next(s for s in sets if s.entry.name == "sleeve_deep")
        drawn = [b.places.tolist() for b in deep.shapes["elbow_star_2"].branches]
        assert drawn == await tab.state("state.form.shapes[0].branches.map((b) => b.points.map((p) => p.at))")
        assert deep.entry.drive.curve.knots[1][1] == await tab.state("state.set.drive.curve.knots[1][1]") > 0.7
        moved = np.array(pin["to"]) - np.array(pin["from"])
        mine = island_of(before)[0] == 0
        np.testing.assert_allclose(saved.mesh.uv[mine] - before.mesh.uv[mine], np.tile(moved, (mine.sum(), 1)), atol=1e-5)
        same(saved.mesh.vertices, before.mesh.vertices)
        same(saved.albedo, before.albedo)
