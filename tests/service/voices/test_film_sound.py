"""A film of a log has its voices: a clap is heard where it is seen, at any rate of pictures, from where it was made."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from vistel.audio.opus import FRAME, FRAME_NS, Encoder
from vistel.conference.model import Conference
from vistel.space.room import seat_pose
from vistel.v1 import audio_pb2, motion_pb2
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION
from vistel_cli.log.render import FilmSettings, render_log

pytestmark = pytest.mark.gl

S = 1_000_000_000
BEGIN = 1_700_000_000 * S
CLAP_S = 1.237
"""After the log's beginning, captured: the arms have swung together, and a click is heard."""
TRANSIT_NS = 15_000_000
CONFERENCE = """
name = "clap"
[playout]
delay = 0.1
[[sites]]
name = "tokyo"
[sites.audio]
microphone = "none"
[[sites.participants]]
name = "ada"
[[sites]]
name = "columbus"
[sites.audio]
microphone = "sim"
[[sites.participants]]
name = "ben"
"""


def seated(seat: int, swing: float) -> tuple[np.ndarray, np.ndarray]:
    """Somebody in a chair whose arms are apart (0) to together (1)."""
    position, heading = seat_pose(2, seat)
    body = np.zeros(25)
    body[1] = math.pi / 2
    out = 1.2 * (1.0 - swing)
    body[11:14], body[18:21] = (0.0, 0.9, -out), (0.0, -0.9, out)
    feet = position + 0.42 * np.array((math.sin(heading), 0.0, math.cos(heading)))
    return body, np.append(feet, heading)


