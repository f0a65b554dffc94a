"""An avatar from a file is somebody at every site: it travels, is touched at its own surface, and is in the log."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from avatar_fixture import long_armed
from waiting import until
from world_site import START_NS, WorldSite

from vistel.conference.avatar_files import keep_parcel, kept_parcel, parcel_path
from vistel.conference.files import load
from vistel.conference.paths import RunPaths
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.formats.parcel import pack, unpack
from vistel.figure.formats.usd import save_usd
from vistel.messages.world.verify import verify
from vistel.render.figures.people import load_avatar_of
from vistel.render.stage.stage import ParticipantInfo, Stage
from vistel.space.people import build_like
from vistel.v1.motion_pb2 import AvatarPart, Participant
from vistel.wire.clock import SystemClock
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.motion.proportions import to_message
from vistel.wire.parcels import digest_of, parts_of
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_cli.log.avatars import with_recorded_avatars
from vistel_services import posture
from vistel_services.deliveries.avatars import Deliveries
from vistel_services.posture.own_avatar import own_avatar

FILE = """
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "ann"
height = 1.75
avatar = "me.usda"
"""


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    """`machine(name)`: from now on the avatar folder is another machine's."""
    long_armed()

    def change(name: str) -> Path:
        folder = tmp_path / name
        monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
        return folder

    return change


