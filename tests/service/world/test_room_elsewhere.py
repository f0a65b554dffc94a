"""A room from files is drawn at sites that have not the files: seats, walls, polymeshes and pictures come from the world's site."""

from __future__ import annotations

import asyncio
import logging
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
import typer
from waiting import until, wait_until

from vistel.conference import room_assets
from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.room_assets import keep_asset, kept_asset, kept_model
from vistel.conference.rooms import interior_of
from vistel.conference.seats import seat_place
from vistel.figure.making.source import SourceMaterial
from vistel.geometry.pose import Pose
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.stage import Instant, Stage
from vistel.render.stage.world_view import PlayoutWorld
from vistel.session.models import RoomDeliveries
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.space.files.travel import pack_model, pack_picture, packers, picture_digest, pictures_in, unpack_model, unpack_picture
from vistel.space.room import Room
from vistel.v1.world_pb2 import AssetPart, AssetRequest
from vistel.wire import assets
from vistel.wire.assets import AssetRefusedError, AssetShelf, fetch_asset
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_cli.site.room_elsewhere import with_room
from vistel_services import world

DEN = Path(__file__).parents[3] / "examples/rooms/den.usdz"
FILE = """
name = "demo"
[room]
file = "den.usdz"
seats = 2
[[room.things]]
id = "second"
file = "den.usdz"
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "ann"
[[sites]]
name = "oslo"
[[sites.participants]]
name = "bob"
"""


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    """`machine(name)`: from now on files are kept on another machine; its folder with the conference file."""

    def change(name: str) -> Path:
        folder = tmp_path / name
        monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        folder.mkdir(exist_ok=True)
        (folder / "conference.toml").write_text(FILE)
        return folder

    return change


def pictured(side: int = 24) -> Polymesh:
    """A triangle with a picture."""
    picture = np.random.default_rng(side).integers(0, 256, (side, side, 3)).astype(np.uint8)
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)
    faces = np.array([(0, 1, 2)], np.int32)
    materials = (SourceMaterial("cloth", (1, 2, 3), picture), SourceMaterial("plain"))
    return Polymesh(corners, faces, corners[:, :2].copy(), faces, np.zeros(1, np.int32), materials)


def drawn(interior: Interior, models: dict[str, Polymesh]) -> np.ndarray:
    """A picture of the room as the studio draws it with these models."""
    still = Room((), (), shell=interior.room.shell)
    studio = SceneRenderer(View(320, 180, "room", ""), 2, decor=Interior(still), models=models)
    try:
        poses = {t.id: Pose(t.position, t.rotation) for t in interior.room.things}
        instant = Instant(1, (), PlayoutWorld(1, poses), MappingProxyType({t.id: t for t in interior.room.things}))
        wait_until(lambda: studio.complete)
        return studio.render(instant)
    finally:
        studio.close()