def written(path: Path, seconds: float = 2.2) -> None:
    """A log in which ben, who sits opposite of ada, claps."""
    bens, encoders = {"ada": "tokyo", "ben": "columbus"}, {n: MotionEncoder() for n in ("ada", "ben")}
    events: list[tuple[int, str, str, object]] = []
    for name, site in bens.items():
        about = motion_pb2.Participant(
            participant=name, site=site, display_name=name, avatar="builtin:no-such-setting=1", height_m=1.7
        )
        events.append((BEGIN, "participant", name, about))
    for k in range(round(seconds * 60)):
        t_s = (k + 0.22) / 60  # so that one of them is at the clap
        for seat, name in enumerate(bens):
            swing = float(np.clip((t_s - (CLAP_S - 0.15)) / 0.15, 0.0, 1.0)) if name == "ben" else 0.0
            body, stance = seated(seat, swing)
            t_ns = BEGIN + round(t_s * S)
            sample = MotionSample(k + 1, t_ns, body, np.full((2, 20), 0.2), stance)
            events.append((t_ns + TRANSIT_NS, "motion", name, encoders[name].encode(sample)))
    pcm = np.zeros(round(seconds * 48_000) // FRAME * FRAME, np.float32)
    at = round(CLAP_S * 48_000)
    pcm[at : at + 400] = 0.8 * np.random.default_rng(3).standard_normal(400) * np.exp(-np.arange(400) / 80.0)
    voice = Encoder(1, 48_000, dtx=False)
    for n in range(len(pcm) // FRAME):
        message = audio_pb2.Voice(opus=voice.encode(np.clip(pcm[n * FRAME : (n + 1) * FRAME], -1.0, 1.0)))
        message.header.t_ns = BEGIN + n * FRAME_NS - voice.lookahead_ns
        events.append((BEGIN + (n + 1) * FRAME_NS + TRANSIT_NS, "voice", "ben", message))
    with LogWriter(path, CONFERENCE) as log:
        for log_ns, topic, name, message in sorted(events, key=lambda e: e[0]):
            message.header.version = MESSAGE_VERSION  # type: ignore[attr-defined]
            key = BY_NAME[topic].format(conference="clap", site=bens[name], participant=name)
            log.write(BY_NAME[topic], key, message, log_ns)  # type: ignore[arg-type]


def seen_s(path: Path) -> tuple[float, float]:
    """When the arms stop in a film [s], and how long a picture lasts."""
    with av.open(str(path)) as container:
        pictures = [(float(f.time), f.to_ndarray(format="gray").astype(float)) for f in container.decode(video=0)]
    begin, end = pictures[0][1], pictures[-1][1]
    arms = np.abs(end - begin) > 25.0
    assert arms.sum() > 20, "nobody moves"
    off = np.array([float(np.abs(p - end)[arms].mean()) for _, p in pictures])
    still = int(np.flatnonzero(off > 0.12 * off[0])[-1]) + 1
    assert pictures[0][0] == 0.0, "a film begins with its first picture"
    return pictures[still][0], pictures[1][0]


def heard(path: Path) -> tuple[float, np.ndarray]:
    """When the click begins in a film [s], and the sound (n, 2)."""
    blocks: list[np.ndarray] = []
    first: float | None = None
    with av.open(str(path)) as container:
        stream = container.streams.audio[0]
        for frame in container.decode(stream):
            if first is None:
                first = float(frame.pts * (frame.time_base or Fraction(1, 48_000)))
            blocks.append(frame.to_ndarray().reshape(2, -1).T if frame.format.is_planar else frame.to_ndarray().reshape(-1, 2))
    sound = np.concatenate(blocks)
    loud = np.abs(sound).max(axis=1)
    assert first is not None
    return first + float(np.argmax(loud > 0.4 * loud.max())) / 48_000, sound


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "clap.mcap"
    written(path)
    return path


@pytest.mark.parametrize(("rate", "begin_s", "view"), [(60.0, 0.5, "seat"), (24.0, 0.507, "seat"), (50.0, 0.0, "room")])
def test_the_clap_is_heard_at_the_picture_in_which_the_hands_meet(
    log: Path, tmp_path: Path, rate: float, begin_s: float, view: str
) -> None:
    reader = LogReader(log)
    conference = Conference.model_validate(reader.conference)
    look = FilmSettings((160, 90), rate, 1, False, view, "fast")
    render_log(reader, conference, ["tokyo"], BEGIN + round(begin_s * S), BEGIN + 2 * S, look, tmp_path)
    at_s, sound = heard(tmp_path / "tokyo.mp4")
    picture_s, apart_s = seen_s(tmp_path / "tokyo.mp4")
    # The hands meet somewhere between the picture in which they rest and the one before.
    assert picture_s - apart_s - 0.02 < at_s < picture_s + 0.02, (at_s, picture_s)
    assert at_s == pytest.approx(CLAP_S + 0.1 - begin_s, abs=0.02)
    assert len(sound) / 48_000 == pytest.approx(math.floor((2.0 - begin_s) * rate) / rate, abs=0.03)


def test_a_film_has_names_over_heads_unless_it_is_to_have_none(log: Path, tmp_path: Path) -> None:
    reader = LogReader(log)
    conference = Conference.model_validate(reader.conference)
    for names in (True, False):
        look = FilmSettings((320, 180), 10.0, 1, True, "room", "fast", names=names)
        (folder := tmp_path / str(names)).mkdir()
        render_log(reader, conference, ["tokyo"], BEGIN + S, BEGIN + S + S // 10, look, folder)
    named, plain = (np.asarray(Image.open(tmp_path / str(n) / "tokyo/00000.png"), np.int16) for n in (True, False))
    differs = np.abs(named - plain).max(axis=2) > 30
    assert 50 < differs.sum() < 0.1 * differs.size


def test_a_film_at_half_speed_has_twice_the_pictures_at_its_own_rate_and_no_sound(log: Path, tmp_path: Path) -> None:
    reader = LogReader(log)
    conference = Conference.model_validate(reader.conference)
    look = FilmSettings((64, 36), 10.0, 1, False, "room", "fast", speed=0.5)
    render_log(reader, conference, ["tokyo"], BEGIN, BEGIN + S // 2, look, tmp_path)
    with av.open(str(tmp_path / "tokyo.mp4")) as film:
        assert not film.streams.audio
        assert [float(p.time) for p in film.decode(video=0)] == pytest.approx([k / 10 for k in range(10)], abs=0.001)


def test_a_log_without_voices_gives_a_film_without_sound_and_pictures_have_none(tmp_path: Path) -> None:
    written(tmp_path / "clap.mcap", 1.5)
    with LogWriter(tmp_path / "mute.mcap", CONFERENCE) as mute:
        for record in LogReader(tmp_path / "clap.mcap").records(topics=("participant", "motion")):
            mute.write(record.topic, record.key, record.message, record.log_ns)
    reader = LogReader(tmp_path / "mute.mcap")
    conference = Conference.model_validate(reader.conference)
    for png in (False, True):
        render_log(
            reader, conference, ["tokyo"], BEGIN, BEGIN + S // 5, FilmSettings((64, 36), 10.0, 1, png, None, "fast"), tmp_path
        )
    with av.open(str(tmp_path / "tokyo.mp4")) as container:
        assert not container.streams.audio
    assert sorted(p.name for p in (tmp_path / "tokyo").iterdir()) == ["00000.png", "00001.png"]
