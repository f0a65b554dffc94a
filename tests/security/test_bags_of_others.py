"""A bag of ROS 2 that somebody sends: it unpacks to more than there is, or brings code as the layout of its messages."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import zstandard

from vistel.log.ros.bag import read_bag
from vistel.log.sensors import SensorError

pytest.importorskip("rosbags", reason="rosbags is not installed (pip install 'vistel[ros]')")

from ros_bags import StoragePlugin, Written

UNPACKED_BYTES = 16 << 30


def bag(path: Path, storage: StoragePlugin = StoragePlugin.MCAP) -> Path:
    written = Written()
    for n in range(10):
        written.transform(0.1 * n, "map", "head", [0.0, 0.0, 1.6], np.eye(3))
    return written.write(path, storage)


def test_what_unpacks_to_more_than_a_machine_has_is_refused(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag", StoragePlugin.SQLITE3)
    (stored,) = path.glob("*.db3")
    zeros = bytes(64 << 20)
    piece = zstandard.ZstdCompressor().compress(zeros) * (UNPACKED_BYTES // len(zeros))
    assert len(piece) < 4 << 20
    _put(stored, piece)
    text = (path / "metadata.yaml").read_text()
    text = text.replace("compression_format: ''", "compression_format: zstd").replace(
        "compression_mode: ''", "compression_mode: message"
    )
    (path / "metadata.yaml").write_text(text)
    assert "compression_mode: message" in text
    with pytest.raises(SensorError, match="needs more than 4 GB to be unpacked"):
        read_bag(path)


def _put(stored: Path, data: bytes) -> None:
    """Every message of a bag becomes `data`."""
    import sqlite3

    with sqlite3.connect(stored) as database:
        database.execute("UPDATE messages SET data = ?", (data,))


def test_layouts_of_a_bag_are_not_run(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag")
    (stored,) = path.glob("*.mcap")
    layout = b"geometry_msgs/TransformStamped[] transforms"
    whole = stored.read_bytes()
    assert layout in whole
    evil = b"import_os_system_touch_a_file_in_the_hom x\n\n"[: len(layout)]
    stored.write_bytes(whole.replace(layout, evil.ljust(len(layout))))
    try:
        assert read_bag(path).transforms[0].child == "head", "read by the layouts of ROS 2, whatever the bag says"
    except SensorError as e:
        assert "cut off or damaged" in str(e)
