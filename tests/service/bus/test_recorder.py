"""The recorder on a bus: everything recorded is in the log, whatever happens to the disk or the messages."""

from __future__ import annotations

import asyncio
import random
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from waiting import until

from vistel.conference.console import ConsoleConfig
from vistel.conference.files import DEMO_FILE, load
from vistel.conference.model import Conference, Recording
from vistel.conference.paths import RunPaths, free_path
from vistel.v1 import command_pb2, device_pb2, motion_pb2, world_pb2
from vistel.v1.service_pb2 import Heartbeat
from vistel.wire.clock import SimulatedClock, SystemClock
from vistel.wire.log import LogReader
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_services.recorder import Config, configure, run


async def record(config: Config, messages: int = 50) -> None:
    clock = SystemClock()
    router = Router.open()
    sender = await ZenohBus.open(conference="test", site="tokyo", clock=clock, endpoints=[router.endpoint])
    receiver = await ZenohBus.open(conference="test", site="hub", clock=clock, endpoints=[router.endpoint])
    recorder = asyncio.create_task(run(config, receiver, clock))
    await asyncio.sleep(0)  # it subscribes
    last = receiver.subscribe(BY_NAME["heartbeat"], node="probe")  # behind those of the recorder
    probe = sender.publish(BY_NAME["heartbeat"], node="probe")
    while not last.take():
        probe.put(Heartbeat())
        await asyncio.sleep(0.01)  # what is put before a subscription has come to the sender is lost
    motion = sender.publish(BY_NAME["motion"], participant="ada")
    world = sender.publish(BY_NAME["world_state"])
    command = sender.publish(BY_NAME["command"], participant="ada")
    for k in range(messages):
        for publication, message in (
            (motion, motion_pb2.Motion(key_seq=k + 1, body=[k])),
            (world, world_pb2.WorldState(step=k)),
            (command, command_pb2.Command(id=str(k), participant="ada")),
        ):
            message.header.t_ns = clock.now_ns()
            publication.put(message)
        await asyncio.sleep(0.005)  # the bus of this process sends
    await until(lambda: recorder.done() or not config.path.parent.is_dir() or count(config.path) >= 3 * messages)
    if recorder.done():
        recorder.result()
    recorder.cancel()
    await asyncio.gather(recorder, return_exceptions=True)
    for bus in (sender, receiver):
        await bus.close()
    router.close()


def count(path: Path) -> int:
    """Messages that are on disk now, while the log is still being written."""
    if not path.exists() or path.stat().st_size <= 100:
        return 0
    return sum(r.topic.name != "heartbeat" for r in LogReader(path).records())


def test_what_crosses_the_bus_is_in_the_log_in_order_with_the_conference_file(tmp_path: Path) -> None:
    conference = load(DEMO_FILE)
    config = configure(conference, None, RunPaths(tmp_path / "run", tmp_path / "out"))
    asyncio.run(record(config))
    reader = LogReader(tmp_path / "out" / "conference.mcap")
    assert reader.damage == []
    assert reader.conference is not None
    assert reader.conference["name"] == conference.name
    records = list(reader.records())
    by_topic = {name: [r for r in records if r.topic.name == name] for name in ("motion", "world_state", "command")}
    assert [r.message.body[0] if r.message.body else 0 for r in by_topic["motion"]] == list(range(50))
    assert [r.message.step for r in by_topic["world_state"]] == list(range(50))
    assert [r.message.id for r in by_topic["command"]] == [str(k) for k in range(50)]
    assert by_topic["motion"][0].names == {"conference": "test", "site": "tokyo", "participant": "ada"}
    times = [r.log_ns for r in records]
    assert times == sorted(times)


def test_no_token_of_a_page_is_in_a_log(tmp_path: Path) -> None:
    secret = "a-token-of-sixteen-letters"
    demo = load(DEMO_FILE)
    first, *others = demo.sites
    shown = first.display.model_copy(update={"stream": "0.0.0.0:8081", "stream_token": secret})
    console = ConsoleConfig(at="0.0.0.0:8440", token=secret)
    sites = [first.model_copy(update={"display": shown}), *others]
    conference = Conference.model_validate(demo.model_copy(update={"sites": sites, "console": console}).model_dump())
    text = configure(conference, None, RunPaths(tmp_path, tmp_path)).conference
    assert text is not None and secret not in text
    assert Conference.model_validate(tomllib.loads(text)).sites[0].participants == first.participants


def test_a_folder_that_cannot_be_written_is_reported_and_the_recorder_lives(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "out").write_text("a file where the folder should be")
    asyncio.run(record(Config(tmp_path / "out" / "conference.mcap"), messages=3))
    assert any("log_failed" in r.message and "retry" in r.message for r in caplog.records)


def test_a_log_that_is_there_already_is_kept(tmp_path: Path) -> None:
    first = tmp_path / "conference.mcap"
    assert free_path(first) == first
    first.touch()
    assert free_path(first) == tmp_path / "conference.2.mcap"
    free_path(first).touch()
    assert free_path(first) == tmp_path / "conference.3.mcap"


def test_every_recorded_topic_is_subscribed() -> None:
    subscribed: list[str] = []

    class Quiet:
        def subscribe(self, topic, *, queue_all=False, polled=False, **names):
            assert queue_all
            subscribed.append(topic.name)
            return self

        def take(self) -> list:
            return []

        def close(self) -> None: ...

    async def main() -> None:
        task = asyncio.create_task(run(Config(Path("/nonexistent/x.mcap")), Quiet(), SystemClock()))  # type: ignore[arg-type]
        await asyncio.sleep(0)  # it subscribes
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(main())
    assert {"motion", "world_state", "world_inputs", "command", "device_raw", "participant"} <= set(subscribed)
    assert not {"clock", "world_snapshot"} & set(subscribed)


