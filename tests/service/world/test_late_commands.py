"""Commands that come too late are answered with the reason, and never done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from world_site import WorldSite, scenario

from vistel.v1.command_pb2 import Command, CommandResult, MoveThing
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.wire.motion import MotionSample
from vistel.wire.topics import BY_NAME

S = 1_000_000_000


def ask(site: WorldSite, who: str, name: str, late_s: float) -> None:
    place = Pose(position=Vec3(x=0.3, y=0.8, z=-0.2))
    command = Command(id=name, participant=who, move=MoveThing(thing="tile", pose=place))
    command.header.t_ns = site.clock.now_ns() - round(late_s * S)
    site.buses[who].publish(BY_NAME["command"], participant=who).put(command)


def send_behind(site: WorldSite, who: str, behind_s: float) -> None:
    """One motion, as a site stamps it whose clock is behind."""
    p = site.posture(who, 1.0)
    publication = site.buses[who].publish(BY_NAME["motion"], participant=who)
    stance = np.array([*p.stance.position, p.stance.heading])
    t_ns = site.clock.now_ns() - round(behind_s * S)
    publication.put(site.encoders[who].encode(MotionSample(publication.next_seq, t_ns, p.dofs, p.hands, stance, p.gaze)))


def test_a_late_command_is_refused_with_the_reason_and_one_that_was_answered_is_not_answered_again(tmp_path: Path) -> None:
    async def play(site: WorldSite) -> None:
        site.away.add("bruno")
        send_behind(site, "bruno", 93.0)
        await site.play(0.5)
        ask(site, "aiko", "in time", 0.0)
        await site.play(0.3)
        ask(site, "aiko", "held back", 9.0)
        ask(site, "bruno", "behind", 93.0)
        ask(site, "aiko", "in time", 60.0)
        await site.play(0.3)

    site = scenario(tmp_path, play)
    answers = [(r.id, r.outcome == CommandResult.OUTCOME_DONE, r.reason) for r in site.results()]
    assert [(name, done) for name, done, _ in answers] == [("in time", True), ("held back", False), ("behind", False)]
    assert answers[1][2] == "it came 9 s after it was asked; ask again"
    assert answers[2][2].startswith("the clock of paris is 93 s behind the conference's")
