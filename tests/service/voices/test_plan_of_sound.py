"""Processes of a site with sound, whatever its file says of processes."""

from __future__ import annotations

from typing import Any

from vistel.conference.model import Conference
from vistel_services.process.plan import site_processes

UNIT = {"name": "unit", "role": "delay"}


def services(
    audio: dict[str, Any] | None, processes: list[list[str]] | None, speech: dict[str, Any] | None = None
) -> list[tuple[str, ...]]:
    site: dict[str, Any] = {"name": "tokyo", "participants": [{"name": "ann"}]}
    if audio is not None:
        site["audio"] = audio
    if speech is not None:
        site["speech"] = speech
    if processes is not None:
        site["processes"] = processes
    return [plan.services for plan in site_processes(Conference.model_validate({"sites": [site]}), "tokyo")]


def test_a_site_with_sound_has_a_process_for_it_although_its_file_names_none() -> None:
    mine = [["tracker", "posture"], ["renderer"]]
    assert services({}, mine) == [("tracker", "posture"), ("renderer",), ("audio",)]
    assert services({"equipment": [UNIT]}, mine) == [("tracker", "posture"), ("renderer",), ("audio", "delay")]
    assert services(None, mine) == [("tracker", "posture"), ("renderer",)]


def test_a_site_that_is_spoken_to_has_a_process_for_that_although_its_file_names_none() -> None:
    mine = [["tracker", "posture"], ["renderer"]]
    assert services({}, mine, {}) == [("tracker", "posture"), ("renderer",), ("speech",), ("audio",)]
    assert services({}, [["audio", "speech"], ["renderer"]], {}) == [("audio", "speech"), ("renderer",)]
    assert ("speech",) in services({}, None, {})
    assert "speech" not in {name for group in services({}, mine, None) for name in group}


def test_equipment_is_kept_where_the_sound_is_and_what_the_file_names_stays_where_it_names_it() -> None:
    assert services({"equipment": [UNIT]}, [["audio"], ["renderer"]]) == [("audio", "delay"), ("renderer",)]
    assert services({"equipment": [UNIT]}, [["delay"], ["renderer"]]) == [("delay",), ("renderer",), ("audio",)]
    usual = services({}, None)
    assert services({"equipment": [UNIT]}, None) == usual == services(None, None)
