"""The calibration studio: what it offers, that a page asks for the moves and shows what the devices see, and what it writes."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest
from aiohttp import ClientSession, web
from virtual_time import LoopClock, run

from vistel.conference.files import load
from vistel.figure.calibration.files import load_body, load_tracker
from vistel.figure.calibration.moves import MoveError
from vistel.protocol.glove_calibration import load_calibration
from vistel.vision.face_calibration import read_face
from vistel.vision.gaze_calibration import read_gaze
from vistel_cli.devices import session as device_session
from vistel_cli.studio import calibration, live_calibration
from vistel_cli.studio.calibration import CalibrationStudio, Progress
from vistel_cli.studio.pages import studios

FILE = """
name = "lab"
[[sites]]
name = "here"
[[sites.participants]]
name = "ada"
height = 1.68
[sites.participants.tracker]
[sites.participants.gloves.left]
[sites.participants.face]
kind = "camera"
[sites.participants.eye]
[[sites.participants]]
name = "bob"
guest = true
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(device_session, "SystemClock", LoopClock)
    path = tmp_path / "lab.toml"
    path.write_text(FILE)
    return path


def offer_of(file: Path, what: str) -> live_calibration.Offer:
    return next(o for o in live_calibration.offers(load(file)) if o.what == what)


class Watched(Progress):
    """Remembers what was said, and what was shown of the devices."""

    def __init__(self, offer: live_calibration.Offer) -> None:
        super().__init__(offer)
        self.all_said: list[str] = []
        self.phases: set[str] = set()
        self.shown: list[dict] = []

    def change(self, phase: str = "", say: str = "", left_s: float | None = None) -> None:
        super().change(phase, say, left_s)
        self.phases.add(self.phase)
        if say:
            self.all_said.append(say)
            self.shown.append(self.page_form()["live"])


def test_everybody_with_a_device_that_can_be_calibrated_is_offered(file: Path) -> None:
    found = [(o.person.name, o.what, o.file, o.key) for o in live_calibration.offers(load(file))]
    assert found == [
        ("ada", "body", "ada-body.json", "body"),
        ("ada", "tracker", "ada-tracker.json", "tracker.calibration"),
        ("ada", "left_glove", "ada-left.json", "gloves.left.calibration"),
        ("ada", "face", "ada-face.json", "face.calibration"),
        ("ada", "gaze", "ada-eye.json", "eye.calibration"),
    ]


def test_a_tracker_and_a_body_are_measured_and_every_receiver_is_seen(file: Path, tmp_path: Path) -> None:
    for what, read in (("tracker", load_tracker), ("body", load_body)):
        watched = Watched(offer_of(file, what))
        found = run(live_calibration.calibrate(load(file), watched.offer, watched, watched))
        assert found.verdict in ("good", "fair"), found.rows
        assert len({name for name, _, _ in found.rows}) == len(found.rows) == (9 if what == "body" else 5)
        assert len([said for said in watched.all_said if said[0].isdigit()]) == 6
        assert watched.phases == {"asks", "ready", "go"}
        assert set(watched.shown[2]["receivers"]) == {"head", "chest", "left hand", "right hand"}
        found.save(tmp_path / f"{what}.json")
        read(tmp_path / f"{what}.json")


def test_a_hand_is_measured_and_its_fingers_are_seen(file: Path, tmp_path: Path) -> None:
    watched = Watched(offer_of(file, "left_glove"))
    found = run(live_calibration.calibrate(load(file), watched.offer, watched, watched))
    assert found.verdict == "good", found.notes
    assert [row[0] for row in found.rows] == ["open", "fist", "spread", "pinch"]
    fist = watched.shown[2]["angles"]  # just before the third is asked for
    assert len(fist) == 20 and fist[4] > 40.0
    found.save(tmp_path / "hand.json")
    load_calibration(tmp_path / "hand.json")


def test_a_face_and_an_eye_are_measured_and_their_pictures_are_seen(file: Path, tmp_path: Path) -> None:
    for what, read in (("face", read_face), ("gaze", read_gaze)):
        watched = Watched(offer_of(file, what))
        found = run(live_calibration.calibrate(load(file), watched.offer, watched, watched))
        assert found.verdict == "good", found.rows
        assert watched.page_form()["live"]["picture"].startswith("data:image/jpeg;base64,/9j/")
        found.save(tmp_path / f"{what}.json")
        read(tmp_path / f"{what}.json")