def conference_file(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    save_usd(long_armed(), folder / "me.usda")
    path = folder / "conference.toml"
    path.write_text(FILE)
    return path


class Viewer:
    """What a renderer has between the bus and its pictures."""

    def __init__(self, bus: ZenohBus) -> None:
        self.stage = Stage(0)
        self.deliveries = Deliveries(bus, self.stage)
        self._about = bus.subscribe(BY_NAME["participant"])

    async def see(self, done: Callable[[Viewer], bool]) -> ParticipantInfo:
        def seen() -> bool:
            for sample in self._about.take():
                self.stage.receive_participant(sample.message)
            self.deliveries.take()
            return bool(self.stage._people) and done(self)

        await until(seen)
        return next(iter(self.stage._people.values())).about


def here(viewer: Viewer) -> bool:
    return not viewer.stage.awaited


def test_it_reaches_sites_without_the_file_and_late_ones_too(tmp_path: Path, machine: Callable[[str], Path]) -> None:
    machine("owner")
    conference = load(conference_file(tmp_path / "owner"))

    async def run() -> tuple[ParticipantInfo, ParticipantInfo, bytes, bytes]:
        clock = SystemClock()
        router = Router.open()
        names = ("tokyo", "lagos", "oslo")
        buses = [await ZenohBus.open(conference="demo", site=n, clock=clock, endpoints=[router.endpoint]) for n in names]
        config = posture.configure(conference, conference.sites[0], RunPaths(tmp_path / "run", tmp_path / "out"))
        task = asyncio.create_task(posture.run(config, buses[0], clock))
        try:
            early = Viewer(buses[1])
            await early.see(lambda v: True)
            machine("lagos")
            assert kept_parcel(digest_of(pack(long_armed()))) is None
            first = await early.see(here)
            one = early.deliveries.parcel(first.parcel)
            machine("oslo")
            late = Viewer(buses[2])
            second = await late.see(here)
            return first, second, one, late.deliveries.parcel(second.parcel)
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
            for bus in buses:
                await bus.close()
            router.close()

    first, second, one, other = asyncio.run(run())
    assert first == second and one == other == pack(long_armed())
    drawn = load_avatar_of(first, parcel=lambda _: one)
    assert np.array_equal(drawn.mesh.vertices, long_armed().mesh.vertices)
    assert first.proportions == Proportions.of(drawn.skeleton, drawn.body)


def test_a_damaged_one_is_refused_in_one_line_and_nobody_waits_for_it(
    tmp_path: Path, machine: Callable[[str], Path], caplog: pytest.LogCaptureFixture
) -> None:
    machine("other")

    async def run() -> ParticipantInfo:
        clock = SystemClock()
        router = Router.open()
        sender, reader = [
            await ZenohBus.open(conference="demo", site=n, clock=clock, endpoints=[router.endpoint]) for n in ("tokyo", "oslo")
        ]
        viewer = Viewer(reader)
        about = Participant(participant="ann", site="tokyo", avatar="me.usda", height_m=1.7, parcel="ab" * 16)
        sender.publish(BY_NAME["participant"], participant="ann").put(about)
        await viewer.see(lambda v: bool(v.stage.awaited))
        sender.publish(BY_NAME["avatar_part"], digest="ab" * 16, part="0000").put(AvatarPart(parts=1, size=4, data=b"evil"))
        shown = await viewer.see(here)
        with pytest.raises(ValueError, match="did not arrive whole"):
            load_avatar_of(shown, parcel=viewer.deliveries.parcel)
        for bus in (sender, reader):
            await bus.close()
        router.close()
        return shown

    with caplog.at_level(logging.ERROR):
        shown = asyncio.run(run())
    assert shown.here
    assert [r.getMessage() for r in caplog.records if "parcel_refused" in r.getMessage()] == [
        f"event=parcel_refused sender=tokyo digest={'ab' * 16} reason='damaged: its bytes have another digest'"
    ]


@pytest.mark.parametrize(("content", "reason"), [(None, "no file 'me.usda' beside"), ("#usda 1.0\n", "no avatar of VISTEL")])
def test_a_file_that_is_none_is_reported_at_its_own_site(
    tmp_path: Path, machine: Callable[[str], Path], caplog: pytest.LogCaptureFixture, content: str | None, reason: str
) -> None:
    machine("owner")
    path = tmp_path / "conference.toml"
    path.write_text(FILE)
    if content is not None:
        (tmp_path / "me.usda").write_text(content)
    conference = load(path)
    config = posture.configure(conference, conference.sites[0], RunPaths(tmp_path, tmp_path))
    with caplog.at_level(logging.ERROR):
        assert own_avatar(config.people[0]) is None
    assert [reason in r.getMessage() for r in caplog.records] == [True]


def test_what_is_kept_and_was_damaged_on_disk_is_not_used(machine: Callable[[str], Path]) -> None:
    machine("owner")
    data = pack(long_armed())
    digest = digest_of(data)
    assert keep_parcel(digest, data) and kept_parcel(digest) == data
    parcel_path(digest).write_bytes(data[:-1])
    assert kept_parcel(digest) is None


def test_the_world_touches_it_at_its_own_surface_and_a_log_of_it_runs_again(tmp_path: Path) -> None:
    avatar = long_armed()
    limbs = Proportions.of(avatar.skeleton, avatar.body)

    async def record(own: bool) -> WorldSite:
        site = WorldSite(tmp_path / str(own))
        async with site.open():
            if own:
                about = Participant(participant="aiko", site="tokyo", avatar="me.usda", height_m=1.75)
                about.proportions.CopyFrom(to_message(limbs.names, limbs.joint, limbs.arrays))
                site.buses["aiko"].publish(BY_NAME["participant"], participant="aiko").put(about)
            await site.play(2.5, from_s=2.2)
        return site

    standard, own = asyncio.run(record(False)), asyncio.run(record(True))
    report = verify(own.log)
    assert report.difference == "" and report.equal and report.skipped == 0 and report.steps > 60
    said = [p for topic, _, m, _ in own.log if topic == "world_inputs" for p in m.people if p.HasField("proportions")]
    assert [p.participant for p in said] == ["aiko"]
    assert own.keys()[-1].SerializeToString() != standard.keys()[-1].SerializeToString()
    # What her own limbs cannot reach, nothing says she touches.
    body = build_like(limbs).body
    for room in own.rooms():
        for t in room.touches:
            if t.target == "aiko":
                assert max(t.limbs) < len(body)


def test_a_log_brings_the_avatar_to_a_machine_that_never_had_the_file(tmp_path: Path, machine: Callable[[str], Path]) -> None:
    machine("owner")
    conference = load(conference_file(tmp_path / "owner"))
    config = posture.configure(conference, conference.sites[0], RunPaths(tmp_path, tmp_path))
    own = own_avatar(config.people[0])
    assert own is not None
    log = tmp_path / "conference.mcap"
    with LogWriter(log) as writer:
        about = Participant(participant="ann", site="tokyo", avatar="me.usda", height_m=1.75, parcel=own.digest)
        _write(writer, "participant", about, START_NS, participant="ann")
        for k, (name, part) in enumerate(parts_of(own.parcel)):
            _write(writer, "avatar_part", part, START_NS + k, digest=own.digest, part=name)
    machine("elsewhere")
    replayed = with_recorded_avatars(conference, LogReader(log))
    assert Path(replayed.sites[0].participants[0].avatar).read_bytes() == own.parcel
    again = own_avatar(posture.configure(replayed, replayed.sites[0], RunPaths(tmp_path, tmp_path)).people[0])
    assert again == own
    assert unpack(own.parcel, "it").skeleton.height == pytest.approx(long_armed().skeleton.height)


def _write(writer: LogWriter, topic: str, message: object, log_ns: int, **names: str) -> None:
    key = BY_NAME[topic].format(conference="demo", site="tokyo", **names)
    message.header.version, message.header.t_ns = 1, log_ns  # type: ignore[attr-defined]
    writer.write(BY_NAME[topic], key, message, log_ns)  # type: ignore[arg-type]
