"""The messages of a ROS 2 bag, checked: transforms, sounds and pictures, each with its time.

A bag says itself how its messages are laid out, in a language of which rosbags makes Python code. No code is made of what a file
says: messages are read by the definitions of ROS 2 and those below, and one that does not fit them is refused.
"""

from __future__ import annotations

import json
import math
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import IO, Any

import numpy as np

from vistel.log.sensors import SensorError

METADATA = "metadata.yaml"
STORED = (".db3", ".mcap")
MOST_BAG_BYTES = 16 << 30
"""Of all files of a bag."""
MOST_TRANSFORMS = 4_000_000
"""An hour of ten frames at 100 Hz."""
MOST_MESSAGE_BYTES = 64 << 20
"""A picture of 16 million pixels of four bytes."""
MOST_SOUND_BYTES = 1 << 30
"""Two hours of stereo at 48 kHz, 16 bits."""
SAME_CLOCK_S = 1.0
"""Times of arrival that are later than the stamps by more are of another clock, as of a simulation [s]."""
TRANSFORMS = "tf2_msgs/msg/TFMessage"
SOUND = "audio_common_msgs/msg/AudioData"
STAMPED_SOUND = "audio_common_msgs/msg/AudioDataStamped"
SOUND_INFO = "audio_common_msgs/msg/AudioInfo"
PICTURE_FILE = "sensor_msgs/msg/CompressedImage"
PICTURE = "sensor_msgs/msg/Image"
_LAYOUTS = {
    SOUND: "uint8[] data",
    STAMPED_SOUND: "std_msgs/Header header\naudio_common_msgs/AudioData audio",
    SOUND_INFO: "uint8 channels\nuint32 sample_rate\nstring sample_format\nuint32 bitrate\nstring coding_format",
}
"""Of the messages of audio_common, which are not ROS 2's own."""
_READER = Path(__file__).with_name("bag_reader.py")
_HEAD = struct.Struct("<HqI")


@dataclass
class Transforms:
    """Where `child` is in `parent`, in the order of arrival. fixed: at all times (tf_static). t: of the stamps [s]; p: (x, y, z) in
    the bag's unit; q: (x, y, z, w) of length 1."""

    parent: str
    child: str
    fixed: bool
    t: list[float] = field(default_factory=list[float])
    p: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])
    q: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])


@dataclass
class Sound:
    """A topic of sound. messages: time [s] and bytes. channels, rate [Hz], sample_format, coding: as its AudioInfo says; 0 and ""
    where it has none."""

    topic: str
    messages: list[tuple[float, bytes]] = field(default_factory=list[tuple[float, bytes]])
    channels: int = 0
    rate: int = 0
    sample_format: str = ""
    coding: str = ""


@dataclass(frozen=True)
class BagPicture:
    """A picture: a file such as JPEG, or, with `encoding`, how ROS calls the way pixels are stored, in rows of `step` bytes."""

    data: bytes
    encoding: str = ""
    width: int = 0
    height: int = 0
    step: int = 0


@dataclass(frozen=True)
class Bag:
    """All but the pictures, which are read when they are wanted. picture_topics: by name. shift_s: to be added to a time of arrival
    to have one of the stamps' clock."""

    path: Path
    transforms: Sequence[Transforms]
    sounds: Sequence[Sound]
    picture_topics: Sequence[str]
    shift_s: float


def is_bag(path: Path) -> bool:
    """Whether a folder is as `ros2 bag record` leaves it, also when that was killed."""
    return path.is_dir() and ((path / METADATA).exists() or bool(_stored(path)))


def read_bag(path: Path) -> Bag:
    """The transforms and sounds of a bag. Raises SensorError."""
    gathered = _Gathered(path)
    topics: dict[str, str] = {}
    for topic, kind, arrived_s, data in _messages(path, (TRANSFORMS, SOUND, STAMPED_SOUND, SOUND_INFO), topics):
        gathered.take(topic, kind, arrived_s, _read(path, topic, kind, data))
    if not gathered.transforms:
        has = ", ".join(f"{t} ({k})" for t, k in sorted(topics.items())[:5]) + (", ..." if len(topics) > 5 else "")
        raise SensorError(
            f"{path}: no transforms are in it; expected a topic of type {TRANSFORMS}, such as /tf; it has {has or 'nothing'}"
        )
    return gathered.bag([t for t, kind in topics.items() if kind in (PICTURE, PICTURE_FILE)])


def pictures(bag: Bag, topic: str) -> Iterator[tuple[float, BagPicture]]:
    """Times [s, of the stamps] and pictures of a topic, in the order of arrival. Raises SensorError."""
    for found, kind, arrived_s, data in _messages(bag.path, (PICTURE, PICTURE_FILE), {}):
        if found == topic:
            message = _read(bag.path, topic, kind, data)
            t, held = _stamp(message.header) or arrived_s + bag.shift_s, bytes(message.data)
            if kind == PICTURE_FILE:
                yield t, BagPicture(held)
            else:
                yield t, BagPicture(held, str(message.encoding), int(message.width), int(message.height), int(message.step))


