"""The recorder on a bus: everything recorded is in the log, whatever happens to the disk or the messages."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from waiting import until

from vistel.conference.files import DEMO_FILE, load
from vistel.conference.paths import RunPaths
from vistel.v1 import command_pb2, motion_pb2, world_pb2
from vistel.v1.service_pb2 import Heartbeat
from vistel.wire.clock import SystemClock
from vistel.wire.log import LogReader
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_services.recorder import Config, configure, run
from vistel_services.recorder.service import free_path


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
