"""The world service on a bus: people, grasps, commands, late joiners, crashes."""

from __future__ import annotations

import asyncio
import importlib.util
import statistics
from pathlib import Path
from typing import Any

import pytest
from world_site import WorldSite, scenario

from vistel.session.asking import Answer
from vistel.session.session import AsyncSession
from vistel.space.room import meeting_room
from vistel.v1.command_pb2 import Command, CommandResult, MoveThing, ResetRoom
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.wire.topics import BY_NAME, Delivery
from vistel.wire.world.decoder import WorldDecoder

DONE, REFUSED = CommandResult.OUTCOME_DONE, CommandResult.OUTCOME_REFUSED


def ask(site: WorldSite, who: str, command: Command) -> None:
    command.header.t_ns = site.clock.now_ns()
    site.buses[who].publish(BY_NAME["command"], participant=who).put(command)


def move(thing: str, x: float, y: float, z: float) -> MoveThing:
    return MoveThing(thing=thing, pose=Pose(position=Vec3(x=x, y=y, z=z)))


def holders(site: WorldSite) -> list[list[str]]:
    """Who holds the baton, each change."""
    out: list[list[str]] = []
    for room in site.rooms():
        now = [g.participant for g in room.grasps if g.thing == "baton"]
        if not out or out[-1] != now:
            out.append(now)
    return out


def test_people_come_and_the_room_is_published_sixty_times_a_second(tmp_path: Path) -> None:
    site = scenario(tmp_path, lambda s: s.play(1.5))
    rooms = site.rooms()
    assert 88 <= len(rooms) <= 91
    assert [r.step for r in rooms] == list(range(rooms[0].step, rooms[0].step + len(rooms)))
    assert rooms[-1].participants == ("aiko", "bruno", "chidi")
    assert len(rooms[-1].things) == 12 and rooms[-1].things.keys() == rooms[-1].poses.keys()
    assert any((t.target, t.source) == ("aiko", "chair-0") and t.limbs and t.force > 0 for t in rooms[-1].touches)


def test_a_key_is_whole_and_can_be_read_by_itself(tmp_path: Path) -> None:
    site = scenario(tmp_path, lambda s: s.play(4.2))
    first, *_, key = site.keys()
    assert first.step == site.rooms()[0].step
    assert {t.id for t in key.things} == {s.id for s in key.states}
    assert any(c.body_a == "aiko" and c.body_b == "chair-0" and c.force > 0 for c in key.contacts)
    assert any(g.target == "aiko" and g.source == "chair-0" and g.depth > 0 for g in key.ghosts)
    assert WorldDecoder().read(key)[0].poses.keys() == {t.id for t in key.things}


def test_where_nothing_moves_and_nobody_new_touches_little_is_published(tmp_path: Path) -> None:
    site = scenario(tmp_path, lambda s: s.play(1.0))
    changes = [m for topic, _, m, _ in site.log if topic == "world_state" and not m.key]
    assert not any(m.things or m.states or m.contacts for m in changes)
    assert statistics.median(len(m.frame) for m in changes) < 8


def test_the_baton_goes_from_hand_to_hand(tmp_path: Path) -> None:
    site = scenario(tmp_path, lambda s: s.play(5.0, from_s=2.2))
    assert holders(site) == [[], ["aiko"], ["aiko", "bruno"], ["bruno"]]


