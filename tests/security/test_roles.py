"""Who may do what to everybody's room: hosts, participants, observers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from world_site import CONFERENCE, WorldSite, scenario

from vistel.conference.model import RESERVED, Conference
from vistel.v1.command_pb2 import Command, CommandResult
from vistel.wire.topics import BY_NAME


@pytest.mark.parametrize("hosts", [set(), {"aiko"}], ids=["nobody-is-host", "aiko-is-host"])
def test_where_the_file_names_a_host_nobody_else_puts_the_room_back(tmp_path: Path, hosts: set[str]) -> None:
    async def play(site: WorldSite) -> None:
        await site.kill()
        site.config = replace(site.config, hosts=frozenset(hosts))
        await site.start()
        await site.play(0.3)
        for who in ("aiko", "bruno"):
            command = Command(id=who, participant=who, reset={})
            site.buses[who].publish(BY_NAME["command"], participant=who).put(command)
        while len(site.results()) < 2:
            await site.play(0.1)

    results = {r.id: r for r in scenario(tmp_path, play).results()}
    assert {w for w, r in results.items() if r.outcome == CommandResult.OUTCOME_DONE} == (hosts or {"aiko", "bruno"})
    if hosts:
        assert results["bruno"].reason == "only a host may put the room back: aiko"


def test_the_file_says_who_hosts_and_where() -> None:
    data = CONFERENCE.model_dump(mode="json", exclude_none=True)
    data["sites"][0]["participants"][0]["role"] = "host"
    assert Conference.model_validate(data).hosts == {"aiko": "tokyo"}


@pytest.mark.parametrize("name", RESERVED)
def test_no_site_and_no_observer_has_the_name_of_a_certificate_that_may_do_more(name: str) -> None:
    person = {"name": "ann"}
    with pytest.raises(ValueError, match="take another"):
        Conference.model_validate({"sites": [{"name": name, "participants": [person]}]})
    with pytest.raises(ValueError, match="take another"):
        Conference.model_validate({"sites": [{"name": "tokyo", "participants": [person]}], "observers": [name]})