class _Gathered:
    """What was read so far."""

    def __init__(self, path: Path) -> None:
        self.transforms: dict[tuple[str, str, bool], Transforms] = {}
        self._path = path
        self._sounds: dict[str, Sound] = {}
        self._arrived: set[str] = set()
        self._late: list[float] = []
        self._count, self._bytes = 0, 0

    def take(self, topic: str, kind: str, arrived_s: float, message: Any) -> None:
        if kind == TRANSFORMS:
            self._transforms(topic.endswith("tf_static"), arrived_s, message)
            return
        sound = self._sounds.setdefault(topic.rpartition("/")[0], Sound(topic))  # /audio/audio and /audio/audio_info
        if kind == SOUND_INFO:
            sound.channels, sound.rate = int(message.channels), int(message.sample_rate)
            sound.sample_format, sound.coding = str(message.sample_format), str(message.coding_format)
        elif not sound.messages or sound.topic == topic:  # else the same sound once more, with stamps or without
            sound.topic = topic
            stamp = _stamp(message.header) if kind == STAMPED_SOUND else 0.0
            if not stamp:
                self._arrived.add(topic)
            data = bytes(message.audio.data if kind == STAMPED_SOUND else message.data)
            sound.messages.append((stamp or arrived_s, data))
            self._bytes += len(data)
            if self._bytes > MOST_SOUND_BYTES:
                raise SensorError(f"{self._path}: {topic}: has more than {MOST_SOUND_BYTES >> 20} MB of sound")

    def _transforms(self, fixed: bool, arrived_s: float, message: Any) -> None:
        for one in message.transforms:
            parent, child = (str(name).lstrip("/")[:100] for name in (one.header.frame_id, one.child_frame_id))
            where, turn = one.transform.translation, one.transform.rotation
            p: tuple[float, ...] = (where.x, where.y, where.z)
            q: tuple[float, ...] = (turn.x, turn.y, turn.z, turn.w)
            said = f"{self._path}: the transform from {parent} to {child}"
            if not all(map(math.isfinite, (*p, *q))) or max(abs(n) for n in p) > 1e19:
                raise SensorError(f"{said}: expected finite numbers, got {p} and {q}")
            length = math.hypot(*q)
            if not 0.9 < length < 1.1:
                raise SensorError(f"{said}: expected a unit quaternion, got {q}")
            found = self.transforms.setdefault((parent, child, fixed), Transforms(parent, child, fixed))
            stamp = _stamp(one.header)
            found.t.append(stamp)
            found.p.append(p)
            found.q.append(tuple(n / length for n in q))
            self._count += 1
            if not fixed:
                self._late.append(arrived_s - stamp)
        if self._count > MOST_TRANSFORMS:
            raise SensorError(f"{self._path}: has more than {MOST_TRANSFORMS} transforms")

    def bag(self, picture_topics: list[str]) -> Bag:
        late = float(np.median(self._late)) if self._late else 0.0
        shift_s = -late if abs(late) > SAME_CLOCK_S else 0.0
        for sound in self._sounds.values():
            if sound.topic in self._arrived:
                sound.messages = [(t + shift_s, data) for t, data in sound.messages]
        heard = [sound for sound in self._sounds.values() if sound.messages]
        return Bag(self._path, list(self.transforms.values()), heard, picture_topics, shift_s)


def _stamp(header: Any) -> float:
    return header.stamp.sec + header.stamp.nanosec * 1e-9


@cache
def _layouts() -> Any:
    """How messages are laid out. Raises SensorError where rosbags is not installed."""
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError as e:
        raise SensorError("a bag of ROS 2 needs rosbags: pip install 'vistel[ros]'") from e
    store: Any = get_typestore(Stores.ROS2_HUMBLE)
    store.register({name: how for kind, text in _LAYOUTS.items() for name, how in get_types_from_msg(text, kind).items()})
    return store


def _read(path: Path, topic: str, kind: str, data: bytes) -> Any:
    try:
        return _layouts().deserialize_cdr(data, kind)
    except SensorError:
        raise
    except Exception as e:  # of a message that says of itself how long its parts are, anything
        raise SensorError(f"{path}: {topic}: a message is no {kind}: it is cut off or damaged") from e


def _stored(path: Path) -> list[Path]:
    return sorted(f for f in path.iterdir() if f.suffix in STORED)


def _messages(path: Path, kinds: Sequence[str], topics: dict[str, str]) -> Iterator[tuple[str, str, float, bytes]]:
    """Topic, type, time of arrival [s] and bytes of messages of some types. topics: gets the type of each. Raises SensorError."""
    _check(path)
    with tempfile.TemporaryFile() as complaints:
        command = [sys.executable, "-P", str(_READER), str(path), *kinds]
        reader = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=complaints)
        assert reader.stdout is not None
        try:
            yield from _of_stream(path, reader.stdout, topics)
        finally:
            reader.stdout.close()
            code = reader.wait()
        if code:
            complaints.seek(0)
            lines = complaints.read(10_000).decode("utf-8", "replace").strip().splitlines()
            raise SensorError(f"{path}: {lines[-1][:300] if lines and code == 1 else 'it is cut off or damaged'}")


def _of_stream(path: Path, stream: IO[bytes], topics: dict[str, str]) -> Iterator[tuple[str, str, float, bytes]]:
    first = stream.readline()
    if not first:
        return
    listed: list[tuple[str, str]] = [(str(topic), str(kind)) for topic, kind in json.loads(first)]
    topics.update(listed)
    while len(head := stream.read(_HEAD.size)) == _HEAD.size:
        number, t_ns, length = _HEAD.unpack(head)
        if length > MOST_MESSAGE_BYTES:
            raise SensorError(
                f"{path}: {listed[number][0]}: a message has {length >> 20} MB, expected at most {MOST_MESSAGE_BYTES >> 20}"
            )
        yield *listed[number], t_ns * 1e-9, stream.read(length)


def _check(path: Path) -> None:
    """Raises SensorError for what is seen without opening the bag."""
    _layouts()
    if not (path / METADATA).exists():
        raise SensorError(f"{path}: {METADATA} is missing, as when the recorder was killed; make it anew: ros2 bag reindex {path}")
    size = sum(f.stat().st_size for f in _stored(path))
    if size > MOST_BAG_BYTES:
        raise SensorError(f"{path}: has {size >> 30} GB, expected at most {MOST_BAG_BYTES >> 30} GB")
