"""Who holds what, who touches whom, and who raises a hand, as a browser's page is told."""

import json
from collections.abc import Iterable, Sequence

from vistel.v1.command_pb2 import Reaction
from vistel.v1.world_pb2 import Grasp, Signals


def held_words(grasps: Iterable[Grasp], touching: Sequence[tuple[str, str]]) -> str:
    """JSON of what hands hold, and of who touches whom."""
    held = [[g.participant, "right" if g.right else "left", g.thing] for g in grasps]
    return json.dumps({"kind": "held", "grasps": held, "touching": touching})


def signal_words(signals: Signals) -> str:
    """JSON of raised hands, in the order in which they were raised, and of reactions."""
    raised = [[hand.participant, hand.by_gesture] for hand in signals.raised]
    known = Reaction.values()
    shown = [
        [r.participant, Reaction.Name(r.reaction).removeprefix("REACTION_").lower()]
        for r in signals.reactions
        if r.reaction in known
    ]
    return json.dumps({"kind": "signals", "raised": raised, "reactions": shown})
