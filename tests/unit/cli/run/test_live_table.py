"""What `vistel up` shows while a conference runs."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable

import pytest
from rich.console import Console

from vistel.conference.device_list import devices_of_site
from vistel.conference.files import DEMO_FILE, load
from vistel.v1.audio_pb2 import SoundStatus
from vistel.v1.device_pb2 import DeviceStatus
from vistel.v1.service_pb2 import ImageDelay
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_cli.run.live_table import LEGEND, LEGEND_OF_VOICES, Events, LiveTable, sites_table
from vistel_cli.run.observer import Observer

DEMO = load(DEMO_FILE)
PEOPLE = ("aiko", "ben", "carla")


class Meeting:
    """The demo's messages, without its processes."""

    def __init__(self) -> None:
        network, clock = MemoryNetwork(), SimulatedClock(10**12)
        self.observer = Observer(DEMO, network.bus("demo", "hub", clock), clock)
        self._buses = {s.name: network.bus("demo", s.name, clock) for s in DEMO.sites}
        for site in DEMO.sites:
            self.image(site.name, *PEOPLE)
            for device in devices_of_site(site):
                self.device(site.name, device.name)
        self.observer.poll()

    def image(self, site: str, *people: str) -> None:
        message = ImageDelay(site=site, frames_per_s=13.04, frames=1)
        for name in people:
            message.streams.add(participant=name, delay_s=0.171)
        self._buses[site].publish(BY_NAME["image_delay"]).put(message)

    def device(self, site: str, name: str, state: DeviceStatus.State = DeviceStatus.STATE_STREAMING, **more: object) -> None:
        message = DeviceStatus(device=name, state=state, **more)  # pyright: ignore[reportArgumentType]
        self._buses[site].publish(BY_NAME["device_status"], device=name).put(message)

    def sound(self, site: str, *heard: str) -> None:
        message = SoundStatus(site=site, acoustic_known=True)
        for name in heard:
            message.streams.add(participant=name, talking=True, target_s=0.149, actual_s=0.149, skew_s=-0.012)
        self._buses[site].publish(BY_NAME["sound_status"]).put(message)


def during(check: Callable[[Meeting], None]) -> None:
    async def main() -> None:
        check(Meeting())

    asyncio.run(main())


def shown(meeting: Meeting, columns: int) -> list[str]:
    meeting.observer.poll()
    console = Console(width=columns, force_terminal=False)
    with console.capture() as capture:
        console.print(sites_table(DEMO, meeting.observer))
    return [line.rstrip() for line in capture.get().splitlines()]


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_a_row_for_each_site_fits_any_terminal(columns: int) -> None:
    def check(meeting: Meeting) -> None:
        meeting.sound("tokyo", "ben", "carla")
        lines = shown(meeting, columns)
        assert max(map(len, lines)) <= columns
        assert lines[0].split() == ["site", "pictures/s", "delay", "devices", "voices"]
        assert lines[1].split()[:7] == ["tokyo", "13.0", "171", "ms", "3", "of", "3"]
        assert "ben 149 ms (-12)" in lines[1]

    during(check)


def test_what_a_start_waits_for_is_named_with_what_the_device_says() -> None:
    def check(meeting: Meeting) -> None:
        assert meeting.observer.missing() == ["the world"]
        meeting.device("columbus", "ben-tracker", DeviceStatus.STATE_SEARCHING, detail="/dev/ttyUSB0: is not there")
        meeting.observer.poll()
        assert meeting.observer.missing() == ["device ben-tracker (/dev/ttyUSB0: is not there)", "the world"]

    during(check)


def test_a_device_that_fails_and_comes_back_is_reported_once_each_time() -> None:
    def check(meeting: Meeting) -> None:
        events = Events(meeting.observer)
        assert list(events.new()) == []
        meeting.device("columbus", "ben-tracker", DeviceStatus.STATE_STALLED, detail="silent for 1.0 s")
        meeting.observer.poll()
        assert list(events.new()) == ["ben-tracker fails: silent for 1.0 s"]
        assert "2 of 3" in shown(meeting, 80)[2]
        assert list(events.new()) == []
        meeting.device("columbus", "ben-tracker", bytes_skipped=4000)
        meeting.observer.poll()
        assert list(events.new()) == ["ben-tracker sends again", "ben-tracker sent 4000 bytes that are no frame"]

    during(check)


def test_a_device_that_nobody_uses_is_awaited_and_counted_by_nobody() -> None:
    def check(meeting: Meeting) -> None:
        events = Events(meeting.observer)
        absent, sends, searches = DeviceStatus.STATE_ABSENT, DeviceStatus.STATE_STREAMING, DeviceStatus.STATE_SEARCHING
        for state, counted, told in (
            (absent, "2 of 2", []),
            (sends, "3 of 3", []),
            (absent, "2 of 2", []),
            (searches, "2 of 3", ["ben-tracker fails: no port"]),
        ):
            meeting.device("columbus", "ben-tracker", state, detail="no port")
            assert counted in shown(meeting, 80)[2]
            assert list(events.new()) == told
            assert ("device ben-tracker (no port)" in meeting.observer.missing()) == bool(told)
        for device in ("ben-tracker", "ben-glove-left", "ben-glove-right"):
            meeting.device("columbus", device, absent)
        assert shown(meeting, 80)[2].split()[-1] == "-"

    during(check)


