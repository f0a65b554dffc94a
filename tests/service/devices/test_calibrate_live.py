"""`vistel calibrate` asks simulated people for moves and listens to their simulated devices, over real ports, in virtual time."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner
from virtual_time import LoopClock, VirtualTimeLoop

from vistel.conference.files import load
from vistel.figure.calibration.files import load_body, load_tracker
from vistel.figure.calibration.moves import STEPS, MoveError, ReceiverTrack, Samples, Step, step_tracks
from vistel.protocol import fivedt_calibration, glove_calibration
from vistel_cli.calibrate import gather
from vistel_cli.devices import session as device_session
from vistel_cli.main import app
from vistel_sim.limbs import own_limbs

FILE = """
name = "lab"
[[sites]]
name = "here"
[[sites.participants]]
name = "ada"
height = 1.68
[sites.participants.tracker]
kind = "KIND"
[sites.participants.gloves.left]
[sites.participants.gloves.right]
kind = "5dt_16"
"""


class VirtualTime(asyncio.DefaultEventLoopPolicy):
    """Makes commands, which start their own loops, run in virtual time."""

    def new_event_loop(self) -> asyncio.AbstractEventLoop:
        return VirtualTimeLoop()


@pytest.fixture
def calibrate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Runs the command; exit code and what it said."""
    monkeypatch.setattr(device_session, "SystemClock", LoopClock)
    monkeypatch.chdir(tmp_path)
    asyncio.set_event_loop_policy(VirtualTime())

    def run(*words: str, kind: str = "fastrak") -> tuple[int, str]:
        (tmp_path / "lab.toml").write_text(FILE.replace("KIND", kind))
        what, *rest = words
        done = CliRunner().invoke(app, ["calibrate", what, "lab.toml", "ada", *rest])
        return done.exit_code, done.stdout + done.stderr

    yield run
    asyncio.set_event_loop_policy(None)


def test_a_body_is_measured_from_moves_that_are_asked_for(calibrate, tmp_path: Path) -> None:
    code, said = calibrate("body", kind="liberty")
    assert code == 0, said
    for asked in ("1 of 6. Stand straight", "6 of 6. Legs still", "   3   2   1   go", "Done. Thank you."):
        assert asked in said
    residuals = [line.split() for line in said.splitlines() if line.endswith(("good    │", "fair    │"))]
    assert [row[1] for row in residuals] == ["head", "arms", "elbows", "wrists", "spine"]
    assert all(float(row[3]) < 8.0 and row[4] == "mm" for row in residuals)
    found = load_body(tmp_path / "ada-body.json").skeleton
    own = own_limbs(load(tmp_path / "lab.toml"))["ada"].skeleton
    assert found.upper_arm == pytest.approx(own.upper_arm, abs=0.005)


def test_a_simulated_person_begins_again_where_a_move_cannot_be_used(calibrate, monkeypatch: pytest.MonkeyPatch) -> None:
    moves: list[str] = []

    def heard_at_the_second_time(step: Step, samples: Samples, begin_s: float) -> dict[str, ReceiverTrack]:
        moves.append(step.name)
        if len(moves) == 2:
            raise MoveError(f"{step.name}: the receiver chest was silent")
        return step_tracks(step, samples, begin_s)

    monkeypatch.setattr(gather, "step_tracks", heard_at_the_second_time)
    code, said = calibrate("tracker")
    assert code == 0, said
    assert f"Once more, from the beginning: {moves[1]}: the receiver chest was silent" in said.replace("\n", "")
    assert moves[2:] == [step.name for step in STEPS] and moves[:2] == moves[2:4]


def test_a_tracker_is_calibrated_from_moves_that_are_asked_for(calibrate, tmp_path: Path) -> None:
    code, said = calibrate("tracker")
    assert code == 0, said
    assert "Done. Thank you." in said and "The transmitter stands" in said
    # The transmitter of a simulated site stands 0.25 m over the floor under the seat. Ada's limbs, not yet measured, differ
    # from the average by centimetres.
    assert load_tracker(tmp_path / "ada-tracker.json").position == pytest.approx([0.0, 0.25, 0.0], abs=0.035)


def test_a_cyberglove_is_fitted_to_hands_that_are_asked_for(calibrate, tmp_path: Path) -> None:
    code, said = calibrate("glove", "left")
    assert code == 0, said
    assert "4 of 4, pinch." in said and "ada-glove-left: good." in said
    held = [line.split() for line in said.splitlines() if line.startswith("│")]
    assert [row[1] for row in held] == ["open", "fist", "spread", "pinch"]
    assert all(0.0 < float(row[3].rstrip("°")) < 2.0 for row in held)
    found = glove_calibration.load_calibration(tmp_path / "ada-left.json")
    assert found.gain[0] == pytest.approx(glove_calibration.default_calibration().gain[0], rel=0.05)


def test_a_data_glove_is_fitted_to_hands_that_are_asked_for(calibrate, tmp_path: Path) -> None:
    code, said = calibrate("glove", "right", "--json")
    assert code == 0, said
    table = json.loads(said[said.index("{") :])
    assert table["verdict"] == "good" and set(table["residuals_deg"]) == {"fist", "spread"}
    found = fivedt_calibration.load_calibration(tmp_path / "ada-right.json")
    # A simulated hand shows a fist of 80 and 100 degrees in a glove that was made for 85 and 100.
    assert found.fist["index_far"] == pytest.approx(fivedt_calibration.default_calibration().fist["index_far"], rel=0.02)


def test_nothing_on_the_port_is_reported_with_what_to_do(calibrate, tmp_path: Path) -> None:
    (tmp_path / "absent.toml").write_text(FILE.replace('kind = "KIND"', 'port = "/dev/no-such-port"'))
    for words in (("tracker", "absent.toml", "ada"), ("body", "absent.toml", "ada")):
        done = CliRunner().invoke(app, ["calibrate", *words])
        assert done.exit_code == 1
        (line,) = done.stderr.strip().splitlines()
        assert "no measurement from chest, head, left hand, right hand" in line and "plug the device in" in line
