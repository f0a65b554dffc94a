"""What somebody selects is told to every site, and drawn with a line and their name."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import pytest
from waiting import wait_until

from vistel.figure.posture.posture import standing
from vistel.geometry.pose import Pose
from vistel.messages.world.encoder import WorldEncoder
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld, thing_of, view_of
from vistel.render.things.outlines import HUES, colours_of
from vistel.render.view.camera import look_at
from vistel.space import actions as ask
from vistel.space.actions import Action
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, StepInputs
from vistel.space.room import meeting_room
from vistel.space.world import World
from vistel.wire.world.decoder import SnapshotBuilder, WorldDecoder

STEP_NS = 16_666_667


class Told:
    """A world, its encoder, who hears all of it, and what a late joiner is given."""

    def __init__(self) -> None:
        self.world, self.encoder = World(meeting_room(2)), WorldEncoder()
        self.hears, self.backlog = WorldDecoder(), SnapshotBuilder()
        self.step()

    def step(self, *commands: CommandInput, left: tuple[str, ...] = ()) -> None:
        k = self.world.step_number + 1
        people = tuple(ParticipantBody(n) for n in ("ann", "bob")) if k == 1 else ()
        motions = tuple(MotionInput(n, standing(), k, k * STEP_NS) for n in ("ann", "bob") if n not in left)
        said = self.encoder.encode(self.world.step(StepInputs(k, k * STEP_NS, people, motions, left, commands)))
        if said.whole is not None:
            self.backlog.key(said.whole)
            self.hears.begin(self.backlog.snapshot())
        if said.state is not None:
            self.backlog.add(said.state)
            self.hears.read(said.state)

    def say(self, who: str, action: Action) -> None:
        self.step(CommandInput(f"{who}{self.world.step_number}", who, action))
        self.step()

    def late(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        decoder = WorldDecoder()
        decoder.begin(self.backlog.snapshot())
        return decoder.now.selected


def test_everybody_hears_what_is_selected_late_ones_too() -> None:
    told = Told()
    told.say("ann", ask.Select(Which("box")))
    told.say("bob", ask.Select(Which(colour="green")))
    both = (("ann", ("box",)), ("bob", ("can",)))
    assert told.hears.now.selected == both == told.late()
    for _ in range(250):  # over two key frames
        told.step()
    assert told.hears.now.selected == both == told.late()
    assert view_of(told.hears.now, ()).selected == both


def test_an_end_of_it_is_heard_too() -> None:
    told = Told()
    told.say("ann", ask.Select(Which("box")))
    told.say("bob", ask.Select(Which("can")))
    told.say("ann", ask.Select(nothing=True))
    assert told.hears.now.selected == (("bob", ("can",)),)
    told.step(left=("bob",))
    told.step()
    assert told.hears.now.selected == () == told.late()


def test_colours_are_the_same_at_every_site_and_nobody_shares_one() -> None:
    names = ["chidi", "aiko", "bruno", "dora"]
    assert colours_of(names) == colours_of(reversed(names))
    assert len(set(colours_of(f"p{n}" for n in range(HUES)).values())) == HUES
    assert len(colours_of(f"p{n}" for n in range(40))) == 40


@pytest.mark.gl
def test_a_line_in_their_colour_goes_round_it_and_the_thing_stays_as_it_is() -> None:
    things = {t.id: t for t in meeting_room(2).things}
    poses = {t.id: Pose(t.position, t.rotation) for t in things.values()}
    studio = SceneRenderer(View(480, 270, "room", ""), 2)
    studio.camera = look_at(np.array([0.5, 1.3, 0.9]), things["ball"].position, 0.4)
    try:
        wait_until(lambda: studio.complete)

        def drawn(selected: tuple[tuple[str, tuple[str, ...]], ...]) -> np.ndarray:
            view = PlayoutWorld(1, poses, selected=selected)
            return studio.render(Instant(1, (), view, MappingProxyType(things)))[..., :3].astype(int)

        def share(picture: np.ndarray, who: str) -> int:
            return int((np.abs(picture - colours_of(["aiko", "bruno"])[who]).max(axis=2) < 40).sum())

        drawn(())
        bare = drawn(())
        ball = (("aiko", ("ball",)),)
        one, both = drawn(ball), drawn((*ball, ("bruno", ("ball",))))
        assert share(one, "aiko") > share(bare, "aiko") + 50
        assert share(both, "bruno") > share(one, "bruno") + 50
        middle = np.abs(one - bare)[130:140, 235:245].max()
        assert middle < 8
        assert np.array_equal(drawn(()), bare)
        drawn((("ann", ("gone", "table")),))
    finally:
        studio.close()


@pytest.mark.gl
def test_a_hidden_thing_is_not_in_the_picture_and_a_dented_one_is_seen_to_be() -> None:
    told = Told()
    studio = SceneRenderer(View(320, 180, "room", ""), 2)
    studio.painter.saves_shadows = False
    at = told.hears.now.poses["ball"][0]
    studio.camera = look_at(at + np.array([0.0, 0.45, -0.45]), at, 0.3)
    try:
        wait_until(lambda: studio.complete)

        def drawn() -> np.ndarray:
            now = told.hears.now
            things = MappingProxyType({name: thing_of(t) for name, t in now.things.items()})
            return studio.render(Instant(now.t_ns, (), view_of(now, ()), things))[..., :3].astype(int)

        def ball(picture: np.ndarray) -> int:
            """Pixels of its yellow, which the wood of the table has not."""
            return int(((picture[..., 1] > 110) & (picture[..., 2] < 0.45 * picture[..., 1])).sum())

        drawn()
        bare = drawn()
        assert ball(bare) > 200
        told.say("ann", ask.Hide(Which("ball")))
        assert ball(drawn()) < 0.02 * ball(bare)
        told.say("ann", ask.Select(Which("ball")))
        assert ball(drawn()) < 0.02 * ball(bare), "the line of a selection shows where it is"
        told.say("ann", ask.Select(nothing=True))
        told.say("ann", ask.Show())
        back = drawn()
        assert ball(back) > 0.97 * ball(bare)
        told.say("ann", ask.Dent(Which("ball"), 0.5))
        middle = np.abs(drawn() - back)[60:120, 130:190]
        assert (middle.max(axis=2) > 12).sum() > 50
    finally:
        studio.close()