def test_a_late_joiner_gets_the_whole_room(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(1.2)
        assert site.asking is not None
        snapshot = await site.asking.query(BY_NAME["world_snapshot"])
        assert snapshot is not None
        assert snapshot.state.key
        assert len(snapshot.state.things) == len(snapshot.state.states) == 12
        assert list(snapshot.state.participants) == ["aiko", "bruno", "chidi"]
        assert not snapshot.private_state, "that is for worlds and hosts"

    scenario(tmp_path, play)


def test_commands_are_answered_once_done_and_refused_with_a_reason(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        ask(site, "aiko", Command(id="1", participant="aiko", move=move("ball", 0.0, 0.9, 0.2)))
        ask(site, "aiko", Command(id="2", participant="aiko", move=move("unicorn", 0.0, 0.9, 0.2)))
        ask(site, "aiko", Command(id="3", participant="aiko", move=move("ball", float("nan"), 0.9, 0.2)))
        ask(site, "aiko", Command(id="4", participant="bruno", reset=ResetRoom()))
        ask(site, "aiko", Command(id="5", participant="aiko", move=move("table", 0.0, 0.9, 0.2)))
        ask(site, "aiko", Command(id="6", participant="aiko"))
        await site.play(0.2)
        ask(site, "aiko", Command(id="1", participant="aiko", move=move("ball", 1.0, 0.9, 0.2)))
        await site.play(0.2)

    site = scenario(tmp_path, play)
    found = {r.id: (r.outcome, r.reason) for r in site.results()}
    assert found["1"] == (DONE, "")
    assert found["2"][0] == REFUSED and "unicorn" in found["2"][1]
    assert found["3"][0] == REFUSED and "finite" in found["3"][1]
    assert found["4"][0] == REFUSED
    assert found["5"][0] == REFUSED and "fixed" in found["5"][1]
    assert found["6"][0] == REFUSED
    assert [r.id for r in site.results()].count("1") == 2
    assert abs(site.rooms()[-1].poses["ball"][0][0]) < 0.2, "a command sent twice was done twice"


def test_a_flood_of_commands_is_refused_and_the_world_goes_on(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.2)
        for n in range(200):
            ask(site, "aiko", Command(id=f"flood-{n}", participant="aiko", move=move("ball", 0.0, 1.0, 0.2)))
        await site.play(0.5)

    site = scenario(tmp_path, play)
    results = site.results()
    assert len(results) == 200
    assert sum(r.outcome == DONE for r in results) <= 25
    assert any("too many" in r.reason for r in results)
    assert len(site.rooms()) > 35


def test_who_falls_silent_leaves_and_what_they_held_falls(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(2.0, from_s=2.4)
        assert holders(site)[-1] == ["aiko"]
        site.away.add("aiko")
        await site.play(7.0)
        assert "aiko" not in site.rooms()[-1].participants
        assert holders(site)[-1] == []
        site.away.clear()
        await site.play(0.3)
        assert "aiko" in site.rooms()[-1].participants

    scenario(tmp_path, play)


def test_a_site_that_goes_takes_its_people_along(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.5)
        site.away.add("chidi")
        await site.buses["chidi"].close()
        await site.play(1.5)
        assert "chidi" in site.rooms()[-1].participants
        await site.play(1.0)
        assert "chidi" not in site.rooms()[-1].participants

    scenario(tmp_path, play)


def test_a_killed_world_goes_on_where_it_was(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(3.0, from_s=2.2)
        ask(site, "bruno", Command(id="away", participant="bruno", move=move("tile", 0.3, 0.73, -0.1)))
        await site.play(1.2)
        before = site.rooms()[-1]
        await site.kill()
        await site.play(1.0)
        await site.start()
        count = len(site.rooms())
        await site.play(0.5)
        after = site.rooms()[count]
        assert after.step > before.step
        assert after.poses["tile"][0][0] == pytest.approx(0.3, abs=0.02)
        assert site.rooms()[-1].participants == ("aiko", "bruno", "chidi")
        assert site.rooms()[-1].t_ns - before.t_ns < 3e9

    scenario(tmp_path, play)


@pytest.mark.parametrize("damage", [b"", b"{", b'{"version":99}', b'{"version":1,"seats":3}', b"\x00" * 100])
def test_a_damaged_snapshot_starts_a_fresh_world(tmp_path: Path, damage: bytes) -> None:
    damaged = tmp_path / "run" / "room" / "000000-00000000000007.snapshot"
    damaged.parent.mkdir(parents=True)
    damaged.write_bytes(damage)
    site = scenario(tmp_path, lambda s: s.play(0.3))
    assert len(site.rooms()) > 10
    assert next(tmp_path.rglob(damaged.name)).read_bytes() == damage, "what cannot be read was not kept"


def test_corrupt_payloads_on_every_topic_do_not_stop_the_world(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.2)
        for name in ("participant", "motion", "command"):
            topic = BY_NAME[name]
            key = topic.format(conference="demo", site="tokyo", participant="aiko")
            for payload in (b"\xff" * 40, b"", b"\x0a\x02\x08\x09", bytes(range(256))):
                site.network.send(topic, key, payload)
                if topic.delivery is Delivery.RELIABLE:
                    site.network._last.pop(key, None)
        await site.play(0.5)

    site = scenario(tmp_path, play)
    assert len(site.rooms()) > 35
    assert "aiko" in site.rooms()[-1].participants


def test_a_snapshot_that_cannot_be_written_is_reported_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("a file where the folder should be")
    site = scenario(tmp_path, lambda s: s.play(2.2))
    assert len(site.rooms()) > 120


def test_a_line_from_a_console_is_done_or_refused_and_everybody_sees_what_became_of_it(tmp_path: Path) -> None:
    said = ["bend the red baton 60", "larger ball", "create a pink ring", "delete the unicorn", "undo"]
    answers: list[Answer] = []

    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        session = AsyncSession(site.buses["aiko"], site.clock, "aiko")
        for line in said:
            asking = asyncio.create_task(session.ask(line))
            await site.play(0.2)
            answers.append(await asking)
        session.close()

    site = scenario(tmp_path, play)
    assert answers == [
        Answer(True, ("baton",), ""),
        Answer(True, ("ball",), ""),
        Answer(True, ("ring-2",), ""),
        Answer(False, (), "there is no unicorn in the room"),
        Answer(True, ("ring-2",), ""),
    ]
    things = site.rooms()[-1].things
    assert things["baton"].HasField("curve")
    assert things["ball"].primitives[0].params[0] == pytest.approx(0.057)
    assert "ring-2" not in things


def example(name: str) -> Any:
    path = Path(__file__).parents[3] / "examples/activities" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_an_activity_makes_atoms_that_stick_when_they_are_brought_together(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        session = AsyncSession(site.buses["aiko"], site.clock, "aiko")
        activity = asyncio.create_task(example("molecule").build_water(session))
        await site.play(1.5)
        at = session.room.things["ball-2"].position
        for n, atom in enumerate(("ball-3", "ball-4")):
            place = move(atom, at[0] + 0.075 * (-1) ** n, at[1], at[2])
            ask(site, "bruno", Command(id=atom, participant="bruno", move=place))
            await site.play(0.8)
        await activity
        assert session.room.things["ball-2"].name == "red ball 2 with white ball 3 with white ball 4"
        session.close()

    scenario(tmp_path, play)


def test_an_activity_hardens_what_nobody_has_touched_for_a_while(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kiln = example("kiln")
    monkeypatch.setattr(kiln, "REST_S", 1.0)

    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        session = AsyncSession(site.buses["aiko"], site.clock, "aiko")
        asking = asyncio.create_task(session.ask("soften ball"))
        await site.play(0.2)
        assert (await asking).done
        while "ball" not in session.room.things:  # until the room has come
            await site.play(0.1)
        soft, activity = session.room.things["ball"], asyncio.create_task(kiln.kiln(session, "ball"))
        await site.play(0.8)
        assert not activity.done()
        await site.play(1.0)
        await activity
        fired = site.rooms()[-1].things["ball"]
        assert fired.compliance == 0.0
        assert session.room.things["ball"].colour != soft.colour
        session.close()

    scenario(tmp_path, play)


def test_an_activity_paints_what_lies_on_its_place_and_ends_when_everything_does(tmp_path: Path) -> None:
    puzzle = example("puzzle")

    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        session = AsyncSession(site.buses["aiko"], site.clock, "aiko")
        activity = asyncio.create_task(puzzle.puzzle(session))
        for thing, (x, z) in puzzle.PLACES.items():
            place = move(thing, x, 0.79, z)
            q = meeting_room(3).thing(thing).rotation
            place.pose.rotation.x, place.pose.rotation.y, place.pose.rotation.z, place.pose.rotation.w = q.tolist()
            ask(site, "bruno", Command(id=thing, participant="bruno", move=place))
            await site.play(0.6)
        await site.play(1.0)
        assert activity.done(), {k: t.position for k, t in session.room.things.items()}
        session.close()

    scenario(tmp_path, play)
