"""Bags of ROS 2 as `ros2 bag record` writes them, by rosbags' own writer: for tests, and never by our code."""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from vistel.arrays import F32, F64
from vistel.geometry.rotation import quaternion_from_matrix

BEGIN_S = 1_750_000_000.0
"""When bags begin [s]."""
AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""From a seat's axes (x left, y up, z forward) to those of REP 103 (x forward, y left, z up)."""
AUDIO = {
    "audio_common_msgs/msg/AudioData": "uint8[] data",
    "audio_common_msgs/msg/AudioDataStamped": "std_msgs/Header header\naudio_common_msgs/AudioData audio",
    "audio_common_msgs/msg/AudioInfo": (
        "uint8 channels\nuint32 sample_rate\nstring sample_format\nuint32 bitrate\nstring coding_format"
    ),
}
STORE: Any = get_typestore(Stores.ROS2_HUMBLE)
STORE.register({name: how for kind, text in AUDIO.items() for name, how in get_types_from_msg(text, kind).items()})
TYPES = STORE.types


@dataclass
class Written:
    """What a bag is to hold: messages with their topics, types and times of arrival [s after its beginning]."""

    messages: list[tuple[float, str, str, Any]] = field(default_factory=list)
    late_s: float = 0.0
    """By how much times of arrival are later than the stamps, as in a bag of a simulation."""

    def transform(self, t: float, parent: str, child: str, p: Iterable[float], r: F64, *, fixed: bool = False) -> None:
        """p (3,) [m], r (3, 3): of `child` in `parent`."""
        x, y, z, w = quaternion_from_matrix(np.ascontiguousarray(r)).tolist()
        turned = TYPES["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w)
        where = TYPES["geometry_msgs/msg/Vector3"](*(float(k) for k in p))
        moved = TYPES["geometry_msgs/msg/Transform"](translation=where, rotation=turned)
        one = TYPES["geometry_msgs/msg/TransformStamped"](header=header(t, parent), child_frame_id=child, transform=moved)
        self.put(t, "/tf_static" if fixed else "/tf", TYPES["tf2_msgs/msg/TFMessage"](transforms=[one]))

    def sound(self, t: float, samples: F32, rate: int, *, topic: str = "/audio", stamped: bool = False, info: bool = True) -> None:
        """samples (n,) from `t` on, in messages of 50 ms, each made when its last sample is there."""
        if info:
            told = TYPES["audio_common_msgs/msg/AudioInfo"](
                channels=1, sample_rate=rate, sample_format="S16LE", bitrate=0, coding_format="wave"
            )
            self.put(t, f"{topic}/audio_info", told)
        for at in range(0, len(samples), rate // 20):
            piece = (np.clip(samples[at : at + rate // 20], -1.0, 1.0) * 32767.0).astype("<i2")
            end = t + (at + len(piece)) / rate
            data = TYPES["audio_common_msgs/msg/AudioData"](data=np.frombuffer(piece.tobytes(), np.uint8))
            if stamped:
                data = TYPES["audio_common_msgs/msg/AudioDataStamped"](header=header(end, "mic"), audio=data)
            self.put(end, f"{topic}/audio", data)

    def jpeg(self, t: float, colour: tuple[int, int, int], topic: str = "/camera/image_raw/compressed") -> None:
        """A picture of one colour."""
        file = io.BytesIO()
        Image.new("RGB", (64, 48), colour).save(file, "JPEG")
        self.jpeg_bytes(t, file.getvalue(), topic)

    def jpeg_bytes(self, t: float, data: bytes, topic: str = "/camera/image_raw/compressed") -> None:
        """What is said to be a picture."""
        held = np.frombuffer(data, np.uint8)
        self.put(t, topic, TYPES["sensor_msgs/msg/CompressedImage"](header=header(t, "camera"), format="jpeg", data=held))

    def pixels(self, t: float, rgb: F32, encoding: str, topic: str = "/camera/image_raw") -> None:
        """A picture (h, w, n), bytes."""
        h, w, n = rgb.shape
        kind, data = TYPES["sensor_msgs/msg/Image"], rgb.astype(np.uint8).ravel()
        self.put(t, topic, kind(header=header(t, "c"), height=h, width=w, encoding=encoding, is_bigendian=0, step=w * n, data=data))

    def put(self, t: float, topic: str, message: Any) -> None:
        self.messages.append((t, topic, message.__msgtype__, message))

    def write(self, path: Path, storage: StoragePlugin = StoragePlugin.MCAP) -> Path:
        """Written in the order of arrival."""
        with Writer(path, version=9, storage_plugin=storage) as writer:
            topics: dict[tuple[str, str], Any] = {}
            for t, topic, kind, message in self.messages:
                if (topic, kind) not in topics:
                    topics[topic, kind] = writer.add_connection(topic, kind, typestore=STORE)
                arrived_ns = round((BEGIN_S + t + self.late_s) * 1e9)
                writer.write(topics[topic, kind], arrived_ns, STORE.serialize_cdr(message, kind))
        return path


def header(t: float, frame: str) -> Any:
    """t: after the bag's beginning [s]."""
    ns = round((BEGIN_S + t) * 1e9)
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=ns // 1_000_000_000, nanosec=ns % 1_000_000_000)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)
