"""Commands for raising a hand and for reacting to what is said."""

from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.commands.context import Answer, Context, performs
from vistel.space.gestures import begun_anew
from vistel.space.signals import AGAIN_STEPS, RaisedHand, ShownReaction


@performs(ask.RaiseHand)
def raise_hand(context: Context, action: ask.RaiseHand) -> Answer:
    """Put the speaker's hand up, last in the row, or down."""
    state = context.state
    if action.down:
        # A hand of the figure that is still up would be counted at once again.
        return state.but(
            signals=state.signals.without_hand(context.who), gestures=begun_anew(state.gestures, context.who, state.step)
        ), ()
    return state.but(signals=state.signals.with_hand(RaisedHand(context.who, state.t_ns))), ()


@performs(ask.React)
def react(context: Context, action: ask.React) -> Answer:
    """Show the speaker's reaction."""
    state = context.state
    if not state.signals.may_react(context.who, state.step):
        raise Refused(f"you have just reacted; wait {AGAIN_STEPS // 60} s")
    return state.but(signals=state.signals.with_reaction(ShownReaction(context.who, action.reaction, state.step))), ()
