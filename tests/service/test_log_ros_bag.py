"""Bags of ROS 2 become logs: frames as sensors, sound as a voice, pictures as a film beside the log; and what is no such bag."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import vistel.log
from vistel.geometry.rotation import rotation_x, rotation_y
from vistel.log.ros.bag import Bag, is_bag, pictures, read_bag
from vistel.log.ros.film import write_film
from vistel.log.ros.frames import people_of, take_of
from vistel.log.ros.sound import voice_of
from vistel.log.sensors import SENSORS, SensorError, Take
from vistel_cli.main import app

pytest.importorskip("rosbags", reason="rosbags is not installed (pip install 'vistel[ros]')")
av = pytest.importorskip("av", reason="PyAV is not installed (pip install 'vistel[ros]')")

from ros_bags import AXES, BEGIN_S, StoragePlugin, Written  # noqa: E402  needs rosbags
from test_log_imported import sensors_of  # noqa: E402

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"
STORAGES = pytest.mark.parametrize("storage", list(StoragePlugin), ids=lambda storage: storage.name.lower())
SECONDS = 1.0


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["log", *map(str, arguments)], env={"COLUMNS": "160"})


def ben(prefix: str = "", scale: float = 1.0, seconds: float = SECONDS) -> Written:
    """ben's sensors as frames in `map`, by REP 103. scale: units in a metre."""
    written = Written()
    for t, sensor, p, r in sensors_of(vistel.log.open(MEETING), "ben"):
        if t < seconds:
            written.transform(t, "map", prefix + sensor, scale * AXES @ p, AXES @ r @ AXES.T)
    return written


def take(bag: Bag, **said: str) -> Take:
    return take_of(bag, people_of(bag, {})[""], **said)


@STORAGES
def test_frames_of_a_bag_are_the_sensors_that_were_recorded(tmp_path: Path, storage: StoragePlugin) -> None:
    read = take(read_bag(ben().write(tmp_path / "bag", storage)))
    assert set(read.tracks) == set(SENSORS)
    truth = [found for found in sensors_of(vistel.log.open(MEETING), "ben") if found[0] < SECONDS and found[1] == "left_hand"]
    track = read.tracks["left_hand"]
    assert track.t - BEGIN_S == pytest.approx([t for t, *_ in truth], abs=1e-6)
    assert track.position == pytest.approx(np.array([p for _, _, p, _ in truth]), abs=1e-6)
    assert track.rotation == pytest.approx(np.array([r for *_, r in truth]), abs=1e-6)


def test_a_frame_is_followed_through_fixed_and_moving_frames_to_the_outermost(tmp_path: Path) -> None:
    written = Written()
    forward, tilted = np.array([1.0, 0.0, 0.0]), rotation_x(0.3)
    written.transform(0.0, "hmd", "head", [0.0, 0.0, 0.1], tilted, fixed=True)
    for n in range(100):
        written.transform(0.01 * n, "cart", "hmd", [0.0, 0.0, 1.5], np.eye(3))
        if n % 10 == 0:  # ten times slower: between two of them in a straight line
            written.transform(0.01 * n, "map", "cart", 0.01 * n * forward, np.eye(3))
    track = take(read_bag(written.write(tmp_path / "bag"))).tracks["head"]
    t = track.t - BEGIN_S
    assert t[-1] == pytest.approx(0.9)
    assert track.position == pytest.approx(np.column_stack([0.0 * t, 1.6 + 0.0 * t, t]), abs=1e-6)
    assert track.rotation[50] == pytest.approx(AXES.T @ tilted @ AXES)


def test_people_are_known_by_what_stands_before_their_sensors(tmp_path: Path) -> None:
    written = ben("ann/", seconds=0.2)
    written.messages += ben("ben/", seconds=0.2).messages
    assert set(people_of(read_bag(written.write(tmp_path / "bag")), {})) == {"ann", "ben"}


