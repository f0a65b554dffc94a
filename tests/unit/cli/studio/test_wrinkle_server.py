"""The wrinkle studio's server: what it refuses, what it says of what cannot be used, and that no page overwrites another's work."""

from __future__ import annotations

import asyncio
import io
import json
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from aiohttp import web
from avatar_fixture import long_armed
from PIL import Image

from vistel.figure.formats.usd import load_usd, save_usd
from vistel.wrinkle.wrinkle_sets import sets_in, wrinkle_sets
from vistel_cli.studio.pages import studios
from vistel_cli.studio.wrinkles.document import page_form
from vistel_cli.studio.wrinkles.opened import Opened, worn_by
from vistel_cli.studio.wrinkles.photograph import lying, plain, texture_of
from vistel_cli.studio.wrinkles.server import WrinkleStudio

KINDS = {"f4": np.float32, "u4": np.uint32, "u1": np.uint8}


@dataclass
class Server:
    address: str
    path: Path

    def ask(self, path: str, body: bytes | None = None, **headers: str) -> tuple[int, bytes]:
        request = urllib.request.Request(f"http://{self.address}{path}", body, headers)
        try:
            with urllib.request.urlopen(request, timeout=600.0) as answer:
                return answer.status, answer.read()
        except urllib.error.HTTPError as fault:
            return fault.code, fault.read()

    def post(self, path: str, asked: object, **headers: str) -> tuple[int, dict[str, Any], dict[str, np.ndarray]]:
        status, data = self.ask(path, json.dumps(asked).encode(), **{"Content-Type": "application/json"} | headers)
        if data[:1] == b"{":
            return status, json.loads(data), {}
        length = int.from_bytes(data[:4], "little")
        head, at = json.loads(data[4 : 4 + length]), 4 + length
        arrays: dict[str, np.ndarray] = {}
        for said in head["arrays"]:
            array = np.frombuffer(data, KINDS[said["kind"]], int(np.prod(said["shape"])), at)
            arrays[said["name"]] = array.reshape(said["shape"])
            at += -(-array.nbytes // 4) * 4
        return status, head, arrays

    def open(self) -> dict[str, Any]:
        status, head, _ = self.post("/wrinkles/api/open", {})
        assert status == 200, head
        return head


def _studio(path: Path) -> web.Application:
    return WrinkleStudio(Opened(load_usd(path), path, path.name, wrinkle_sets(["trousers"]))).app()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    path = tmp_path_factory.mktemp("studio") / "somebody.usda"
    save_usd(long_armed(), path)
    loop, at = asyncio.new_event_loop(), list[str]()
    ready = threading.Event()

    async def begin() -> web.AppRunner:
        hosts: set[str] = set()
        runner = web.AppRunner(studios({"wrinkles": _studio(path)}, hosts, "wrinkles"))
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        at.append(f"127.0.0.1:{runner.addresses[0][1]}")
        hosts.add(at[0])
        ready.set()
        return runner

    def run() -> None:
        runner = loop.run_until_complete(begin())
        loop.run_forever()
        loop.run_until_complete(runner.cleanup())

    thread = threading.Thread(target=run)
    thread.start()
    assert ready.wait(600.0)
    yield Server(at[0], path)
    loop.call_soon_threadsafe(loop.stop)
    thread.join(600.0)
    loop.close()


def test_requests_of_other_pages_and_under_other_names_are_refused(server: Server) -> None:
    assert server.ask("/")[0] == 200  # leads to the page
    assert server.ask("/wrinkles/")[0] == 200
    assert server.ask("/wrinkles/", Host="evil.example")[0] == 403
    assert server.post("/wrinkles/api/open", {}, Origin="http://evil.example")[0] == 403
    assert server.post("/wrinkles/api/open", {}, Origin=f"http://{server.address}")[0] == 200
    assert server.ask("/wrinkles/api/open", b"{}", **{"Content-Type": "text/plain"})[0] == 415
    assert server.ask("/wrinkles/api/open", b"[" * 100_000, **{"Content-Type": "application/json"})[0] == 400


@pytest.mark.parametrize("path", ["/../server.py", "/%2e%2e/server.py", "/page/../../opened.py", "/somebody.usda"])
def test_nothing_but_the_page_is_read_from_disk(server: Server, path: str) -> None:
    assert server.ask(path)[0] == 404


def test_a_page_that_was_forgotten_is_reported_so(server: Server) -> None:
    status, said, _ = server.post("/wrinkles/api/update", {"session": "nobody"})
    assert (status, said["error"]) == (410, "this page's session has ended; open it again")


def test_what_cannot_be_used_is_reported_and_the_figure_stays_as_it_was(server: Server) -> None:
    page = server.open()
    asked = {"session": page["session"], "have": 0, "bends": {"knees": 90}}
    status, before, first = server.post("/wrinkles/api/update", {**asked, "form": page["form"]})
    assert status == 200
    assert before["faults"] == []
    shape = page["shapes"]["knee"]
    crossing = {"points": [{"at": [-1, -1]}, {"at": [1, 1]}]}, {"points": [{"at": [-1, 1]}, {"at": [1, -1]}]}

    def said(change: Any) -> str:
        form = deepcopy(page["form"])
        change(form)
        status, head, arrays = server.post("/wrinkles/api/update", {**asked, "form": form, "have": before["light"]["version"]})
        assert status == 200
        np.testing.assert_array_equal(arrays["uv"], first["uv"])
        assert "light" not in arrays
        return head["faults"][0]["text"]

    def wrinkle(**changes: object) -> Any:
        return lambda form: form["sets"][0]["wrinkles"][0].update(changes)

    assert "leaves the texture" in said(wrinkle(at=[0.3, 0.999]))
    assert "is not there" in said(wrinkle(shape="../../secret.toml"))
    assert "thickness" in said(wrinkle(thickness=-1))
    assert "unknown key" in said(wrinkle(colour="red"))
    assert "cross at" in said(lambda form: form["shapes"].append({**shape, "name": "mine", "branches": crossing}))
    assert "another set of that name" in said(lambda form: form["sets"].append(form["sets"][0]))
    assert said(lambda form: form.update(sets="none")) == "expected shapes and sets"


def test_only_the_light_that_changed_is_sent(server: Server) -> None:
    page = server.open()
    asked = {"session": page["session"], "bends": {"knees": 90}}
    _, head, arrays = server.post("/wrinkles/api/update", {**asked, "form": page["form"], "have": 0})
    whole = arrays["light"].copy()
    assert whole.shape == tuple(page["albedo"][::-1])
    page["form"]["sets"][0]["wrinkles"][0]["intensity"] *= 0.5
    _, head, arrays = server.post("/wrinkles/api/update", {**asked, "form": page["form"], "have": head["light"]["version"]})
    x, y, w, h = head["light"]["rect"]
    assert w * h < whole.size / 2
    whole[y : y + h, x : x + w] = arrays["light"]
    _, _, arrays = server.post("/wrinkles/api/update", {**asked, "have": 0})
    np.testing.assert_array_equal(arrays["light"], whole)


def test_a_set_is_sought_where_it_is_strongest(server: Server) -> None:
    page = server.open()
    knee = next(k for k, s in enumerate(page["form"]["sets"]) if s["name"] == "knee")
    asked = {"session": page["session"], "have": 0, "bends": {}, "form": page["form"], "seek": {"set": knee, "side": "left_"}}
    _, head, _ = server.post("/wrinkles/api/update", asked)
    assert head["bends"]["knees"] > 30
    assert next(s["weight"] for s in head["sets"] if s["set"] == knee) > 0.9


def test_what_is_saved_opens_the_same_and_a_stale_page_overwrites_nothing(server: Server) -> None:
    one, other = server.open(), server.open()
    form = one["form"]
    form["sets"][0]["drive"]["curve"]["knots"] = [[20, 0], [90, 1]]
    form["texture"] = [{"island": 0, "move": [0.01, -0.02], "turn": 0.1, "scale": 1.05}]
    status, done, _ = server.post("/wrinkles/api/save", {"session": one["session"], "revision": one["revision"], "form": form})
    assert status == 200, done
    saved = load_usd(server.path)
    again = page_form(worn_by(saved, "saved"))
    assert {key: form[key] for key in ("shapes", "sets")} == again
    assert texture_of(saved) == form["texture"]
    assert sets_in(server.path.with_name(done["files"][1]).read_text("utf-8"), "readable")

    before = server.path.read_bytes()
    stale = {"session": other["session"], "revision": other["revision"], "form": other["form"]}
    status, said, _ = server.post("/wrinkles/api/save", stale)
    assert status == 409
    assert "saved by somebody else" in said["error"]
    assert server.path.read_bytes() == before
    status, _, _ = server.post("/wrinkles/api/save", {"session": one["session"], "revision": done["revision"], "form": form})
    assert status == 200


def test_photographs_of_any_size_lie_on_an_island_and_others_are_refused(server: Server) -> None:
    page = server.open()
    address = f"/wrinkles/api/picture?session={page['session']}&island=0"
    kind = {"Content-Type": "application/octet-stream"}
    status, data = server.ask(address, b"no picture", **kind)
    assert status == 400
    assert "not a picture" in json.loads(data)["error"]
    stream = io.BytesIO()
    Image.new("RGB", (37, 61), (200, 30, 20)).save(stream, "png")
    assert server.ask(f"{address}999", stream.getvalue(), **kind)[0] == 400
    status, data = server.ask(address, stream.getvalue(), **kind)
    assert (status, json.loads(data)["base"]) == (200, 1)
    form = {**page["form"], "base": 1, "texture": []}
    _, laid, arrays = server.post("/wrinkles/api/photograph", {"session": page["session"], "form": form, "bends": {}})
    assert laid["size"] != page["albedo"]
    assert len(arrays["uv"]) == len(arrays["positions"]) == len(arrays["island"])


def test_registrations_come_back_as_they_were_laid() -> None:
    avatar = long_armed()
    said = [{"island": 1, "move": [0.02, 0.01], "turn": -0.2, "scale": 0.9}]
    made = lying(avatar, said)
    assert texture_of(made) == said
    np.testing.assert_allclose(plain(made).mesh.uv, avatar.mesh.uv, atol=1e-6)
