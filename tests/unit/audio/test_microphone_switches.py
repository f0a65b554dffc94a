"""Who opens and closes a microphone."""

from __future__ import annotations

from pathlib import Path

from vistel.audio.microphone_switches import MicrophoneSwitches
from vistel.v1.audio_pb2 import VoiceControl


def control(t_ns: int, *, muted: bool = False) -> VoiceControl:
    message = VoiceControl(participant="ann", muted=muted)
    message.header.t_ns = t_ns
    return message


def test_the_host_closes_a_microphone_and_its_participant_opens_it_again(tmp_path: Path) -> None:
    switches = MicrophoneSwitches({"ann": False}, tmp_path / "switches.json")
    switches.mute("ann", 10)
    switches.mute("nobody", 10)
    assert not switches["ann"].open
    switches.follow("ann", control(20))
    assert switches["ann"].open
    switches.mute("ann", 10)  # the host's word again, as a service gets it that was started again
    assert switches["ann"].open
    again = MicrophoneSwitches({"ann": False}, tmp_path / "switches.json")
    again.mute("ann", 10)
    assert again["ann"].open
    again.mute("ann", 30)
    assert not MicrophoneSwitches({"ann": False}, tmp_path / "switches.json")["ann"].open