def served(file: Path, ask) -> None:
    """As the command serves it: aiohttp's server for tests ends what a client leaves, and that of the command does not."""

    async def serve() -> None:
        hosts: set[str] = set()
        parts = {"calibration": CalibrationStudio(load(file), file).app()}
        runner = web.AppRunner(studios(parts, hosts, "calibration"), shutdown_timeout=1.0)
        await runner.setup()
        try:
            await web.TCPSite(runner, "127.0.0.1", 0).start()
            address = f"127.0.0.1:{runner.addresses[0][1]}"
            hosts.add(address)
            async with ClientSession(f"http://{address}") as client:
                await ask(client)
        finally:
            await runner.cleanup()

    asyncio.run(serve())


async def ended(client: ClientSession) -> str:
    """Reads how far it is until it has ended; the last that was said."""
    async with client.get("/calibration/now") as events:
        async for line in events.content:
            if b'"phase": "done"' in line or b'"phase": "failed"' in line:
                return line.decode()
    raise AssertionError("the events ended")


def test_what_was_found_is_kept_beside_the_conference_file_and_never_written_over_unasked(file: Path, tmp_path: Path) -> None:
    async def ask(client: ClientSession) -> None:
        assert (await client.post("/calibration/keep", json={})).status == 400  # nothing yet
        await client.post("/calibration/start", json={"participant": "ada", "what": "gaze"})
        assert '"verdict": "good"' in await ended(client)
        assert (await client.post("/calibration/keep", json={})).status == 200
        kept = (tmp_path / "ada-eye.json").read_bytes()
        (tmp_path / "ada-eye.json").write_bytes(b"somebody's")
        assert (await client.post("/calibration/keep", json={})).status == 409
        assert (tmp_path / "ada-eye.json").read_bytes() == b"somebody's"
        assert (await client.post("/calibration/keep", json={"over": True})).status == 200
        assert (tmp_path / "ada-eye.json").read_bytes() == kept
        offered = await (await client.get("/calibration/offers.json")).json()
        assert [o["what"] for o in offered["offers"] if o["exists"]] == ["gaze"]

    served(file, ask)


def test_a_calibration_that_fails_says_why_in_one_line(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def fails(*_: object) -> None:
        raise MoveError("arms: the receiver left hand was silent")

    monkeypatch.setattr(calibration, "calibrate", fails)

    async def ask(client: ClientSession) -> None:
        await client.post("/calibration/start", json={"participant": "ada", "what": "tracker"})
        assert '"fault": "arms: the receiver left hand was silent"' in await ended(client)
        assert (await client.post("/calibration/keep", json={})).status == 400

    served(file, ask)


def test_a_camera_that_is_not_there_is_said_on_the_page(file: Path) -> None:
    file.write_text(FILE.replace("participants.eye]", 'participants.eye]\nsource = "/dev/video99"'))

    async def ask(client: ClientSession) -> None:
        await client.post("/calibration/start", json={"participant": "ada", "what": "gaze"})
        assert "/dev/video99" in json.loads((await ended(client)).removeprefix("data: "))["fault"]

    served(file, ask)


def test_one_that_is_stopped_leaves_the_devices_free_for_the_next(file: Path) -> None:
    async def ask(client: ClientSession) -> None:
        await client.post("/calibration/start", json={"participant": "ada", "what": "tracker"})
        assert (await client.post("/calibration/stop", json={})).status == 200
        await client.post("/calibration/start", json={"participant": "ada", "what": "face"})
        assert '"verdict": "good"' in await ended(client)

    served(file, ask)


def test_pages_that_have_gone_leave_room_for_others(file: Path) -> None:
    async def ask(client: ClientSession) -> None:
        async def came() -> bool:
            async with client.get("/calibration/now") as events:
                return events.status == 200 and (await events.content.readline()).strip() == b"data: null"

        for _ in range(2 * calibration._MOST_PAGES):
            while not await came():  # one that has gone is noticed soon
                await asyncio.sleep(calibration._LOOK_S)

    served(file, ask)


def test_of_two_that_are_begun_at_once_one_goes_on(file: Path) -> None:
    async def ask(client: ClientSession) -> None:
        asked = {"participant": "ada", "what": "tracker"}
        await asyncio.gather(*(client.post("/calibration/start", json=asked) for _ in range(3)))
        assert sum(task.get_name() == "calibration" for task in asyncio.all_tasks()) == 1

    served(file, ask)


@pytest.mark.parametrize("asked", [{}, {"participant": "bob", "what": "tracker"}, {"participant": ["ada"], "what": None}])
def test_what_nobody_has_is_not_begun(file: Path, asked: dict) -> None:
    async def ask(client: ClientSession) -> None:
        assert (await client.post("/calibration/start", json=asked)).status == 404

    served(file, ask)
