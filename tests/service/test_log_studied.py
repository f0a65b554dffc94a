"""`vistel log diff`, `stats`, `grep` and `export` on a recorded meeting, and on logs that are damaged."""

from __future__ import annotations

import csv
import json
import wave
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import vistel.log
from vistel.audio.opus import FRAME, FRAME_NS, Encoder
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINTS
from vistel.log.compare import Limits, compare
from vistel.log.numbers import skeleton_of, tracks
from vistel.v1.audio_pb2 import Voice
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.topics import BY_NAME
from vistel_cli.main import app
from vistel_sim.motion.bvh import parse_bvh

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["log", *map(str, arguments)], env={"COLUMNS": "160"})


def one_line(result: Result) -> str:
    """What a command that failed said."""
    assert result.exit_code in (1, 2), result.output
    assert "Traceback" not in result.output
    assert result.stderr.strip().count("\n") == 0, result.stderr
    return result.stderr


def copied(to: Path, shift_ns: int = 0, version: int = 1, twice: bool = False) -> Path:
    """The meeting, with the times of everything after its middle shifted, another version, or each message twice."""
    reader = LogReader(MEETING)
    middle_ns = (reader.begin_ns + reader.end_ns) // 2
    with LogWriter(to, reader.conference_toml) as writer:
        for r in reader.records():
            late_ns = shift_ns if r.log_ns > middle_ns else 0
            r.message.header.t_ns += late_ns
            r.message.header.version = version
            for _ in range(1 + twice):
                writer.write(r.topic, r.key, r.message, r.log_ns + late_ns)
    return to


def test_a_log_and_itself_differ_by_nothing(tmp_path: Path) -> None:
    result = call("diff", MEETING, MEETING, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["over"] == found["answers"] == []
    assert max(j["most_degrees"] for j in found["joints"]) == 0.0
    assert found["commands"] == 3


def test_who_holds_what_and_when_is_found_by_an_expression() -> None:
    result = call("grep", MEETING, "thing.baton.held and participant.ben.motion.right_wrist.y > 0", "--json")
    assert result.exit_code == 0, result.output
    held = json.loads(result.stdout)
    grasp = next(g for g in compare(vistel.log.open(MEETING), vistel.log.open(MEETING)).grasps if "ben" in g.what)
    assert sum(s["to"] - s["from"] for s in held) >= grasp.first_s - 0.1
    never = call("grep", MEETING, "participant.ben.motion.head.y > 3")
    assert never.exit_code == 1
    heights = tracks(vistel.log.open(MEETING), ["participant.ben.motion.head.y"])["participant.ben.motion.head.y"].value
    said = f"never true\n  participant.ben.motion.head.y was from {heights.min():.4g} to {heights.max():.4g}"
    assert said in never.stderr
    assert call("grep", MEETING, "touch.ben.chair-1").exit_code == 0


def test_statistics_tell_rates_gaps_and_sizes() -> None:
    result = call("stats", MEETING, "--json")
    assert result.exit_code == 0, result.output
    found = {c["key"].rpartition("vistel/meeting/")[2]: c for c in json.loads(result.stdout)["channels"]}
    motion = found["site/tokyo/participant/aiko/motion"]
    assert motion["rate_hz"] == pytest.approx(60.0, rel=0.02)
    assert motion["gap_s"] < 0.05
    assert motion["backwards"] == 0
    assert "aiko/motion" in call("stats", MEETING).stdout


def test_a_joint_as_a_table_is_where_the_posture_has_it(tmp_path: Path) -> None:
    file = tmp_path / "wrist.csv"
    result = call("export", MEETING, "-o", file, "--csv", "participant.ben.motion.left_wrist", "--csv", "thing.baton.held")
    assert result.exit_code == 0, result.output
    with file.open() as text:
        rows = {round(float(row["t"]), 5): row for row in csv.DictReader(text)}
    log = vistel.log.open(MEETING)
    t, posture = list(log.postures("ben"))[100]
    at = pose_joints(skeleton_of(log, "ben"), posture).position[JOINTS.index("left_hand")]
    row = rows[round(t, 5)]
    assert [float(row[f"participant.ben.motion.left_wrist.{axis}"]) for axis in "xyz"] == pytest.approx(at, abs=1e-4)
    held = {float(r["thing.baton.held"]) for r in rows.values() if r["thing.baton.held"]}
    assert held == {0.0, 1.0, 2.0}  # by nobody, by one, by both at the handover


def test_a_person_as_bvh_has_the_joints_where_the_figure_has_them(tmp_path: Path) -> None:
    file = tmp_path / "ben.bvh"
    assert call("export", MEETING, "-o", file, "--bvh", "ben", "--fps", "30").exit_code == 0
    read = parse_bvh(file)
    position, _ = read.pose()
    log = vistel.log.open(MEETING)
    timed = list(log.postures("ben"))
    begin = timed[0][0]
    posed = {round((t - begin) * 30, 3): pose_joints(skeleton_of(log, "ben"), posture) for t, posture in timed}
    at = position[60] * 0.01
    expected = min(posed.items(), key=lambda item: abs(item[0] - 60))[1].position
    for name, joint in (("LeftHand", "left_hand"), ("Head", "head"), ("RightToeBase", "right_toes"), ("Hips", "hips")):
        assert np.linalg.norm(at[read.names.index(name)] - expected[JOINTS.index(joint)]) < 0.03, name


def test_a_voice_as_wav_is_in_time_with_the_log(tmp_path: Path) -> None:
    log, file = tmp_path / "voice.mcap", tmp_path / "ben.wav"
    reader, encoder = LogReader(MEETING), Encoder()
    tone = np.sin(np.arange(FRAME) * (2 * np.pi * 400 / 48_000)).astype(np.float32)
    with LogWriter(log, reader.conference_toml) as writer:
        for n in (0, *range(50, 60)):
            message = Voice(opus=b"no opus" if n == 0 else encoder.encode(0.5 * tone))
            message.header.version, message.header.t_ns = 1, reader.begin_ns + n * FRAME_NS
            writer.write(BY_NAME["voice"], "vistel/meeting/site/columbus/participant/ben/voice", message, message.header.t_ns)
    assert call("export", log, "-o", file, "--wav", "ben").exit_code == 0
    with wave.open(str(file)) as read:
        sound = np.frombuffer(read.readframes(read.getnframes()), "<i2")
    assert len(sound) == 60 * FRAME
    assert np.abs(sound[: 50 * FRAME]).max() == 0
    assert np.abs(sound[52 * FRAME :]).max() > 3000


def test_a_log_cut_off_anywhere_or_with_a_flipped_byte_is_studied_as_far_as_it_goes_or_refused_in_one_line(tmp_path: Path) -> None:
    whole = MEETING.read_bytes()
    rng = np.random.default_rng(1)
    for n in range(24):
        at = int(rng.integers(0, len(whole)))
        damaged = tmp_path / f"{n}.mcap"
        data = whole[:at] if n % 2 else whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :]
        damaged.write_bytes(data)
        for arguments in (("stats", damaged), ("diff", MEETING, damaged), ("grep", damaged, "participant.ben.motion.head.y > 1")):
            result = call(*arguments)
            assert result.exit_code in (0, 1, 2), (n, at, arguments, result.output)
            assert result.exception is None or isinstance(result.exception, SystemExit), (n, at, arguments, result.exception)