def test_what_happens_to_several_devices_at_once_is_one_line() -> None:
    def check(meeting: Meeting) -> None:
        events = Events(meeting.observer)
        devices = [(s.name, d.name) for s in DEMO.sites for d in devices_of_site(s)]
        for site, device in devices:
            meeting.device(site, device, DeviceStatus.STATE_SEARCHING, detail=f"/tmp/run/dev/{device}: unplugged")
        meeting.observer.poll()
        assert list(events.new()) == ["aiko-tracker, aiko-glove-left and 7 more devices fail: unplugged"]
        for site, device in devices[:2]:
            meeting.device(site, device)
        meeting.observer.poll()
        assert list(events.new()) == ["aiko-tracker and aiko-glove-left send again"]

    during(check)


def test_a_device_that_is_only_starting_does_not_fail() -> None:
    def check(meeting: Meeting) -> None:
        events = Events(meeting.observer)
        meeting.device("columbus", "ben-tracker", DeviceStatus.STATE_STARTING, detail="starting")
        meeting.observer.poll()
        assert list(events.new()) == ["ben-tracker is starting"]
        meeting.device("columbus", "ben-tracker", DeviceStatus.STATE_SEARCHING, detail="nothing answers")
        meeting.observer.poll()
        assert list(events.new()) == ["ben-tracker fails: nothing answers"]
        meeting.device("columbus", "ben-tracker", DeviceStatus.STATE_STARTING, detail="starting")
        meeting.observer.poll()
        assert list(events.new()) == []
        meeting.device("columbus", "ben-tracker")
        meeting.observer.poll()
        assert list(events.new()) == ["ben-tracker sends again"]

    during(check)


def test_a_port_that_does_not_open_is_reported_before_the_conference_is_ready() -> None:
    def check(meeting: Meeting) -> None:
        events = Events(meeting.observer)
        for name in ("ben-tracker", "dora-tracker"):
            meeting.device("columbus", name, DeviceStatus.STATE_SEARCHING, detail="/dev/ttyUSB0: is not there; plug the device in")
        meeting.observer.poll()
        assert list(events.troubles({"ben-tracker"})) == ["dora-tracker fails: /dev/ttyUSB0: is not there; plug the device in"]

    during(check)


def test_who_joins_and_who_leaves_is_reported() -> None:
    def check(meeting: Meeting) -> None:
        events = Events(meeting.observer)
        meeting.image("tokyo", *PEOPLE, "dora")
        meeting.observer.poll()
        assert list(events.new()) == ["dora joined"]
        for site in DEMO.sites:
            meeting.image(site.name, "aiko", "ben")
        meeting.observer.poll()
        assert list(events.new()) == ["carla left", "dora left"]

    during(check)


def test_what_others_saw_goes_above_the_table() -> None:
    def check(meeting: Meeting) -> None:
        console, events = Console(width=60, force_terminal=False), Events(meeting.observer)
        with console.capture() as capture, LiveTable(DEMO, meeting.observer, events, console, 60.0, silent=False) as table:
            events.add("tokyo/renderer ended (SIGKILL); starting it again")
            table.update(3.0)
            table.update(4.0)
        assert capture.get() == "0:03  tokyo/renderer ended (SIGKILL); starting it again\n"

    during(check)


def test_where_there_is_no_terminal_events_are_lines_and_the_table_is_not_drawn() -> None:
    def check(meeting: Meeting) -> None:
        console = Console(width=80, force_terminal=False)
        with (
            console.capture() as capture,
            LiveTable(DEMO, meeting.observer, Events(meeting.observer), console, 60.0, silent=False) as table,
        ):
            meeting.device("tokyo", "aiko-tracker", DeviceStatus.STATE_SEARCHING, detail="its port is absent")
            meeting.observer.poll()
            table.update(72.4)
        assert capture.get().strip() == "1:12  aiko-tracker fails: its port is absent"

    during(check)


def test_a_terminal_shows_the_legend() -> None:
    def check(meeting: Meeting) -> None:
        console = Console(width=60, force_terminal=True)
        meeting.sound("tokyo", "ben")
        meeting.observer.poll()
        with (
            console.capture() as capture,
            LiveTable(DEMO, meeting.observer, Events(meeting.observer), console, 60.0, silent=False) as table,
        ):
            table.update(12.0)
        said = " ".join(re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", capture.get()).split())
        assert "0:12 of 1:00" in said
        assert LEGEND + LEGEND_OF_VOICES in said

    during(check)
