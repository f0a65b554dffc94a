"""The fixture `simulated_conference`: a whole meeting on one simulated clock, the same bytes in every run."""

from __future__ import annotations

from pathlib import Path

import pytest

import vistel.log
from vistel.conference.files import ConferenceError
from vistel.v1.command_pb2 import Command, CommandResult
from vistel.v1.device_pb2 import DeviceStatus
from vistel_sim.testing.fixtures import StartSimulatedConference

pytestmark = pytest.mark.slow

ONE = """
name = "test"
seed = {seed}

[[sites]]
name = "here"

[[sites.participants]]
name = "aiko"
"""
WITH_A_PHONE = ONE + '[sites.participants.face]\nkind = "live_link"\nport = "sim"\n'


def painted(thing: str) -> Command:
    command = Command()
    command.paint.which.thing, command.paint.colour = thing, 0x3366CCFF
    return command


def test_a_meeting_twice_gives_the_same_bytes_and_another_seed_others(simulated_conference: StartSimulatedConference) -> None:
    logs: list[bytes] = []
    for seed in (1, 1, 2):
        meeting = simulated_conference(ONE.format(seed=seed))
        meeting.live(4.0)
        meeting.ask("aiko", painted("ball"))
        meeting.live(1.0)
        assert meeting.now_s == pytest.approx(5.0)
        meeting.end()
        logs.append(meeting.log.read_bytes())
    assert logs[0] == logs[1]
    assert logs[0] != logs[2]


def streaming(log: Path) -> set[str]:
    """Devices that stream, or have."""
    return {
        r.message.device for r in vistel.log.open(log).messages("device_status") if r.message.state == DeviceStatus.STATE_STREAMING
    }


def test_two_people_meet_and_what_they_ask_for_is_done_or_refused(simulated_conference: StartSimulatedConference) -> None:
    meeting = simulated_conference()
    meeting.live_until(lambda: {"aiko-tracker", "ben-tracker"} <= streaming(meeting.log), "both trackers", within_s=10.0)
    for thing in ("ball", "unicorn"):
        meeting.ask("aiko", painted(thing))
    meeting.live(0.5)
    log = vistel.log.open(meeting.log)
    done, refused = CommandResult.OUTCOME_DONE, CommandResult.OUTCOME_REFUSED
    assert [r.message.outcome for r in log.messages("command_result")] == [done, refused]
    assert all(len(list(log.postures(who))) > 20 for who in ("aiko", "ben"))
    with pytest.raises(KeyError, match="carla"):
        meeting.ask("carla", painted("ball"))
    with pytest.raises(AssertionError, match=r"waited 1 s of the conference for a unicorn"):
        meeting.live_until(lambda: False, "a unicorn", within_s=1.0)


def test_an_unplugged_tracker_is_searched_for_and_comes_back(simulated_conference: StartSimulatedConference) -> None:
    meeting = simulated_conference(ONE.format(seed=1), faults=["aiko-tracker:unplug:4:1"])
    meeting.live(9.0)
    states = [
        (r.message.state, r.message.detail)
        for r in vistel.log.open(meeting.log).messages("device_status")
        if r.message.device == "aiko-tracker"
    ]
    assert (DeviceStatus.STATE_SEARCHING, "aiko-tracker: unplugged") in states
    assert states[-1][0] == DeviceStatus.STATE_STREAMING


@pytest.mark.parametrize(
    ("file", "faults", "said"),
    [
        (WITH_A_PHONE.format(seed=1), [], "only simulated trackers and gloves"),
        (ONE.format(seed=1), ["nobody:unplug:1:1"], "no simulated device 'nobody'"),
        (ONE.format(seed=1), ["aiko-tracker:sneeze:1:1"], "expected DEVICE:KIND:AT_S:FOR_S"),
    ],
)
def test_what_cannot_be_simulated_gets_one_line(
    simulated_conference: StartSimulatedConference, file: str, faults: list[str], said: str
) -> None:
    with pytest.raises(ValueError, match=said) as told:
        simulated_conference(file, faults=faults)
    assert "\n" not in str(told.value)


def test_a_file_that_is_not_there_is_named(simulated_conference: StartSimulatedConference, tmp_path: Path) -> None:
    with pytest.raises((OSError, ConferenceError), match=r"none\.toml"):
        simulated_conference(tmp_path / "none.toml")