@pytest.mark.gl
def test_a_site_without_the_files_draws_what_the_world_has(
    tmp_path: Path, machine: Callable[[str], Path], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    owner = machine("owner")
    shutil.copy(DEN, owner / "den.usdz")
    conference = load(owner / "conference.toml")
    whole = interior_of(conference.room)

    async def run() -> tuple[dict[str, Polymesh], Stage, Conference, dict[str, Polymesh]]:
        clock = SystemClock()
        router = Router.open()
        buses = [await ZenohBus.open(conference="demo", site=n, clock=clock, endpoints=[router.endpoint]) for n in ("hub", "oslo")]
        config = world.configure(conference, None, RunPaths(tmp_path / "run", tmp_path / "out"))
        leading = asyncio.create_task(world.run(config, buses[0], clock))
        models: dict[str, Polymesh] = {}
        stage, listener = Stage(0), WorldListener(buses[1], clock)
        try:

            def seen() -> bool:
                for now, received_ns in listener.take():
                    stage.receive_world(now, received_ns)
                return bool(stage.looks)

            await until(seen)
            site = machine("oslo")
            assert not (site / "den.usdz").exists()
            guest = load(site / "conference.toml", room_elsewhere=True)
            guest = await asyncio.to_thread(with_room, guest, "oslo", router.endpoint, 20.0)
            deliveries = RoomDeliveries(buses[1], clock, models)

            def here() -> bool:
                deliveries.want(stage.looks)
                return models.keys() == stage.looks

            await until(here)
            deliveries.close()
            leading.cancel()  # nobody serves any more: the second time they are here
            await asyncio.gather(leading, return_exceptions=True)
            again: dict[str, Polymesh] = {}
            second = RoomDeliveries(buses[1], clock, again)
            second.want(stage.looks)
            await until(lambda: again.keys() == stage.looks)
            return models, stage, guest, again
        finally:
            leading.cancel()
            await asyncio.gather(leading, return_exceptions=True)
            listener.close()
            for bus in buses:
                await bus.close()
            router.close()

    models, _, guest, again = asyncio.run(run())
    assert models.keys() == set(whole.models) == again.keys()
    assert guest.room.seats == 2 and not guest.room.things
    for seat in range(2):
        (position, heading), (own, facing) = seat_place(guest.room, seat), seat_place(conference.room, seat)
        assert np.allclose(position, own, atol=1e-6) and heading == facing
    assert not interior_of(guest.room).room.shell
    here = drawn(whole, dict(whole.models))
    assert np.array_equal(drawn(whole, models), here)
    assert not np.array_equal(drawn(whole, {}), here)
    assert sum("event=model_arrived" in r.message for r in caplog.records) == len(models)


@pytest.mark.gl
def test_what_is_felt_stands_in_until_the_polymesh_is_there(machine: Callable[[str], Path]) -> None:
    machine("owner")
    whole = interior_of(Conference.model_validate({"room": {"file": DEN, "seats": 2}, "sites": [SITE]}).room)
    still = Room((), (), shell=False)
    models: dict[str, Polymesh] = {}
    studio = SceneRenderer(View(160, 90, "room", ""), 2, decor=Interior(still), models=models)
    try:
        things = {t.id: t for t in whole.room.things}
        poses = {t.id: Pose(t.position, t.rotation) for t in whole.room.things}
        instant = Instant(1, (), PlayoutWorld(1, poses), MappingProxyType(things))
        wait_until(lambda: studio.complete)
        first = studio.render(instant)
        models.update(whole.models)
        second = studio.render(instant)
        assert not np.array_equal(first, second)
        assert np.array_equal(studio.render(instant), second)
    finally:
        studio.close()


SITE = {"name": "tokyo", "participants": [{"name": "ann"}]}


def test_a_polymesh_is_the_same_after_the_journey() -> None:
    model = pictured()
    picture = model.materials[0].picture
    assert picture is not None
    data = pack_model(model)
    (name,) = pictures_in(data)
    back = unpack_model(data, model.digest, {name: unpack_picture(pack_picture(picture), name)})
    assert back.digest == model.digest and back.materials[1] == model.materials[1]


def test_what_is_another_one_or_damaged_is_refused() -> None:
    model = pictured()
    picture = model.materials[0].picture
    assert picture is not None
    data, name = pack_model(model), picture_digest(picture)
    with pytest.raises(ValueError, match="another one"):
        unpack_model(data, "0" * 32, {name: picture})
    with pytest.raises(ValueError, match="another one"):
        unpack_model(data, model.digest, {name: picture[::-1].copy()})
    with pytest.raises(ValueError, match="another one"):
        unpack_picture(pack_picture(picture), "0" * 32)
    for broken in (b"", b"PK\x03\x04", data[:-40], data[:100], bytes(1000)):
        with pytest.raises(ValueError):
            unpack_model(broken, model.digest, {name: picture})
        with pytest.raises(ValueError):
            unpack_picture(broken, name)
    bad = replace(model, triangles=np.array([(0, 1, 7)], np.int32))
    with pytest.raises(ValueError, match="vertices"):
        unpack_model(pack_model(bad), bad.digest, {name: picture})


def test_what_is_kept_and_damaged_is_forgotten(machine: Callable[[str], Path], caplog: pytest.LogCaptureFixture) -> None:
    machine("one")
    model = pictured()
    picture = model.materials[0].picture
    assert picture is not None
    keep_asset(model.digest, pack_model(model))
    assert kept_model(model.digest, {}) is None  # its picture is not here
    keep_asset(picture_digest(picture), pack_picture(picture))
    found = kept_model(model.digest, {})
    assert found is not None and found.digest == model.digest
    keep_asset(model.digest, b"not a polymesh")
    assert kept_model(model.digest, {}) is None
    assert "event=room_asset_damaged" in caplog.text
    assert kept_asset(model.digest) is None


def test_the_oldest_make_room(machine: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch) -> None:
    folder = machine("one")
    monkeypatch.setattr(room_assets, "MOST_KEPT", 2500)
    names = [f"{n:032x}" for n in range(4)]
    for n, name in enumerate(names):
        keep_asset(name, bytes([n]) * 1000)
        for path in folder.rglob(f"{name}*"):
            os.utime(path, (n, n))  # a file system's clock may be coarse
    assert [kept_asset(name) is not None for name in names] == [False, False, True, True]


def _bus(network: MemoryNetwork, site: str) -> MemoryBus:
    return network.bus("demo", site, SystemClock())


def test_many_parts_come_whole_and_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assets, "PART_EVERY_S", 0.0)
    monkeypatch.setattr(assets, "_NOT_READY_S", 0.01)
    data = np.random.default_rng(3).bytes(10 * assets.PART_BYTES + 17)
    digest, told = "a" * 32, list[tuple[int, int]]()

    async def run() -> bytes:
        network = MemoryNetwork()
        shelf = AssetShelf({digest: lambda: data}, lambda name: None)
        _bus(network, "hub").serve(BY_NAME["room_asset"], shelf.answer)
        return await fetch_asset(_bus(network, "oslo"), digest, lambda have, of: told.append((have, of)))

    assert asyncio.run(run()) == data
    assert told[-1] == (len(data), len(data)) and len(told) == 11


