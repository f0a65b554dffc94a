"""What stands over a head of raised hands and reactions."""

from vistel.v1 import command_pb2
from vistel.v1.world_pb2 import Signals

_WORDS = {
    command_pb2.REACTION_THUMB_UP: "thumb up",
    command_pb2.REACTION_CLAP: "claps",
    command_pb2.REACTION_HEART: "♥",
    command_pb2.REACTION_LAUGH: "laughs",
    command_pb2.REACTION_SURPRISE: "oh!",
}


def sign_of(signals: Signals, participant: str) -> str:
    """In a few letters; empty for who says nothing. The first whose hand was raised is 1."""
    said = [f"hand up {n}" for n, hand in enumerate(signals.raised, 1) if hand.participant == participant]
    said += [_WORDS.get(shown.reaction, "") for shown in signals.reactions if shown.participant == participant]
    return " · ".join(word for word in said if word)