def test_a_frame_of_another_name_is_told_which_sensor_it_is(tmp_path: Path) -> None:
    written = Written()
    for n in range(10):
        written.transform(0.01 * n, "map", "tracker_1", [0.0, 0.0, 1.6], np.eye(3))
    bag = read_bag(written.write(tmp_path / "bag"))
    with pytest.raises(
        SensorError, match=r"no frame is called chest, .*; it has map, tracker_1; say which is which: --frame head="
    ):
        people_of(bag, {})
    assert people_of(bag, {"head": "/tracker_1"}) == {"": {"head": "tracker_1"}}
    with pytest.raises(SensorError, match=r"the frame hmd for head never comes; it has map, tracker_1$"):
        people_of(bag, {"head": "hmd"})


def test_transforms_whose_time_goes_back_are_put_in_order_and_counted(tmp_path: Path) -> None:
    written = ben()
    written.messages = written.messages[200:300] + written.messages[:200] + written.messages[300:]
    for n, (_, topic, kind, message) in enumerate(written.messages):
        written.messages[n] = (0.001 * n, topic, kind, message)  # they arrive so
    mixed = take(read_bag(written.write(tmp_path / "mixed")))
    was = take(read_bag(ben().write(tmp_path / "bag")))
    assert (mixed.back, was.back) == (4, 0), "once for each sensor"
    assert all(np.array_equal(mixed.tracks[s].position, was.tracks[s].position) for s in SENSORS)


def _loop(written: Written) -> None:
    written.transform(0.0, "chest", "map", [0.0, 0.0, 0.0], np.eye(3))


def _two_parents(written: Written) -> None:
    written.transform(0.0, "odom", "head", [0.0, 0.0, 1.6], np.eye(3))


def _two_rooms(written: Written) -> None:
    for n in range(10):
        written.transform(0.01 * n, "elsewhere", "other", [0.0, 0.0, 1.6], np.eye(3))
    written.messages = [m for m in written.messages if m[3].transforms[0].child_frame_id != "head"]
    for n in range(10):
        written.transform(0.01 * n, "other", "head", [0.0, 0.0, 0.0], np.eye(3))


def _never_moves(written: Written) -> None:
    written.messages.clear()
    written.transform(0.0, "map", "head", [0.0, 0.0, 1.6], np.eye(3), fixed=True)


def _no_rotation(written: Written) -> None:
    written.transform(0.0, "map", "head", [0.0, 0.0, 1.6], np.eye(3))
    written.messages[-1][3].transforms[0].transform.rotation.w = 90.0


def _not_finite(written: Written) -> None:
    written.transform(0.0, "map", "head", [0.0, float("nan"), 1.6], np.eye(3))


def _no_transforms(written: Written) -> None:
    written.messages.clear()
    written.jpeg(0.0, (1, 2, 3))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_loop, r"frames are in each other, in a loop: chest in map in chest$|in a loop: map in chest in map$"),
        (_two_parents, r"the frame head is in two others: map and odom$"),
        (_two_rooms, r"are not measured in one frame, but in elsewhere and in map$"),
        (_never_moves, r"the frame head never moves: it is only in tf_static$"),
        (_no_rotation, r"the transform from map to head: expected a unit quaternion, got"),
        (_not_finite, r"the transform from map to head: expected finite numbers, got"),
        (_no_transforms, r"no transforms are in it; expected a topic of type .*; it has /camera/image_raw/compressed \(sensor"),
    ],
)
def test_a_bag_that_cannot_be_used_gets_one_line(tmp_path: Path, change: Callable[[Written], None], said: str) -> None:
    written = ben(seconds=0.2)
    change(written)
    written.write(tmp_path / "bag")
    with pytest.raises(SensorError) as told:
        take(read_bag(tmp_path / "bag"))
    assert re.search(said, str(told.value))
    assert str(told.value).startswith(str(tmp_path / "bag"))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("scale", "up", "told"),
    [(1000.0, "z", " m above the floor; these look like mm: --unit mm"), (1.0, "y", "z looks like the height: --up z")],
)
def test_a_wrong_unit_and_a_wrong_axis_are_told_with_a_guess(tmp_path: Path, scale: float, up: str, told: str) -> None:
    bag = read_bag(ben(scale=scale).write(tmp_path / "bag"))
    with pytest.raises(SensorError, match=re.escape(told)):
        take(bag, up=up)


