"""The calibration studio's part of the server: who and what can be calibrated, the one that is under way, what the devices see."""

import asyncio
import base64
import json
import logging
from pathlib import Path
from typing import Any

from aiohttp import web

from vistel.arrays import U8
from vistel.conference.model import Conference
from vistel.wire import background
from vistel_cli.calibrate.ask import Now, until
from vistel_cli.studio.live_calibration import FAULTS, Found, Offer, calibrate, jpeg, offers
from vistel_cli.studio.pages import PAGE, add_files
from vistel_cli.studio.requests import RequestError, read_json

log = logging.getLogger("vistel.studio")

_LOOK_S = 0.1
"""Between two looks whether something is new for a page."""
_MOST_PAGES = 8
_SHOWN_S = 0.1


class Progress:
    """Of one calibration: what is asked, how far it is, what the devices see. number: grows with every change."""

    def __init__(self, offer: Offer) -> None:
        self.offer, self.number = offer, 1
        self.say, self.phase, self.left_s = "Waiting for the device.", "asks", 0.0
        self.fault, self.kept = "", ""
        self.found: Found | None = None
        self._live: dict[str, Any] = {}
        self._picture: tuple[U8, list[tuple[float, float, float]]] | None = None

    def change(self, phase: str = "", say: str = "", left_s: float | None = None) -> None:
        """Say how far it is."""
        self.phase, self.say = phase or self.phase, say or self.say
        self.left_s = self.left_s if left_s is None else left_s
        self.number += 1

    def tell(self, text: str) -> None:
        """As `Asker`."""
        self.change("asks", text, 0.0)

    async def lead(self, now: Now, begin_s: float, seconds: float, go: str) -> None:
        """As `Asker`."""
        while (left := begin_s - now()) > 0.0:
            self.change("ready", left_s=left)
            await until(now, min(begin_s, now() + _SHOWN_S))
        while (left := begin_s + seconds - now()) > 0.0:
            self.change("go", left_s=left)
            await until(now, min(begin_s + seconds, now() + _SHOWN_S))

    def receivers(self, places: dict[str, list[float]]) -> None:
        """As `Seen`."""
        self._live = {"receivers": self._live.get("receivers", {}) | places}
        self.number += 1

    def angles(self, degrees: list[float]) -> None:
        """As `Seen`."""
        self._live = {"angles": degrees}
        self.number += 1

    def picture(self, picture: U8, circles: list[tuple[float, float, float]]) -> None:
        """As `Seen`."""
        self._picture = picture, circles
        self.number += 1

    def page_form(self) -> dict[str, Any]:
        """For a page."""
        live = self._live
        if self._picture is not None:
            live = {"picture": "data:image/jpeg;base64," + base64.b64encode(jpeg(*self._picture)).decode()}
        found = self.found
        return {
            "participant": self.offer.person.name,
            "what": self.offer.what,
            "say": self.say,
            "phase": self.phase,
            "left": round(self.left_s, 1),
            "fault": self.fault,
            "kept": self.kept,
            "found": None if found is None else {"verdict": found.verdict, "rows": found.rows, "notes": found.notes},
            "live": live,
        }


class CalibrationStudio:
    """conference: whose devices are calibrated, None for none; file: its file, beside which calibrations are written."""

    def __init__(self, conference: Conference | None, file: Path | None) -> None:
        self._conference, self._folder = conference, (file or Path()).parent
        self._offers = {f"{o.person.name} {o.what}": o for o in (offers(conference) if conference else ())}
        self._progress: Progress | None = None
        self._task: asyncio.Task[None] | None = None
        self._changing = asyncio.Lock()
        self._pages = 0

    def app(self) -> web.Application:
        """Its part of the studios' server."""
        app = web.Application()
        files = {"/": "calibration.html", "/calibration.css": "calibration.css", "/calibration.js": "calibration.js"}
        add_files(app, PAGE, files)
        app.router.add_get("/offers.json", self._offered)
        app.router.add_get("/now", self._now)
        app.router.add_post("/start", self._start)
        app.router.add_post("/stop", self._stop)
        app.router.add_post("/keep", self._keep)
        app.on_shutdown.append(self._close)
        return app

    async def _close(self, _: web.Application) -> None:
        await self._end()

    async def _offered(self, _: web.Request) -> web.StreamResponse:
        rows = [
            {
                "participant": o.person.name,
                "what": o.what,
                "device": o.device.name,
                "kind": o.device.kind.title,
                "port": o.device.port,
                "file": o.file,
                "key": o.key,
                "exists": (self._folder / o.file).exists(),
            }
            for o in self._offers.values()
        ]
        name = "" if self._conference is None else self._conference.name
        return web.json_response({"conference": name, "offers": rows})

    async def _start(self, request: web.Request) -> web.StreamResponse:
        """{participant, what}: begin one; the one before ends."""
        asked = await read_json(request)
        offer = self._offers.get(f"{asked.get('participant')} {asked.get('what')}")
        if offer is None or self._conference is None:
            raise RequestError("no such calibration; load the page again", 404)
        async with self._changing:
            await self._end()
            self._progress = Progress(offer)
            self._task = background.start(self._run(self._conference, self._progress), "calibration")
        log.info("event=calibration_started participant=%s what=%s", offer.person.name, offer.what)
        return web.json_response({})

    async def _run(self, conference: Conference, progress: Progress) -> None:
        try:
            progress.found = await calibrate(conference, progress.offer, progress, progress)
            progress.change("done")
        except FAULTS as fault:
            progress.fault = str(fault)
            progress.change("failed")
        except Exception:
            progress.fault = "this failed; the studio's log says more"
            progress.change("failed")
            raise

    async def _stop(self, _: web.Request) -> web.StreamResponse:
        async with self._changing:
            await self._end()
            self._progress = None
        return web.json_response({})

    async def _keep(self, request: web.Request) -> web.StreamResponse:
        """Write what was found; {over: true}: over a file that is there."""
        asked, progress = await read_json(request), self._progress
        if progress is None or progress.found is None:
            raise RequestError("there is nothing to keep")
        path = self._folder / progress.offer.file
        if path.exists() and asked.get("over") is not True:
            raise RequestError(f"{path.name} is there already", 409)
        await asyncio.to_thread(progress.found.save, path)
        progress.kept = path.name
        progress.change()
        log.info("event=calibration_kept path=%s", path)
        return web.json_response({"file": path.name})

    async def _end(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None

    async def _now(self, request: web.Request) -> web.StreamResponse:
        """How far it is, as server-sent events; null where none is under way."""
        if self._pages >= _MOST_PAGES:
            raise RequestError("too many pages; close some", 503)
        response = web.StreamResponse(headers={"Content-Type": "text/event-stream", "Cache-Control": "no-store"})
        await response.prepare(request)
        self._pages += 1
        try:
            sent: object = ()
            while request.transport is not None:  # a page that has gone is not written to, and would count for ever
                progress = self._progress
                new = progress, progress and progress.number
                if new != sent:
                    sent = new
                    form = progress and progress.page_form()
                    await response.write(f"data: {json.dumps(form)}\n\n".encode())
                await asyncio.sleep(_LOOK_S)
        except ConnectionError:
            pass
        finally:
            self._pages -= 1
        return response