@contextmanager
def small_disk(place: Path, megabytes: int) -> Iterator[Path]:
    """A real file system of that size."""
    place.mkdir()
    mount = shutil.which("mount")
    command = [mount or "mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(place)]
    done = mount and subprocess.run(command, capture_output=True, check=False)
    if not done or done.returncode:
        pytest.skip("mounting a file system is not allowed here")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=False)


class Meeting:
    """A recorder on a bus in memory, in simulated time. Somebody has said who they are; 10 kB of a device's bytes follow, ten times
    a second."""

    def __init__(self, config: Config) -> None:
        self.clock = SimulatedClock(1_700_000_000_000_000_000)
        network = MemoryNetwork()
        self._hub, self._site = network.bus("demo", "hub", self.clock), network.bus("demo", "tokyo", self.clock)
        self._recorder = asyncio.create_task(run(config, self._hub, self.clock))
        about = self._site.publish(BY_NAME["participant"], participant="aiko")
        about.put(motion_pb2.Participant(participant="aiko", site="tokyo"))
        self._say = self._site.publish(BY_NAME["device_raw"], device="aiko-tracker")
        self._random = random.Random(1)
        self.said = 0

    async def pass_by(self, seconds: int) -> None:
        for _ in range(seconds * 10):
            self.said += 1
            message = device_pb2.RawBytes(data=self._random.randbytes(10_000))
            message.header.t_ns = self.clock.now_ns()
            self._say.put(message)
            await self.clock.advance_to_ns(self.clock.now_ns() + 100_000_000)

    async def end(self) -> None:
        self._recorder.cancel()
        await asyncio.gather(self._recorder, return_exceptions=True)


def said_in(path: Path) -> list[int]:
    return [r.message.header.seq for r in LogReader(path).records(topics=("device_raw",))]


@pytest.mark.parametrize("limits", [Recording(minutes=0.1), Recording(megabytes=0.4)], ids=["time", "size"])
def test_files_that_are_long_or_large_enough_are_followed_by_others_that_lack_nothing_and_tell_who_is_there(
    tmp_path: Path, limits: Recording
) -> None:
    async def play() -> Meeting:
        meeting = Meeting(Config(tmp_path / "conference.mcap", limits=limits))
        await meeting.pass_by(20)
        await meeting.end()
        return meeting

    meeting = asyncio.run(play())
    files = [tmp_path / f"conference{'' if n == 1 else f'.{n}'}.mcap" for n in range(1, len(list(tmp_path.iterdir())) + 1)]
    assert len(files) >= 3
    assert [n for path in files for n in said_in(path)] == list(range(1, meeting.said + 1))
    for path in files:
        assert LogReader(path).damage == []
        assert [r.message.site for r in LogReader(path).records(topics=("participant",))] == ["tokyo"]


def test_with_a_quota_the_oldest_files_of_the_run_go_and_no_earlier_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    earlier = tmp_path / "conference.mcap"
    earlier.write_bytes(bytes(900_000))

    async def play() -> Meeting:
        meeting = Meeting(Config(earlier, limits=Recording(megabytes=0.3, quota=1.0)))
        await meeting.pass_by(30)
        await meeting.end()
        return meeting

    meeting = asyncio.run(play())
    assert earlier.stat().st_size == 900_000
    left = [p for p in tmp_path.iterdir() if p != earlier]
    assert len(left) >= 2 and sum(p.stat().st_size for p in left) < 1.5e6
    kept = sorted(n for p in left for n in said_in(p))
    assert kept == list(range(kept[0], meeting.said + 1)) and kept[0] > 1
    assert [r for r in caplog.records if "event=log_removed" in r.getMessage()]


def test_recording_pauses_before_the_disk_is_full_leaves_the_rest_to_the_room_and_goes_on_when_there_is_space(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with small_disk(tmp_path / "disk", 8) as disk:
        ballast = disk / "ballast"
        ballast.write_bytes(bytes(3_000_000))

        async def play() -> Meeting:
            meeting = Meeting(Config(disk / "conference.mcap", limits=Recording(keep_free=2.0)))
            await meeting.pass_by(60)
            assert shutil.disk_usage(disk).free > 1.7e6
            ballast.unlink()
            await meeting.pass_by(10)
            await meeting.end()
            return meeting

        meeting = asyncio.run(play())
        told = [r.getMessage() for r in caplog.records if "event=recording_" in r.getMessage()]
        assert len(told) == 2 and "recording_paused" in told[0] and "left to the room" in told[0] and "recording_resumed" in told[1]
        first, second = sorted(disk.glob("*.mcap"), key=lambda p: p.stat().st_mtime_ns)
        assert LogReader(first).damage == LogReader(second).damage == []
        assert said_in(first)[0] == 1 and said_in(second)[-1] == meeting.said


def test_a_full_disk_costs_messages_and_neither_the_recorder_nor_what_was_written(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with small_disk(tmp_path / "disk", 2) as disk:

        async def play() -> Meeting:
            meeting = Meeting(Config(disk / "conference.mcap", limits=Recording(keep_free=0.0)))
            await meeting.pass_by(40)
            await meeting.end()
            return meeting

        asyncio.run(play())
        assert [r for r in caplog.records if "event=log_failed" in r.getMessage() and "No space left" in r.getMessage()]
        assert [p.name for p in disk.iterdir()] == ["conference.mcap"], "no litter of empty files"
        found = said_in(disk / "conference.mcap")
        assert len(found) > 20 and found == list(range(1, len(found) + 1))
