"""Bytes that a person sends in a second, by topic; and what the motion codec does to the joints.

Bytes are counted on the TCP connection from a site to its router, Zenoh's framing and keep-alives included, while the bus publishes
at the topic's nominal rate. The peer of Motion is the same posture as plain 32-bit floats. Joint errors are those of all joints'
orientations in the room after forward kinematics, so that they add up along each limb.
"""

import asyncio
import contextlib
import struct
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.row import Row, at_most
from vistel.conference.model import Conference
from vistel.figure.posture.posture import Posture, Stance, pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.v1.device_pb2 import DeviceStatus, GloveFrame, TrackerFrame
from vistel.v1.motion_pb2 import Participant
from vistel.v1.service_pb2 import ClockOffset, Heartbeat, ImageDelay
from vistel.wire.clock import SystemClock
from vistel.wire.motion import MotionDecoder, MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_sim.motion import open_motion

RATE_HZ = 60
SECONDS = 20
COUNTED_S = 3.0
BODY_NOISE, HAND_NOISE = np.radians(0.05), np.radians(0.3)
"""What is left of the sensors' noise after filtering, standard deviation per angle."""
DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "body" / "cmu"
FLOATS = "69 float32 and 16 bytes of header at 60 Hz"


def run() -> Iterator[Row]:
    for name, samples in motions():
        rate, errors, distances = _through_the_codec(samples)
        plain = (69 * 4 + 16) * 8 * RATE_HZ / 1000
        yield Row("wire", name, "motion payload", "kbit/s", rate, FLOATS, plain, target=at_most(64))
        p99 = float(np.percentile(errors, 99))
        yield Row("wire", name, "joint error p99", "deg", p99, target=at_most(0.3))
        yield Row("wire", name, "joint error max", "deg", float(errors.max()))
        p99 = float(np.percentile(distances, 99)) * 1000
        yield Row("wire", name, "joint position error p99", "mm", p99)
    for topic, per_s in asyncio.run(_count_topics()):
        limit = at_most(8000) if topic == "motion" else None
        case, metric = f"topic {topic}", "link bytes per participant"
        yield Row("wire", case, metric, "B/s", per_s, target=limit)


def motions() -> Iterator[tuple[str, list[MotionSample]]]:
    """What people do: the built-in meeting, recorded people where the recordings are, and unkind arm-waving."""
    yield "meeting", _samples(None)
    for path in sorted(DATA.glob("*.bvh")):
        yield f"cmu {path.stem}", _samples(str(path))
    yield "all joints swing", list(_swinging())


