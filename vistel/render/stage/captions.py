"""What people said to the room lately and what it answered."""

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace

from vistel.messages.chat import text_of
from vistel.v1.speech_pb2 import ChatLine, Utterance

SHOWN_NS = 5_000_000_000
"""How long a caption stays; a question stays twice as long."""
MOST = 3
_STATES = {
    Utterance.STATE_REJECTED: ("?", (255, 196, 120)),
    Utterance.STATE_SENT: ("…", (235, 235, 235)),
    Utterance.STATE_DONE: ("✓", (140, 245, 165)),
    Utterance.STATE_REFUSED: ("✗", (255, 150, 130)),
    Utterance.STATE_QUESTION: ("?", (255, 226, 120)),
    Utterance.STATE_NOTED: ("·", (235, 235, 235)),
}


@dataclass(frozen=True)
class Caption:
    """speaker: as people know them; text, spoken: what they said and how it sounds; reply: of the room; things: ids of what
    it was done to; mark, colour: how it went."""

    speaker: str
    text: str
    spoken: str
    reply: str
    things: tuple[str, ...]
    mark: str
    colour: tuple[int, int, int]

    @property
    def over_things(self) -> "Caption":
        """The same as it stands over them."""
        return replace(self, speaker="", things=())


def caption_words(captions: Iterable[Caption]) -> str:
    """JSON of captions, as a browser's page is told."""
    rows = [{"who": c.speaker, "text": c.text, "mark": c.mark, "reply": c.reply} for c in captions]
    return json.dumps({"kind": "captions", "captions": rows})


class Captions:
    """Keeps what was said lately."""

    def __init__(self) -> None:
        self._said: dict[str, tuple[Utterance, int]] = {}

    def receive(self, message: Utterance, now_ns: int) -> None:
        """Something was said, or answered. What was over before one came is not shown."""
        if message.state not in _STATES or now_ns - message.header.t_ns > SHOWN_NS:
            return
        self._said[message.participant] = message, now_ns

    def receive_line(self, participant: str, message: ChatLine, now_ns: int) -> None:
        """Somebody wrote to all: shown as what asks nothing of the room."""
        text = text_of(message)
        self.receive(
            Utterance(header=message.header, participant=participant, text=text, spoken=text, state=Utterance.STATE_NOTED), now_ns
        )

    def shown(self, now_ns: int, names: dict[str, str]) -> tuple[Caption, ...]:
        """The newest of each speaker, oldest first; names: of people, by participant."""
        for who, (message, heard_ns) in list(self._said.items()):
            if now_ns - heard_ns > SHOWN_NS * (2 if message.state == Utterance.STATE_QUESTION else 1):
                del self._said[who]
        newest = sorted(self._said.values(), key=lambda said: said[1])[-MOST:]
        return tuple(
            Caption(
                names.get(m.participant, m.participant),
                m.text,
                m.spoken,
                "" if m.state in (Utterance.STATE_DONE, Utterance.STATE_SENT) else m.reply,
                tuple(m.things) if m.state == Utterance.STATE_DONE else (),
                *_STATES[m.state],
            )
            for m, _ in newest
        )
