"""The video file: times, content, and what is left when its writer is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from waiting import wait_until

from vistel.render.film.video import VideoWriter

ENDLESS = """
import sys, time, numpy as np
from pathlib import Path
from vistel.render.film.video import VideoWriter
video = VideoWriter(Path(sys.argv[1]), 160, 90, 30.0)
for k in range(100000):
    picture = np.full((90, 160, 4), k % 200 + 20, np.uint8)
    while not video.put(k * 33_000_000, picture):
        time.sleep(0.005)  # the writer's queue is full
    if k == 150:
        print("ready", flush=True)
"""


def frames(path: Path) -> list[tuple[float, np.ndarray]]:
    with av.open(str(path)) as container:
        return [(float(f.time), f.to_ndarray(format="rgb24")) for f in container.decode(video=0)]


def put(video: VideoWriter, t_ns: int, picture: np.ndarray) -> None:
    wait_until(lambda: video.put(t_ns, picture), "room in the writer's queue")


def test_frames_come_back_with_their_times_colours_and_the_right_way_up(tmp_path: Path) -> None:
    video = VideoWriter(tmp_path / "a.mp4", 160, 90, 30.0)
    times = [0, 33, 80, 100, 250]
    for t in times:
        picture = np.zeros((90, 160, 4), np.uint8)
        picture[:45] = (30, 40, 200, 255)  # the first rows are the picture's bottom
        picture[45:] = (200, 60, 30, 255)
        put(video, 5_000_000_000 + t * 1_000_000, picture)
    video.close()
    read = frames(tmp_path / "a.mp4")
    assert [t for t, _ in read] == pytest.approx([t / 1000 for t in times], abs=0.001)
    image = read[-1][1].astype(int)
    assert abs(image[20, 80] - (200, 60, 30)).max() < 12
    assert abs(image[70, 80] - (30, 40, 200)).max() < 12


def test_a_film_at_half_speed_lasts_twice_as_long_and_has_no_sound(tmp_path: Path) -> None:
    video = VideoWriter(tmp_path / "slow.mp4", 160, 90, 30.0, sound=True, speed=0.5)
    for t in (0, 100, 1000):
        put(video, 5_000_000_000 + t * 1_000_000, np.full((90, 160, 4), 128, np.uint8))
    video.close()
    assert [t for t, _ in frames(tmp_path / "slow.mp4")] == pytest.approx([0.0, 0.2, 2.0], abs=0.001)
    with av.open(str(tmp_path / "slow.mp4")) as file:
        assert not file.streams.audio


def test_odd_sizes_lose_a_row_not_the_video(tmp_path: Path) -> None:
    video = VideoWriter(tmp_path / "odd.mp4", 161, 91, 30.0)
    put(video, 0, np.full((91, 161, 4), 128, np.uint8))
    video.close()
    assert frames(tmp_path / "odd.mp4")[0][1].shape == (90, 160, 3)


def test_a_killed_writer_leaves_a_playable_file(tmp_path: Path) -> None:
    path = tmp_path / "killed.mp4"
    child = subprocess.Popen([sys.executable, "-c", ENDLESS, str(path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdout.close()
    assert len(frames(path)) >= 60


def test_however_few_pictures_come_the_file_begins_anew_each_second(tmp_path: Path) -> None:
    video = VideoWriter(tmp_path / "slow.mp4", 160, 90, 30.0)
    for k in range(16):
        put(video, k * 250_000_000, np.full((90, 160, 4), 40 + 8 * k, np.uint8))
    video.close()
    with av.open(str(tmp_path / "slow.mp4")) as container:
        keys = [float(p.pts * p.time_base) for p in container.demux(video=0) if p.is_keyframe and p.pts is not None]
    assert keys == pytest.approx([0.0, 1.0, 2.0, 3.0], abs=0.01)


def test_a_video_that_is_there_already_is_kept(tmp_path: Path) -> None:
    for _ in range(2):
        video = VideoWriter(tmp_path / "a.mp4", 32, 32, 30.0)
        put(video, 0, np.zeros((32, 32, 4), np.uint8))
        video.close()
    assert len(frames(tmp_path / "a.mp4")) == len(frames(tmp_path / "a.2.mp4")) == 1


def test_a_full_queue_leaves_pictures_out_and_counts_them(tmp_path: Path) -> None:
    video = VideoWriter(tmp_path / "a.mp4", 640, 360, 30.0)
    taken = sum(video.put(k * 1_000_000, np.zeros((360, 640, 4), np.uint8)) for k in range(300))
    video.close()
    assert video.left_out == 300 - taken
    assert video.written == taken == len(frames(tmp_path / "a.mp4"))
