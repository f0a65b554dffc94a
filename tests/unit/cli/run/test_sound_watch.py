"""What the console says of a conference's sound, from the messages of its sites."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from rich.console import Console

from vistel.v1.audio_pb2 import EquipmentStatus, SoundStatus
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_cli.run.sound_watch import MOST_KEPT, SoundWatch, newest
from vistel_cli.voice.voice import _device_line, _site_lines


def told(*, actual_s: float = 0.212, talking: bool = True, acoustic_known: bool = True) -> SoundStatus:
    message = SoundStatus(site="tokyo", policy="match", loudspeaker="Headset", acoustic_known=acoustic_known)
    message.streams.add(
        participant="ben",
        target_s=0.212,
        actual_s=actual_s,
        image_s=0.211,
        skew_s=actual_s - 0.211,
        talking=talking,
        frames=100,
        concealed=2,
    )
    message.microphones.add(participant="aiko", source="Microphone", open=True, level_db=-20.0, clipped=True)
    message.microphones.add(participant="bo", source="", open=False, detail="no sound card with inputs is attached")
    return message


def watched(*messages: SoundStatus, use: Callable[[SoundWatch], object]) -> None:
    async def main() -> None:
        network, clock = MemoryNetwork(), SimulatedClock(10**12)
        watch = SoundWatch(network.bus("c", "hub", clock))
        publication = network.bus("c", "tokyo", clock).publish(BY_NAME["sound_status"])
        for message in messages:
            publication.put(message)
        watch.poll()
        use(watch)

    asyncio.run(main())


def test_who_speaks_is_shown_with_mouth_to_ear_and_skew_and_the_target_where_it_is_not_reached() -> None:
    wrong = ["bo: no microphone: no sound card with inputs is attached", "aiko is too loud"]
    watched(told(), use=lambda w: shows(w, ["ben 212 ms (+1)"], wrong))
    watched(told(actual_s=0.25), use=lambda w: shows(w, ["ben 250 ms (wanted 212, +39)"], wrong))
    watched(told(talking=False, acoustic_known=False), use=lambda w: shows(w, [], [*wrong, "acoustic delay unknown"]))


def shows(watch: SoundWatch, heard: list[str], warnings: list[str]) -> None:
    assert (watch.heard("tokyo"), watch.warnings("tokyo")) == (heard, warnings)


def test_the_report_has_target_mouth_to_ear_and_skew_of_each_voice() -> None:
    def check(watch: SoundWatch) -> None:
        ben = watch.report(["tokyo", "oslo"])["tokyo"]["voices"]["ben"]
        assert ben["target_s_median"] == pytest.approx(0.212)
        assert ben["mouth_to_ear_s_median"] == pytest.approx(0.212)
        assert ben["skew_s_median"] == pytest.approx(0.001)

    watched(told(), told(), told(), use=check)


def test_the_watch_shows_everything_that_a_site_publishes() -> None:
    console = Console(record=True, width=110, file=None, force_terminal=False)
    unit = EquipmentStatus(equipment="unit", state=EquipmentStatus.STATE_OBSERVED, delay_known=True, acoustic_s=0.1213)
    with console.capture() as capture:
        console.print(*_site_lines(told()), _device_line(unit), sep="\n")
    text = capture.get()
    for part in (
        "delay match",
        "loudspeaker Headset",
        "too loud",
        "no sound card with inputs",
        "wanted  212 ms",
        "heard  212 ms",
        "picture  211 ms",
        "skew   +1 ms",
        "made up 2.0 %",
        "unit",
        "observed",
        "121.3 ms",
    ):
        assert part in text


def test_a_conference_of_days_keeps_only_the_newest_figures() -> None:
    kept = newest()
    kept.extend(float(n) for n in range(MOST_KEPT + 10))
    assert len(kept) == MOST_KEPT and kept[0] == 10.0