def test_a_log_of_a_newer_version_is_told(tmp_path: Path) -> None:
    newer = copied(tmp_path / "newer.mcap", version=2)
    result = call("diff", MEETING, newer)
    assert result.exit_code == 1
    assert "only in the first" in result.stdout
    assert "version 2, this is 1" in call("stats", newer).stderr


def test_messages_that_come_twice_or_whose_time_goes_back_change_nothing_else(tmp_path: Path) -> None:
    twice = vistel.log.open(copied(tmp_path / "twice.mcap", twice=True))
    found = compare(vistel.log.open(MEETING), twice)
    assert max(j.most_degrees for j in found.joints) == 0.0
    assert [s for s in (*found.contacts, *found.grasps) if s.apart_s > Limits().apart_s] == []
    back = copied(tmp_path / "back.mcap", shift_ns=-1_500_000_000)
    for arguments in (("stats", back), ("diff", MEETING, back), ("grep", back, "participant.ben.motion.head.speed > 0.1")):
        assert call(*arguments).exit_code in (0, 1)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["grep", MEETING, "participant.bem.motion.head.y > 1"], "did you mean ben?"),
        (["grep", MEETING, "participant.ben.motion.left_wirst.y > 1"], "did you mean left_wrist?"),
        (["grep", MEETING, "participant.ben.motion.head.w > 1"], "there are x, y, z, speed, angle"),
        (["grep", MEETING, "thing.batn.x > 1"], "no thing is called 'batn'; did you mean baton?"),
        (["grep", MEETING, "touch.bem.aiko"], "no person or thing is called 'bem'; did you mean ben?"),
        (["grep", MEETING, "motion.ben.frame > 1"], "is no number"),
        (["grep", MEETING, "command_result.aiko.outcom > 1"], "did you mean outcome?"),
        (["grep", MEETING, "moton.ben.x > 1"], "did you mean motion?"),
        (["grep", MEETING, "participant.ben.motion.head.y >"], "' on; expected numbers, names"),
        (["grep", MEETING, "touch.aiko.ben not thing.baton.held"], "thing.baton.held' on; expected"),
        (["grep", MEETING, "eval(1)"], "is not understood"),
        (["export", MEETING, "-o", "no/such.csv", "--csv", "thing.baton.x"], "no folder"),
        (["export", MEETING, "-o", "x.csv"], "x.csv: expected --csv NAME as well"),
        (["export", MEETING, "-o", "x.bvh", "--bvh", "bem"], "no participant is called 'bem'"),
        (["export", MEETING, "-o", "x.wav", "--wav", "bem"], "no participant is called 'bem'"),
        (["export", MEETING, "-o", "x.wav", "--wav", "ben"], "no voice of ben"),
        (["export", MEETING, "-o", "x.wav", "--wav", "ben", "--bvh", "ben"], "give one of them"),
        (["diff", MEETING, MEETING, "--from", "7"], "no time in common"),
    ],
)
def test_what_cannot_be_asked_gets_one_line(arguments: list[str | Path], said: str) -> None:
    assert said in one_line(call(*arguments))
