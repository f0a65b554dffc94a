"""Who leads a held thing: claims, leases, force, and what the others are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_world_steps import START, STEP_NS, Play, at, reaching, take_baton

from vistel.space.actions import Attach, Grip, Move
from vistel.space.arguments import Which
from vistel.space.hands.claims import ClaimChange, ClaimEvent
from vistel.space.holding.ownership import LEASE_NS
from vistel.space.inputs import CommandInput
from vistel.space.room import BATON, TABLE_HEIGHT
from vistel.space.world import World

LEASE_STEPS = LEASE_NS // STEP_NS
FAR = at(0.064, 0.25, 0.0)
"""The other end, from the other side of the table."""


def told(play: Play, who: str) -> list[ClaimEvent]:
    return [e for v in play.views for e in v.claims if e.participant == who]


def taken_up(play: Play) -> None:
    """ann holds the baton 25 cm above where it lay."""
    take_baton(play)
    for k in range(26):
        play.step({"ann": reaching(at(0.0, 0.01 * k, 0.0), 1.0)})


def both(play: Play) -> None:
    """bob holds it too."""
    taken_up(play)
    for k in range(40):
        play.step({"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(FAR, min(1.0, k / 25), np.pi)})
    assert play.grasps() == ["ann", "bob"]


def test_who_takes_hold_first_has_the_claim_and_the_next_learns_whose_it_is() -> None:
    play = Play("ann", "bob")
    both(play)
    (granted,) = told(play, "ann")
    assert (granted.change, granted.thing, granted.owner) == (ClaimChange.GRANTED, BATON, "ann")
    (rejected,) = told(play, "bob")
    assert (rejected.change, rejected.owner) == (ClaimChange.REJECTED, "ann")
    step = next(v for v in play.views if rejected in v.claims)
    assert rejected.until_ns == step.t_ns + LEASE_NS
    assert play.thing(BATON).holders == ("ann", "bob")


def test_at_a_hand_over_the_claim_goes_to_who_still_holds() -> None:
    play = Play("ann", "bob")
    both(play)
    for k in range(30):
        play.step({"ann": reaching(at(0.0, 0.25, 0.0), max(0.0, 1.0 - k / 15)), "bob": reaching(FAR, 1.0, np.pi)})
    assert [e.change for e in told(play, "ann")] == [ClaimChange.GRANTED, ClaimChange.RELEASED]
    assert [e.change for e in told(play, "bob")] == [ClaimChange.REJECTED, ClaimChange.GRANTED]
    assert told(play, "ann")[-1].owner == "bob"


def test_what_somebody_holds_who_is_not_heard_of_falls_free_after_the_lease() -> None:
    play = Play("ann")
    taken_up(play)
    for _ in range(LEASE_STEPS - 1):
        play.step({})
    assert play.grasps() == ["ann"]
    for _ in range(3):
        play.step({})
    assert play.grasps() == []
    assert [(e.change, e.owner) for e in told(play, "ann")][1:] == [(ClaimChange.EXPIRED, "")]
    for _ in range(90):
        play.step({})
    assert play.thing(BATON).position[1] < TABLE_HEIGHT + 0.08


def test_the_lease_goes_on_for_as_long_as_the_owner_moves() -> None:
    play = Play("ann")
    taken_up(play)
    for _ in range(3 * LEASE_STEPS):
        play.step({"ann": reaching(at(0.0, 0.25, 0.0), 1.0)})
    assert play.grasps() == ["ann"]


def test_after_the_crash_of_one_holder_the_other_leads() -> None:
    play = Play("ann", "bob")
    both(play)
    for _ in range(LEASE_STEPS + 3):
        play.step({"bob": reaching(FAR, 1.0, np.pi)})
    assert play.grasps() == ["bob"]
    assert [e.change for e in told(play, "bob")][-1] is ClaimChange.GRANTED


def test_time_in_which_the_world_stood_still_costs_nobody_their_claim() -> None:
    play = Play("ann")
    taken_up(play)
    world = World.restore(play.world.snapshot())
    later = replace(play.inputs[-1], step=play.k + 400, t_ns=play.inputs[-1].t_ns + 400 * STEP_NS, motions=())
    assert [g.participant for g in world.step(later).grasps] == ["ann"]


def test_of_two_who_take_a_thing_in_one_step_the_nearer_leads_and_the_other_gets_an_answer() -> None:
    for names in (("ann", "bob"), ("bob", "ann")):
        play = Play(*names)
        near, off = names
        for k in range(25):
            play.step(
                {
                    # A hand that is lower is nearer; both close by as much.
                    near: reaching(START + np.array([-0.05, 0.0, 0.0]), k / 20),
                    off: reaching(START + np.array([0.05, 0.002, 0.0]), k / 20, np.pi),
                }
            )
            if play.grasps():
                break
        assert play.grasps() == [near, off]  # in one step
        assert [(e.change, e.participant) for e in play.views[-1].claims] == [
            (ClaimChange.GRANTED, near),
            (ClaimChange.REJECTED, off),
        ]


def test_asking_for_a_thing_somebody_holds_is_rejected_and_by_force_takes_it() -> None:
    play = Play("ann", "bob")
    taken_up(play)
    hands = {"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(FAR, 0.2, np.pi)}
    for _ in range(5):
        play.step(hands)
    view = play.step(hands, CommandInput("1", "bob", Grip(Which(BATON))))
    assert not view.outcomes[0].done and "held by ann" in view.outcomes[0].reason
    assert [(e.change, e.owner) for e in told(play, "bob")] == [(ClaimChange.REJECTED, "ann")]
    view = play.step(hands, CommandInput("2", "bob", Grip(Which(BATON), force=True)))
    assert view.outcomes[0].done
    assert play.grasps() == ["bob"]
    assert [(e.change, e.owner) for e in told(play, "ann")][1:] == [(ClaimChange.TAKEN, "bob")]
    assert told(play, "bob")[-1].change is ClaimChange.GRANTED
    before = play.thing(BATON).position
    play.step(hands)
    assert np.abs(play.thing(BATON).position - before).max() < 0.004


def test_claims_are_in_the_snapshot_and_in_a_run_again() -> None:
    play = Play("ann", "bob")
    both(play)
    middle = World.restore(play.world.snapshot())
    for k in range(LEASE_STEPS + 10):
        view = play.step({"bob": reaching(FAR, 1.0, np.pi)} if k < 40 else {})
        other = middle.step(play.inputs[-1])
        assert other.claims == view.claims
    assert middle.snapshot() == play.world.snapshot()
    assert any(e.change is ClaimChange.EXPIRED for v in play.views for e in v.claims)
    again = World(play.world._room)
    assert [again.step(i).claims for i in play.inputs] == [v.claims for v in play.views]
    assert again.snapshot() == play.world.snapshot()


@pytest.mark.parametrize("who", ["ann", "bob"])
def test_who_leaves_has_no_claim(who: str) -> None:
    play = Play("ann", "bob")
    both(play)
    stays = {"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(FAR, 1.0, np.pi)}
    stays.pop(who)
    play.step(stays, left=(who,))
    play.step(stays)
    assert play.grasps() == [*stays]
    assert play.world._state.claims[0].owner == next(iter(stays))


def test_what_is_attached_to_a_held_thing_is_held_with_it() -> None:
    play = Play("ann")
    taken_up(play)
    hands = {"ann": reaching(at(0.0, 0.25, 0.0), 1.0)}
    beside = play.thing(BATON).position + np.array([0.0, -0.05, 0.0])
    play.step(hands, CommandInput("1", "ann", Move(Which("ball"), beside, np.array([0.0, 0.0, 0.0, 1.0]))))
    view = play.step(hands, CommandInput("2", "ann", Attach(Which(BATON), Which("ball"))))
    assert view.outcomes[0].done, view.outcomes[0].reason
    (grasp,) = play.step(hands).grasps
    assert grasp.thing in view.outcomes[0].things
    assert play.thing(grasp.thing).holders == ("ann",)
