"""Recorded bytes of devices, computed anew: twice the same, as accepted, and a changed solver is told joint by joint."""

from __future__ import annotations

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import vistel.log
from scripts.replays import LOGS, accept, checked, main, recomputed
from vistel.conference.model import Conference
from vistel.figure.posture.posture import ELBOW
from vistel.figure.posture.solve import PostureSolver, Solved
from vistel.log.compare import Limits, compare
from vistel.log.lanes import Lanes
from vistel.log.numbers import tracks
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.log import LogReader, LogWriter
from vistel_cli.log.fast import replay_fast
from vistel_cli.main import app

HERE = Path(__file__).parent
MEETING = HERE / "meeting.mcap"
pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless a test says otherwise: processes of their own would load everything for each log anew."""
    monkeypatch.setattr("vistel_cli.log.fast.can_be_apart", lambda: False)


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What this version makes of the meeting, in one process."""
    return recomputed(MEETING, tmp_path_factory.mktemp("computed") / "meeting.mcap", apart=False)


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The meeting's first two seconds, accepted."""
    return _part(MEETING, tmp_path_factory.mktemp("begun") / "meeting.mcap", 2.0)


def _part(log: Path, path: Path, seconds: float) -> Path:
    """The beginning of a log."""
    reader = LogReader(log)
    with LogWriter(path, reader.conference_toml) as writer:
        for r in reader.records():
            if r.log_ns - reader.begin_ns < seconds * 1e9:
                writer.write(r.topic, r.key, r.message, r.log_ns)
    return path


def bend_one_elbow(monkeypatch: pytest.MonkeyPatch) -> None:
    """A posture solver that bends left elbows by a degree more."""
    solve = PostureSolver.solve

    def changed(self: PostureSolver, *given: Any, **named: Any) -> Solved:
        solved = solve(self, *given, **named)
        dofs = solved.posture.dofs.copy()
        dofs[ELBOW["left"]] += math.radians(1.0)
        return replace(solved, posture=replace(solved.posture, dofs=dofs))

    monkeypatch.setattr(PostureSolver, "solve", changed)


@pytest.mark.parametrize("log", sorted(HERE.glob("*.mcap")), ids=lambda log: log.stem)
def test_this_version_makes_of_a_log_what_was_accepted(log: Path, computed: Path, tmp_path: Path) -> None:
    again = computed if log == MEETING else recomputed(log, tmp_path / "computed.mcap")
    found = compare(vistel.log.open(log), vistel.log.open(again))
    assert found.over(Limits()) == []
    assert all(p.compared > 300 for p in found.postures)
    assert found.commands == {"meeting": 3, "others": 2}[log.stem]
    assert log.stat().st_size < 300_000
    if log == MEETING:
        assert {g.what.split(" by ")[1] for g in found.grasps if g.second_s > 0.1} == {"aiko", "ben"}, "the baton changes hands"


def test_in_the_meeting_a_thing_is_moved_by_word_one_is_let_go_and_people_touch() -> None:
    with vistel.log.open(MEETING) as log:
        last = list(Lanes(log).parts())[-1]
        ball = tracks(log, ["thing.ball.x"])["thing.ball.x"].value
        done = [r.message.outcome == CommandResult.OUTCOME_DONE for r in log.messages("command_result")]
    assert done == [True, False, False]
    assert ball[-1] - ball[0] == pytest.approx(0.1, abs=0.005), "to the left of aiko, who faces +z"
    ((_, let_go, _),) = (g for g in last["grasps"] if g[2] == "baton by aiko")
    assert let_go < last["end"] - 0.2, "aiko gives the baton away"
    assert "aiko and ben" in [what for *_, what in last["touches"]]


def test_two_runs_write_the_same_bytes_in_one_process_and_in_two(computed: Path, tmp_path: Path) -> None:
    apart = [recomputed(MEETING, tmp_path / f"{n}.mcap", apart=True).read_bytes() for n in range(2)]
    assert apart[0] == apart[1] == computed.read_bytes()


def test_the_folder_in_which_a_live_room_is_kept_is_left_alone(tmp_path: Path) -> None:
    reader, kept = LogReader(MEETING), tmp_path / "kept"
    conference = Conference.model_validate(reader.conference)
    conference = conference.model_copy(update={"world": conference.world.model_copy(update={"folder": kept, "on": "tokyo"})})
    replay_fast(reader, conference, "devices", reader.begin_ns, reader.begin_ns + 1_000_000_000, tmp_path / "computed.mcap")
    assert not kept.exists()
    steps = list(vistel.log.open(tmp_path / "computed.mcap").messages("world_inputs"))
    assert len(steps) > 50, "the world begins at once, wherever the live one was"


