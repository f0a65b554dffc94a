"""`vistel calibrate`: from recordings and files, with a verdict, or one line that says what to do again."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from vistel.conference.files import load
from vistel.conference.model import Conference, Participant, Site
from vistel.figure.calibration.distortion import load_distortion
from vistel.figure.calibration.files import load_body, load_tracker
from vistel.figure.calibration.moves import whole_s
from vistel.protocol.glove_calibration import default_calibration, load_calibration
from vistel.v1.device_pb2 import GloveFrame, TrackerFrame
from vistel.wire.log import LogWriter
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION
from vistel_cli.main import app
from vistel_sim.motion.calibration import CalibrationMoves, hand_at
from vistel_sim.motion.source import simulated_people

RUNNER = CliRunner()
CONFERENCE = Conference(sites=[Site(name="lab", participants=[Participant(name="ada", height=1.68)])])
FILE = 'name = "demo"\n[[sites]]\nname = "lab"\n[[sites.participants]]\nname = "ada"\nheight = 1.68\n'
BEGIN_S = 5.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A conference file and a log in which Ada goes through the moves and shows her left glove its hands."""
    folder = tmp_path_factory.mktemp("calibrate")
    (folder / "conference.toml").write_text(FILE)
    motion = CalibrationMoves([simulated_people(CONFERENCE)["ada"]])
    rng = np.random.default_rng(0)
    topic, glove = BY_NAME["tracker"], BY_NAME["glove"]
    with LogWriter(folder / "moves.mcap") as log:
        for k in range(round((whole_s() + BEGIN_S) * 30.0)):
            t = k / 30.0
            t_ns = 1_000_000_000_000 + round(t * 1e9)
            frame = TrackerFrame(device="ada-tracker")
            for station, (p, q) in enumerate(motion.receivers("ada", max(0.0, t - BEGIN_S)).values(), start=1):
                r = frame.receivers.add(station=station, t_ns=t_ns)
                r.position.x, r.position.y, r.position.z = p + 0.0008 * rng.standard_normal(3)
                r.rotation.x, r.rotation.y, r.rotation.z, r.rotation.w = q
            frame.header.t_ns, frame.header.version = t_ns, MESSAGE_VERSION
            log.write(topic, topic.key.format(conference="demo", site="lab", device="ada-tracker"), frame, t_ns)
            if t < 30.0:
                counts = default_calibration().counts(hand_at(t).tolist(), 18)
                hand = GloveFrame(device="ada-glove-left", raw=bytes(min(255, max(1, round(c))) for c in counts))
                hand.header.t_ns, hand.header.version = t_ns, MESSAGE_VERSION
                log.write(glove, glove.key.format(conference="demo", site="lab", device="ada-glove-left"), hand, t_ns)
    return folder


def calibrate(*words: str | Path) -> tuple[int, str, str]:
    done = RUNNER.invoke(app, ["calibrate", *map(str, words)])
    return done.exit_code, done.stdout, done.stderr


def test_a_tracker_is_calibrated_from_a_recording(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "tracker.json"
    words = ("tracker", folder / "conference.toml", "ada", "--log", folder / "moves.mcap", "--out", target, "--json")
    code, said, _ = calibrate(*words)
    assert code == 0
    table = json.loads(said)
    assert set(table["verdicts"].values()) <= {"good", "fair"} and table["file"] == str(target)
    # The transmitter of a simulated site stands 0.25 m over the floor under the seat.
    assert load_tracker(target).position == pytest.approx([0.0, 0.25, 0.0], abs=0.02)


def test_a_body_is_measured_from_a_recording_and_a_conference_takes_it(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "ada-body.json"
    code, said, _ = calibrate("body", folder / "conference.toml", "ada", "--log", folder / "moves.mcap", "--out", target)
    assert code == 0 and "Written to" in said
    assert load_body(target).skeleton.upper_arm == pytest.approx(0.29 * 1.68 / 1.75, abs=0.01)
    (tmp_path / "conference.toml").write_text(FILE + 'body = "ada-body.json"\n')
    (person,) = load(tmp_path / "conference.toml").sites[0].participants
    assert person.body == target


def test_a_glove_is_calibrated_from_a_recording(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "left.json"
    code, said, _ = calibrate("glove", folder / "conference.toml", "ada", "left", "--log", folder / "moves.mcap", "--out", target)
    assert code == 0 and "good" in said
    assert load_calibration(target).gain[0] == pytest.approx(default_calibration().gain[0], rel=0.05)


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("tracker", "{}/conference.toml", "bob", "--log", "{}/moves.mcap"), 2, "no such participant"),
        (("tracker", "{}/conference.toml", "ada", "--log", "{}/none.mcap"), 1, "none.mcap"),
        (("tracker", "{}/conference.toml", "ada", "--log", "{}/moves.mcap", "--from", "30"), 1, "repeat"),
        (("body", "{}/conference.toml", "ada", "--height", "9", "--log", "{}/moves.mcap"), 2, "--height"),
        (("body", "{}/conference.toml", "ada", "--forearm", "--log", "{}/moves.mcap"), 1, "left_forearm"),
        (("glove", "{}/conference.toml", "ada", "right", "--log", "{}/moves.mcap"), 1, "no data received"),
        (("glove", "{}/conference.toml", "ada", "middle", "--log", "{}/moves.mcap"), 1, "wears left and right"),
        (("distortion", "{}/conference.toml"), 1, "expected a table (CSV); this is a conference file"),
        (("distortion", "{}/none.csv"), 1, "no such file"),
    ],
)
def test_what_cannot_be_used_is_reported_in_one_line(
    words: tuple[str, ...], code: int, told: str, folder: Path, tmp_path: Path
) -> None:
    out = ("--out", str(tmp_path / "x.json"))
    got, _, said = calibrate(*(w.format(folder) for w in words), *out)
    assert got == code and told in said
    assert len(said.strip().splitlines()) == 1
    assert not (tmp_path / "x.json").exists()