def _samples(motion: str | None) -> list[MotionSample]:
    person = {"name": "ann"} | ({"motion": motion} if motion else {})
    conference = Conference.model_validate({"sites": [{"name": "tokyo", "participants": [person]}]})
    source = open_motion(conference)
    rng = np.random.default_rng(1)
    out: list[MotionSample] = []
    for i in range(SECONDS * RATE_HZ):
        posture = source.posture("ann", i / RATE_HZ)
        body = posture.dofs + rng.normal(0.0, BODY_NOISE, 25) * _IS_ANGLE
        hands = posture.hands + rng.normal(0.0, HAND_NOISE, (2, 20))
        stance = np.append(posture.stance.position, posture.stance.heading)
        out.append(MotionSample(i + 1, i * 1_000_000_000 // RATE_HZ, body, hands, stance))
    return out


_IS_ANGLE = np.ones(25)
_IS_ANGLE[5:8] = 0.002  # the spine's shift is in metres


def _swinging() -> Iterator[MotionSample]:
    """Every angle on its own three sines, up to 2 Hz: more than a person does."""
    rng = np.random.default_rng(2)
    phase = rng.uniform(0, 2 * np.pi, (69, 3))
    size = rng.exponential(1.0, (69, 3)) * (0.35, 0.15, 0.05)
    for i in range(SECONDS * RATE_HZ):
        t = i / RATE_HZ
        x = np.clip((size * np.sin(2 * np.pi * np.array([0.15, 0.6, 2.0]) * t + phase)).sum(1), -1.7, 1.7)
        body = x[:25].copy()
        body[5:8] *= 0.05
        yield MotionSample(i + 1, i * 1_000_000_000 // RATE_HZ, body, x[25:65].reshape(2, 20), x[65:])


def _through_the_codec(samples: list[MotionSample]) -> tuple[float, Any, Any]:
    """Payload [kbit/s], errors of joint orientations [deg] and positions [m] of every joint in every frame."""
    encoder, decoder, skeleton = MotionEncoder(), MotionDecoder(), standard_skeleton(1.75)
    size = 0
    errors: list[Any] = []
    distances: list[Any] = []
    for sample in samples:
        message = encoder.encode(sample)
        message.header.version = 1
        size += len(message.SerializeToString())
        back = decoder.decode(message)
        assert back is not None
        a, b = pose_joints(skeleton, _posture(sample)), pose_joints(skeleton, _posture(back))
        chord = np.linalg.norm(a.rotation - b.rotation, axis=(1, 2)) / (2 * np.sqrt(2))
        errors.append(np.degrees(2 * np.arcsin(np.minimum(1.0, chord))))
        distances.append(np.linalg.norm(a.position - b.position, axis=1))
    return size / len(samples) * RATE_HZ * 8 / 1000, np.array(errors), np.array(distances)


def _posture(s: MotionSample) -> Posture:
    return Posture(s.body, s.hands, Stance(s.stance[:3], float(s.stance[3])))


async def _count_topics() -> list[tuple[str, float]]:
    samples = _samples(None)
    encoder = MotionEncoder()
    messages: dict[str, tuple[dict[str, str], Callable[[int], Any], int]] = {
        "motion": ({"participant": "ann"}, lambda i: encoder.encode(samples[i % len(samples)]), 1),
        "tracker": ({"device": "ann-tracker"}, _tracker_frame, 1),
        "glove": ({"device": "ann-glove-left"}, _glove_frame, 2),
        "device_status": (
            {"device": "ann-tracker"},
            lambda i: DeviceStatus(
                device="ann-tracker", state=DeviceStatus.STATE_STREAMING, rate_hz=120, frames=i, detail="FASTRAK, 4 stations"
            ),
            3,
        ),
        "participant": (
            {"participant": "ann"},
            lambda i: Participant(participant="ann", site="tokyo", display_name="Ann", avatar="builtin", height_m=1.75),
            1,
        ),
        "heartbeat": (
            {"node": "capture"},
            lambda i: Heartbeat(
                node="tokyo/capture", services=["tracker", "glove", "posture"], uptime_ns=i, pid=1234, metrics_port=9100
            ),
            2,
        ),
        "clock_offset": (
            {"node": "capture"},
            lambda i: ClockOffset(node="tokyo/capture", offset_ns=-12_345_678, uncertainty_ns=234_567),
            2,
        ),
        "image_delay": (
            {},
            lambda i: ImageDelay(
                site="tokyo",
                frames_per_s=30,
                frame_time_s=0.01,
                frames=i,
                streams=[ImageDelay.Stream(participant=p, delay_s=0.1, age_s=0.02, jitter_s=0.002) for p in ("ann", "ben")],
            ),
            1,
        ),
    }
    idle = await _link_bytes(None, {}, lambda i: None, 0.0)
    out: list[tuple[str, float]] = [("idle connection", idle)]
    for name, (names, make, copies) in messages.items():
        rate = BY_NAME[name].rate_hz or 0.0
        out.append((name, copies * (await _link_bytes(name, names, make, rate) - idle)))
    return out


async def _link_bytes(name: str | None, names: dict[str, str], make: Callable[[int], Any], rate_hz: float) -> float:
    """Bytes per second from a site to its router while it publishes one topic."""
    router = Router.open()
    clock = SystemClock()
    async with _counted(router.endpoint) as (endpoint, count):
        bus = await ZenohBus.open(conference="demo", site="tokyo", clock=clock, endpoints=[endpoint])
        reader = await ZenohBus.open(conference="demo", site="hub", clock=clock, endpoints=[router.endpoint])
        if name is not None:
            reader.subscribe(BY_NAME[name])
        publication = bus.publish(BY_NAME[name], **names) if name is not None else None
        if publication is not None:
            first = make(0)
            first.header.t_ns = clock.now_ns()
            publication.put(first)
        await asyncio.sleep(0.5)
        before, start_ns, i = count[0], clock.now_ns(), 1
        while clock.now_ns() - start_ns < COUNTED_S * 1e9:
            if publication is not None and rate_hz:
                message = make(i)
                message.header.t_ns = clock.now_ns()
                publication.put(message)
                i += 1
                await clock.sleep_until_ns(start_ns + int(i / rate_hz * 1e9))
            else:
                await asyncio.sleep(0.1)
        per_s = (count[0] - before) / ((clock.now_ns() - start_ns) * 1e-9)
        await bus.close()
        await reader.close()
    router.close()
    return per_s


@contextlib.asynccontextmanager
async def _counted(endpoint: str) -> AsyncIterator[tuple[str, list[int]]]:
    """A TCP relay in front of a router, and the bytes that went towards it."""
    host, port = endpoint.removeprefix("tcp/").rsplit(":", 1)
    count = [0]

    async def copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, counted: bool) -> None:
        while data := await reader.read(65536):
            count[0] += len(data) if counted else 0
            writer.write(data)
            await writer.drain()
        writer.close()

    async def relay(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        inner_reader, inner_writer = await asyncio.open_connection(host, int(port))
        with contextlib.suppress(ConnectionError, asyncio.CancelledError):
            await asyncio.gather(copy(reader, inner_writer, True), copy(inner_reader, writer, False))

    server = await asyncio.start_server(relay, "127.0.0.1", 0)
    yield f"tcp/127.0.0.1:{server.sockets[0].getsockname()[1]}", count
    server.close()


def _tracker_frame(i: int) -> TrackerFrame:
    message = TrackerFrame(device="ann-tracker")
    receiver = message.receivers.add(station=i % 4 + 1, health=1, t_ns=SystemClock().now_ns())
    receiver.position.x, receiver.position.y, receiver.position.z = 0.4, 0.1, -0.3
    q = receiver.rotation
    q.x, q.y, q.z, q.w = 0.1, 0.2, 0.3, 0.9
    return message


def _glove_frame(i: int) -> GloveFrame:
    angles = np.frombuffer(struct.pack("<20f", *np.sin(np.arange(20) + i)), np.float32)
    return GloveFrame(device="ann-glove-left", raw=bytes(range(100, 118)), angles=angles.tolist())