def test_an_elbow_that_bends_by_a_degree_more_is_named_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    bend_one_elbow(monkeypatch)
    found = checked(MEETING, tmp_path / "computed.mcap")
    turned = {(j.participant, j.joint): j.degrees for j in found.joints if j.degrees > Limits().degrees}
    assert turned == {(who, "left_lower_arm"): pytest.approx(1.0, abs=0.1) for who in ("aiko", "ben")}
    lines = [line for line in found.over(Limits()) if "left_lower_arm" in line]
    assert len(lines) == 2


def test_a_change_is_shown_then_accepted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, begun: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = Path(shutil.copy(begun, tmp_path / "meeting.mcap"))
    bend_one_elbow(monkeypatch)
    assert main([str(log)]) == 1
    assert "aiko left_lower_arm" in capsys.readouterr().out
    assert main([str(log), "--accept"]) == 0
    assert "aiko left_lower_arm" in capsys.readouterr().out
    assert main([str(log)]) == 0


def test_what_is_accepted_has_its_inputs_in_it(computed: Path, tmp_path: Path) -> None:
    accept(computed, tmp_path / "again.mcap")
    assert len(list(vistel.log.open(tmp_path / "again.mcap").messages("device_raw"))) == len(
        list(vistel.log.open(MEETING).messages("device_raw"))
    )
    assert sorted(p.name for p in LOGS.glob("*.mcap")) == ["meeting.mcap", "others.mcap"]


def test_the_command_says_what_differs_and_fails(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, begun: Path) -> None:
    command = ["replay", str(begun), "--source", "devices", "--fast", "--against", str(begun), "--json"]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "as-it-was")])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["over"] == []
    bend_one_elbow(monkeypatch)
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "changed")])
    assert result.exit_code == 1
    assert any("aiko left_lower_arm: 1.0" in line for line in json.loads(result.stdout)["over"])
    wider = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "wider"), "--most-degrees", "2", "--most-mm", "50"])
    assert wider.exit_code == 0, wider.output


def test_a_replay_says_how_far_it_is_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, begun: Path
) -> None:
    monkeypatch.setattr("vistel_cli.waiting.SILENT_S", 0.0)
    result = CliRunner().invoke(app, ["replay", str(begun), "--fast", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert re.search(r"^\d+\.\d s of \d+\.\d s at \d+\.\dx … \d+ s$", result.stderr, re.MULTILINE), result.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--against", str(MEETING)], "--fast"),
        (["--fast", "--site", "tokyo"], "leave the other options out"),
        (["--fast", "--source", "recorded"], "--source devices or motion"),
    ],
)
def test_options_that_do_not_go_together_get_one_line(arguments: list[str], said: str) -> None:
    result = CliRunner().invoke(app, ["replay", str(MEETING), *arguments], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    assert said in result.stderr
    assert result.stderr.strip().count("\n") == 0


@pytest.mark.parametrize("damage", ["cut off", "flipped"])
def test_a_damaged_log_is_computed_as_far_as_it_goes_and_the_damage_is_told(damage: str, tmp_path: Path) -> None:
    data = bytearray(MEETING.read_bytes())
    log = tmp_path / "damaged.mcap"
    data[90_000] ^= 0x40
    log.write_bytes(MEETING.read_bytes()[:120_000] if damage == "cut off" else data)
    command = ["replay", str(log), "--source", "devices", "--fast", "--out", str(tmp_path / "out"), "--against", str(MEETING)]
    result = CliRunner().invoke(app, command, env={"COLUMNS": "200"})
    assert result.exit_code == (0 if damage == "cut off" else 1), result.output
    assert "is broken" in result.stderr or "cut off" in result.stderr
    assert "Traceback" not in result.output


def test_a_log_without_bytes_of_devices_says_what_else_it_can_be_computed_from(tmp_path: Path) -> None:
    log, reader = tmp_path / "motions.mcap", LogReader(MEETING)
    with LogWriter(log, reader.conference_toml) as writer:
        for r in reader.records(("participant", "motion")):
            writer.write(r.topic, r.key, r.message, r.log_ns)
    result = CliRunner().invoke(app, ["replay", str(log), "--source", "devices", "--fast", "--out", str(tmp_path)])
    assert result.exit_code == 1
    assert "--source motion" in result.stderr
    result = CliRunner().invoke(app, ["replay", str(log), "--fast", "--out", str(tmp_path), "--json"])
    assert result.exit_code == 0, result.output
    own = CliRunner().invoke(app, ["replay", str(tmp_path / "replay.mcap"), "--fast", "--force", "--out", str(tmp_path)])
    assert own.exit_code == 2
    assert "the log itself" in own.stderr