def test_a_grid_is_made_from_known_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    lines = ["true_x,true_y,true_z,read_x,read_y,read_z"]
    for p in rng.uniform(-0.4, 0.4, (80, 3)):
        error = 0.02 * np.array([math.sin(2 * p[0]), math.cos(2 * p[1]), p[2]])
        lines.append(",".join(f"{v:.6f}" for v in (*p, *(p + error))))
    (tmp_path / "points.csv").write_text("\n".join(lines))
    code, said, _ = calibrate("distortion", tmp_path / "points.csv", "--out", tmp_path / "grid.json", "--json")
    assert code == 0
    table = json.loads(said)
    assert table["after_mm"] < 0.4 * table["before_mm"] and table["verdict"] == "good"


GRID = [np.array([x, y, z]) for z in (-0.6, -0.4, -0.2) for y in (-0.3, 0.0, 0.3) for x in (0.2, 0.45, 0.7)]


def bent(p: np.ndarray) -> np.ndarray:
    """By how much metal makes a receiver read too much."""
    return 0.02 * np.array([math.sin(3 * p[0]), p[1], math.cos(2 * p[2])])


def recording_of(path: Path, points: list[np.ndarray], hold_s: float) -> None:
    """A log in which the second receiver of Ada's tracker is held on each point."""
    rng = np.random.default_rng(0)
    topic = BY_NAME["tracker"]
    with LogWriter(path) as log:
        t = 0.0
        for a, b in zip([points[0], *points], points, strict=False):
            for k in range(round((1.0 + hold_s) * 30)):
                share = min(1.0, k / 30.0)
                at = a + share * (b - a)
                t += 1.0 / 30.0
                t_ns = 1_000_000_000_000 + round(t * 1e9)
                frame = TrackerFrame(device="ada-tracker")
                r = frame.receivers.add(station=2, t_ns=t_ns)
                r.position.x, r.position.y, r.position.z = at + bent(at) + 0.0008 * rng.standard_normal(3)
                r.rotation.w = 1.0
                frame.header.t_ns, frame.header.version = t_ns, MESSAGE_VERSION
                log.write(topic, topic.key.format(conference="demo", site="lab", device="ada-tracker"), frame, t_ns)


def test_a_grid_is_made_from_a_recording_of_a_receiver_held_on_known_points(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("\n".join(["true_x,true_y,true_z", *(",".join(map(str, p)) for p in GRID)]))
    recording_of(tmp_path / "grid.mcap", GRID, 2.0)
    words = ("distortion", tmp_path / "points.csv", "--log", tmp_path / "grid.mcap", "--device", "ada-tracker", "--station", "2")
    code, _, told = calibrate(*words, "--step", "0.25", "--out", tmp_path / "grid.json")
    assert code == 0, told
    grid = load_distortion(tmp_path / "grid.json")
    for p in GRID:
        found, _ = grid.correct(p + bent(p), np.array([0.0, 0.0, 0.0, 1.0]))
        assert np.linalg.norm(found - p) < 0.004 < 0.5 * np.linalg.norm(bent(GRID[0]))
    # One point fewer than the file has is told.
    recording_of(tmp_path / "short.mcap", GRID[1:], 2.0)
    code, _, told = calibrate(*words[:3], tmp_path / "short.mcap", *words[4:], "--out", tmp_path / "x.json")
    assert code == 1 and "held still 26 times, the file has 27 points" in " ".join(told.split())
    assert not (tmp_path / "x.json").exists()


HELMET = """
[sites.participants.face]
kind = "camera"
source = "SOURCE"
calibration = "ada-face.json"
"""


def test_a_face_is_calibrated_from_a_simulated_camera_and_one_learns_how_to_use_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    (tmp_path / "conference.toml").write_text(FILE + HELMET.replace("SOURCE", "sim"))
    code, said, _ = calibrate("face", tmp_path / "conference.toml", "ada", "--seconds", "0.5", "-o", tmp_path / "ada-face.json")
    assert code == 0 and said.splitlines()[-1] == f"wrote {tmp_path / 'ada-face.json'}"
    code, said, _ = calibrate("face", tmp_path / "conference.toml", "ada", "--seconds", "0.5", "-o", tmp_path / "other.json")
    assert code == 0 and 'write calibration = "other.json" into [sites.participants.face] of ada' in said


def test_a_camera_that_is_not_there_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "conference.toml").write_text(FILE + HELMET.replace("SOURCE", "63"))
    code, _, said = calibrate("face", tmp_path / "conference.toml", "ada", "-o", tmp_path / "ada-face.json")
    assert code == 1 and " ".join(said.split()) == (
        "error: camera 63: is not there, or is in use by another program; vistel devices lists cameras"
    )
    assert capfd.readouterr() == ("", "")  # not even by OpenCV, which prints past this process's streams
