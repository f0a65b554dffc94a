"""Sentences of the room's own grammar, as commands on the bus, and what the world makes of them for everybody."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from world_site import WorldSite, scenario

from vistel.messages.commands import message_of
from vistel.space.actions import Action
from vistel.speech.grammar_file import load_grammar
from vistel.speech.meaning import asked_for
from vistel.v1.command_pb2 import CommandResult
from vistel.v1.world_pb2 import Thing
from vistel.wire.topics import BY_NAME
from vistel.wire.world.decoder import WorldDecoder

GRAMMAR, _ = load_grammar()


class Says:
    """aiko says sentences to the room."""

    def __init__(self, site: WorldSite) -> None:
        self.site, self.count = site, 0

    async def __call__(self, text: str, seconds: float = 0.2) -> CommandResult:
        said = GRAMMAR.read(text)
        assert said is not None, text
        action = asked_for(said.means)
        assert isinstance(action, Action), text
        self.count += 1
        command = message_of(action, f"c{self.count}", "aiko")
        command.header.t_ns = self.site.clock.now_ns()
        self.site.buses["aiko"].publish(BY_NAME["command"], participant="aiko").put(command)
        await self.site.play(seconds)
        (answer,) = [r for r in self.site.results() if r.id == command.id]
        return answer


async def words(site: WorldSite) -> None:
    say = Says(site)
    await site.play(0.5)

    def thing(name: str) -> Thing:
        return site.rooms()[-1].things[name]

    def exponents(name: str) -> list[float]:
        return list(thing(name).primitives[0].params[-2:])

    for sharper, rounder in (("はこをとがらせて", "はこをまるくして"), ("make the box sharper", "make the box round")):
        edges = exponents("box")
        assert list((await say(sharper)).things) == ["box"]
        assert exponents("box") < edges
        await say(rounder)
        assert exponents("box") > edges
        await say("もとにもどして")
        await say("undo")
        assert exponents("box") == edges

    for dent, hard in (("たまをへこませて", "はこをへこませて"), ("dent the ball", "dent the box")):
        assert list((await say(dent)).things) == ["ball"]
        (mark,) = site.rooms()[-1].dents.values()
        assert mark.thing == "ball"
        assert "too hard to be dented" in (await say(hard)).reason
        assert "cannot be dented" in (await say("つくえをへこませて")).reason
        await say("もとにもどして")
        assert not site.rooms()[-1].dents

    for hide, show in (("いたをかくして", "いたをみせて"), ("hide the tile", "show the tile"), ("いたをかくして", "みせて")):
        assert list((await say(hide)).things) == ["tile"]
        assert thing("tile").hidden
        assert (await say(show)).outcome == CommandResult.OUTCOME_DONE
        assert not thing("tile").hidden
    await say("hide the tile")

    loose = ("box", "can", "cone", "ring")  # a ball may roll on
    for line, back in (("ぜんぶそろえて", "もとにもどして"), ("line up everything", "undo")):
        assert set(loose) <= set((await say(line, 2.0)).things)
        room = site.rooms()[-1]
        rows = np.array([room.poses[n][0][[0, 2]] for n in loose])
        assert np.ptp(rows, axis=0).min() < 0.03
        assert (await say(back, 2.0)).outcome == CommandResult.OUTCOME_DONE
    assert "one thing alone" in (await say("はこをそろえて")).reason
    await site.play(4.0)


def test_the_words_for_edges_dents_rows_and_hiding_do_what_they_say(tmp_path: Path) -> None:
    site = scenario(tmp_path, words)
    (late,) = WorldDecoder().read(site.keys()[-1])
    assert late.things["tile"].hidden, "who comes late is shown what is hidden"