@STORAGES
@pytest.mark.parametrize("share", [0.0, 0.3, 0.95])
def test_a_bag_that_is_cut_off_gets_one_line(tmp_path: Path, storage: StoragePlugin, share: float) -> None:
    bag = ben().write(tmp_path / "bag", storage)
    (stored,) = (f for f in bag.iterdir() if f.name != "metadata.yaml")
    stored.write_bytes(stored.read_bytes()[: int(share * stored.stat().st_size)])
    with pytest.raises(SensorError) as told:
        read_bag(bag)
    assert str(told.value).startswith(f"{bag}: cannot be read as a bag of ROS 2, it is cut off or damaged")
    assert "\n" not in str(told.value)


def test_a_bag_whose_recorder_was_killed_says_how_to_mend_it(tmp_path: Path) -> None:
    bag = ben(seconds=0.1).write(tmp_path / "bag")
    (bag / "metadata.yaml").unlink()
    assert is_bag(bag)
    with pytest.raises(SensorError, match=r"metadata\.yaml is missing, as when the recorder was killed; make it anew: ros2 bag re"):
        read_bag(bag)


def test_metadata_that_is_no_yaml_gets_one_line(tmp_path: Path) -> None:
    bag = ben(seconds=0.1).write(tmp_path / "bag")
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: [\n&a *a {")
    with pytest.raises(SensorError, match="cannot be read as a bag of ROS 2"):
        read_bag(bag)


@pytest.mark.parametrize("stamped", [False, True])
def test_a_sound_is_a_voice_that_begins_when_it_was_recorded(tmp_path: Path, stamped: bool) -> None:
    rate = 16_000
    silence_then_tone = np.concatenate([np.zeros(rate // 2), 0.5 * np.sin(2 * np.pi * 440.0 * np.arange(rate) / rate)])
    written = ben(seconds=0.2)
    written.late_s = 500.0  # as in a bag of a simulation: only stamps are of the time of the transforms
    written.sound(0.1, silence_then_tone.astype(np.float32), rate, stamped=stamped)
    bag = read_bag(written.write(tmp_path / "bag"))
    voice = list(voice_of(bag.path, bag.sounds[0]))
    loud = [message.header.t_ns * 1e-9 - BEGIN_S for message in voice if message.level_db > -20.0]
    assert voice[0].header.t_ns * 1e-9 - BEGIN_S == pytest.approx(0.1, abs=0.03)
    assert loud[0] == pytest.approx(0.6, abs=0.04)
    assert len(voice) == pytest.approx(75, abs=2)


def test_a_sound_that_nothing_describes_is_told(tmp_path: Path) -> None:
    written = ben(seconds=0.2)
    written.sound(0.0, np.zeros(1600, np.float32), 16_000, info=False)
    bag = read_bag(written.write(tmp_path / "bag"))
    with pytest.raises(SensorError, match=r"/audio/audio: nothing says how it is sampled; expected a topic of type audio_common"):
        list(voice_of(bag.path, bag.sounds[0]))


def test_pictures_of_pixels_become_a_film_at_their_times(tmp_path: Path) -> None:
    written = ben(seconds=0.2)
    for n, encoding in enumerate(("rgb8", "bgr8", "mono8")):
        shade = np.zeros((48, 64, 1 if encoding == "mono8" else 3))
        shade[..., 0] = 255.0
        written.pixels(0.5 * n, shade, encoding)
    bag = read_bag(written.write(tmp_path / "bag"))
    shown = ((t - BEGIN_S, picture) for t, picture in pictures(bag, "/camera/image_raw"))
    count, first, last = write_film("bag", shown, tmp_path / "film.mp4")
    assert (count, first, last) == (3, pytest.approx(0.0, abs=1e-4), pytest.approx(1.0, abs=1e-4))
    with av.open(str(tmp_path / "film.mp4")) as film:
        frames = [(float(f.time), f.to_ndarray(format="rgb24").mean(axis=(0, 1))) for f in film.decode(video=0)]
    assert [t for t, _ in frames] == pytest.approx([0.0, 0.5, 1.0], abs=1e-3)
    red, blue, white = (colour for _, colour in frames)
    assert red[0] > 200.0 and red[2] < 60.0 and blue[2] > 200.0 and blue[0] < 60.0 and white.min() > 200.0


@pytest.mark.parametrize("data", [b"", b"\xff\xd8\xff\xe0 cut", b"GIF89a..."])
def test_a_picture_that_is_none_is_told(tmp_path: Path, data: bytes) -> None:
    written = ben(seconds=0.2)
    written.jpeg_bytes(0.1, data)
    bag = read_bag(written.write(tmp_path / "bag"))
    with pytest.raises(SensorError, match="a picture cannot be read as JPEG or PNG; it is cut off or damaged"):
        write_film("bag", pictures(bag, bag.picture_topics[0]), tmp_path / "film.mp4")


@pytest.mark.slow
def test_people_voices_and_pictures_of_a_bag_become_a_log_and_a_film_of_the_same_time(tmp_path: Path) -> None:
    written = ben("ann/")
    rate = 16_000
    written.sound(-0.2, (0.5 * np.sin(0.2 * np.arange(rate))).astype(np.float32), rate, topic="/ann/audio")
    for n in range(4):
        written.jpeg(0.3 * n, (250, 10, 10) if n < 2 else (10, 10, 250))
    written.messages.sort(key=lambda message: message[0])
    bag = written.write(tmp_path / "bag")
    done = call("import", bag, "--height", "1.82", "-o", tmp_path / "log.mcap")
    assert done.exit_code == 0, done.output
    log = vistel.log.open(tmp_path / "log.mcap")
    assert log.participants == ["ann"]
    first_posture = next(iter(log.postures("ann")))[0]
    voices = list(log.messages("voice"))
    spoken = [(found.message.header.t_ns - log.begin_ns) * 1e-9 for found in voices]
    assert first_posture - spoken[0] == pytest.approx(0.2, abs=0.1)
    with av.open(str(tmp_path / "log.camera-image_raw-compressed.mp4")) as film:
        blue = [float(f.time) for f in film.decode(video=0) if f.to_ndarray(format="rgb24")[..., 2].mean() > 150.0]
    assert blue[0] - spoken[0] == pytest.approx(0.8, abs=0.05)


def test_a_frame_that_is_given_wrongly_is_told(tmp_path: Path) -> None:
    done = call("import", ben(seconds=0.1).write(tmp_path / "bag"), "--frame", "nose=x", "-o", tmp_path / "log.mcap")
    assert done.exit_code == 2
    assert "--frame nose=x: expected chest, head, left_hand, right_hand, an equals sign and a frame of the bag" in done.stderr


def test_a_person_who_is_turned_is_measured_the_same(tmp_path: Path) -> None:
    written = Written()
    for n in range(10):
        written.transform(0.01 * n, "map", "head", [1.0, 2.0, 1.6], AXES @ rotation_y(0.7) @ AXES.T)
    track = take(read_bag(written.write(tmp_path / "bag"))).tracks["head"]
    assert track.position[0] == pytest.approx([2.0, 1.6, 1.0])
    assert track.rotation[0] == pytest.approx(rotation_y(0.7))
