"""The renderer on a real bus: people and a world are published, a video comes out."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path

import av
import numpy as np
import pytest
from waiting import until

from vistel.render.config import RenderConfig
from vistel.render.scene_renderer import View
from vistel.space.room import meeting_room, seat_pose
from vistel.v1 import motion_pb2, world_pb2
from vistel.wire.clock import SystemClock
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_services.renderer import Config, run
from vistel_services.renderer.out.outputs import Out

pytestmark = pytest.mark.gl


def seated(seat: int, turn: float) -> tuple[np.ndarray, np.ndarray]:
    """Body and stance of somebody in a chair, head turned."""
    position, heading = seat_pose(3, seat)
    body = np.zeros(25)
    body[1] = math.pi / 2
    body[8:11] = (0.1, turn, 0.0)
    body[11:14], body[18:21] = (0.0, 0.0, -1.2), (0.0, 0.0, 1.2)
    feet = position + 0.42 * np.array((math.sin(heading), 0.0, math.cos(heading)))
    return body, np.append(feet, heading)


def room_message(step: int, t_ns: int) -> world_pb2.WorldState:
    state = world_pb2.WorldState(step=step, key=True)
    state.header.t_ns = t_ns
    for thing in meeting_room(3).things:
        message = state.things.add(id=thing.id, name=thing.name, mass_kg=thing.mass, colour=thing.colour, shape=thing.shape)
        for p in thing.primitives:
            part = message.primitives.add(kind=p.kind, params=p.params)
            part.pose.position.x, part.pose.position.y, part.pose.position.z = p.position
            part.pose.rotation.x, part.pose.rotation.y, part.pose.rotation.z, part.pose.rotation.w = p.rotation
        now = state.states.add(id=thing.id)
        now.pose.position.x, now.pose.position.y, now.pose.position.z = thing.position
        now.pose.rotation.x, now.pose.rotation.y, now.pose.rotation.z, now.pose.rotation.w = thing.rotation
    return state


async def publish(bus: ZenohBus, clock: SystemClock, names: list[str]) -> None:
    """Sixty motions a second of each, and the room."""
    people = [(bus.publish(BY_NAME["motion"], participant=n), MotionEncoder()) for n in names]
    for n in names:
        about = motion_pb2.Participant(
            participant=n, site="tokyo", display_name=n.title(), avatar="builtin:no-such-setting=1", height_m=1.7
        )
        bus.publish(BY_NAME["participant"], participant=n).put(about)
    room = bus.publish(BY_NAME["world_state"])
    for k in range(1, 100_000):
        now = clock.now_ns()
        for seat, (publication, encoder) in enumerate(people):
            body, stance = seated(seat, 0.4 * math.sin(k / 40))
            publication.put(encoder.encode(MotionSample(k, now, body, np.full((2, 20), 0.2), stance)))
        room.put(room_message(k, now))
        await asyncio.sleep(1 / 60)  # as trackers do, in real time


async def conference(tmp_path: Path) -> tuple[list, Path]:
    clock = SystemClock()
    router = Router.open()
    sender = await ZenohBus.open(conference="test", site="tokyo", clock=clock, endpoints=[router.endpoint])
    receiver = await ZenohBus.open(conference="test", site="tokyo", clock=clock, endpoints=[router.endpoint])
    hub = await ZenohBus.open(conference="test", site="hub", clock=clock, endpoints=[router.endpoint])
    delays = hub.subscribe(BY_NAME["image_delay"], queue_all=True)
    video = tmp_path / "tokyo.mp4"
    config = Config("tokyo", RenderConfig(View(320, 180, "seat", "ada"), 3, 0.1), 15.0, Out(video))
    tasks = [
        asyncio.create_task(publish(sender, clock, ["ada", "grace", "linus"])),
        asyncio.create_task(run(config, receiver, clock)),
    ]
    reports: list = []

    def enough() -> bool:
        reports.extend(s.message for s in delays.take() if len(s.message.streams) == 3)
        return len(reports) >= 4

    await until(enough, "four reports of three people's image delay", tasks=tasks)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    for bus in (sender, receiver, hub):
        await bus.close()
    router.close()
    return reports, video


def test_people_on_the_bus_become_a_video_and_a_report_of_its_delay(tmp_path: Path) -> None:
    reports, video = asyncio.run(conference(tmp_path))
    newest = reports[-1]
    assert {s.participant for s in newest.streams} == {"ada", "grace", "linus"}
    for stream in newest.streams:
        assert 0.0 <= stream.age_s <= stream.delay_s
        assert 0.0 < stream.playout_s < stream.delay_s  # playout holds it back, and drawing
    # A second may begin and end with a picture, and each may be late and followed by the next up to a quarter period early.
    assert 0.0 < newest.frames_per_s <= 15.0 / 0.75 + 1.0
    with av.open(str(video)) as container:
        frames = [f.to_ndarray(format="rgb24") for f in container.decode(video=0)]
    assert len(frames) >= newest.frames * 0.5
    assert frames[-1].shape == (180, 320, 3)
    assert frames[-1].mean() > 40
    assert frames[-1].std() > 20