def test_what_is_too_large_or_lies_is_refused_and_nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assets, "PART_EVERY_S", 0.0)
    monkeypatch.setattr(assets, "_NOT_READY_S", 0.01)
    digest = "b" * 32

    def says(part: Callable[[int], AssetPart]) -> str:
        async def run() -> None:
            network = MemoryNetwork()
            _bus(network, "hub").serve(BY_NAME["room_asset"], lambda request: part(AssetRequest.FromString(request).part))
            await fetch_asset(_bus(network, "oslo"), digest)

        with pytest.raises(AssetRefusedError) as refused:
            asyncio.run(run())
        return str(refused.value)

    size = assets.PART_BYTES + 5
    assert "MB" in says(lambda n: AssetPart(parts=1, size=assets.MOST_BYTES + 1, data=b""))
    assert "parts" in says(lambda n: AssetPart(parts=9, size=10, data=b"0123456789"))
    assert "bytes" in says(lambda n: AssetPart(parts=2, size=size, data=b"short"))
    assert "different sizes" in says(lambda n: AssetPart(parts=2 + n, size=size, data=bytes(assets.PART_BYTES)))
    assert "it could not be packed" in says(lambda n: AssetPart(reason="it could not be packed"))

    async def shelf() -> str:
        network = MemoryNetwork()
        packs = AssetShelf({digest: lambda: bytes(assets.MOST_BYTES + 1)}, lambda name: None)
        _bus(network, "hub").serve(BY_NAME["room_asset"], packs.answer)
        with pytest.raises(AssetRefusedError) as refused:
            await fetch_asset(_bus(network, "oslo"), digest)
        return str(refused.value)

    assert "at most" in asyncio.run(shelf())


def test_a_polymesh_that_nobody_has_keeps_no_other_one_waiting_and_comes_when_somebody_has_it(
    machine: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    machine("oslo")
    monkeypatch.setattr(assets, "_NOT_READY_S", 0.01)
    monkeypatch.setattr(assets, "PACKING_S", 0.05)
    there, late = pictured(24), pictured(25)
    served = {}
    for model in (there, late):
        picture = model.materials[0].picture
        assert picture is not None
        served |= {model.digest: pack_model(model), picture_digest(picture): pack_picture(picture)}
    absent = {late.digest}

    async def run() -> None:
        network, models = MemoryNetwork(), dict[str, Polymesh]()

        def answer(request: bytes) -> AssetPart | None:
            asked = AssetRequest.FromString(request)
            if asked.digest in absent:
                return AssetPart()  # as somebody answers who packs it for ever
            data = served.get(asked.digest)
            return None if data is None else AssetPart(parts=1, size=len(data), data=data)

        _bus(network, "hub").serve(BY_NAME["room_asset"], answer)
        deliveries = RoomDeliveries(_bus(network, "oslo"), SystemClock(), models)
        deliveries.want(["d" * 32, late.digest, there.digest])
        await until(lambda: there.digest in models)
        assert models.keys() == {there.digest}
        absent.clear()
        await until(lambda: late.digest in models)
        deliveries.close()

    asyncio.run(run())


def test_a_shelf_answers_for_nothing_it_has_not() -> None:
    shelf = AssetShelf(packers(Interior(Room((), ()))), lambda name: None)
    assert shelf.answer(b"\xff\xff") is None
    assert shelf.answer(AssetRequest(digest="../../etc/passwd").SerializeToString()) is None
    missing = AssetRequest(digest="c" * 32).SerializeToString()
    wait_until(lambda: shelf.answer(missing) is None, "it says no more that it is being packed")


def test_without_a_world_that_has_it_one_line_says_so(machine: Callable[[str], Path], capsys: pytest.CaptureFixture[str]) -> None:
    folder = machine("oslo")
    with pytest.raises(ConferenceError, match="no such file"):
        load(folder / "conference.toml")
    guest = load(folder / "conference.toml", room_elsewhere=True)
    router = Router.open()
    try:
        with pytest.raises(typer.Exit):
            with_room(guest, "oslo", router.endpoint, 0.5)
    finally:
        router.close()
    assert "no world that has it answers" in capsys.readouterr().err
