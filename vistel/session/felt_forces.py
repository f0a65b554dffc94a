"""What hands feel where they touch somebody or something, as pages are told it."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping

from vistel.v1.world_pb2 import HandForce
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME

PERIOD_NS = 200_000_000
"""From one time that it is told to the next: arrows need not tremble."""
FELT_NS = 200_000_000
"""A hand of which nothing newer came for so long feels nothing."""
LEAST_N = 0.05
"""What is weaker is not told [N]."""
_MOST_WAITING = 64


class FeltForces:
    """Lives on the event loop. crowd: there are too many hands to hear of all, and nothing is told."""

    def __init__(self, bus: Bus, *, crowd: bool) -> None:
        self._felt = None if crowd else bus.subscribe(BY_NAME["hand_force"], queue_all=True, polled=True)
        self._hands: dict[tuple[str, bool], deque[HandForce]] = {}
        self._period = -1
        self._now_ns: int = -1
        self._words = _words([])

    def begin_again(self) -> None:
        """Time has leapt."""
        self._take()
        self._hands.clear()
        self._period = -1

    def close(self) -> None:
        """Receive no more."""
        if self._felt is not None:
            self._felt.close()

    def _take(self) -> list[HandForce]:
        return [] if self._felt is None else [sample.message for sample in self._felt.take()]

    def words(self, now_ns: int, delays_ns: Mapping[str, int]) -> str:
        """JSON of what is felt in the picture of `now_ns`, in which people are shown later by `delays_ns`; of others nothing."""
        for told in self._take():
            self._hands.setdefault((told.participant, told.right), deque(maxlen=_MOST_WAITING)).append(told)
        if now_ns // PERIOD_NS != self._period or now_ns == self._now_ns:  # a log that stands still
            self._period = now_ns // PERIOD_NS
            rows = list[dict[str, object]]()
            for (who, right), waiting in list(self._hands.items()):
                shown_ns = now_ns - delays_ns.get(who, 0)
                while len(waiting) > 1 and waiting[1].header.t_ns <= shown_ns:
                    waiting.popleft()
                if shown_ns - waiting[0].header.t_ns > FELT_NS:
                    del self._hands[who, right]
                elif waiting[0].header.t_ns <= shown_ns and who in delays_ns:
                    rows += _rows(waiting[0])
            self._words = _words(rows)
        self._now_ns = now_ns
        return self._words


def _rows(hand: HandForce) -> list[dict[str, object]]:
    told: dict[str, object] = {"who": hand.participant, "hand": "right" if hand.right else "left"}
    return [
        told
        | {"digit": HandForce.Digit.Name(touch.digit).removeprefix("DIGIT_").lower(), "body": touch.body}
        | {"at": [round(x, 3) for x in (touch.point.x, touch.point.y, touch.point.z)]}
        | {"force": [round(x, 2) for x in (touch.force.x, touch.force.y, touch.force.z)]}
        for touch in hand.touches
        if touch.normal_force >= LEAST_N and touch.digit in HandForce.Digit.values()
    ]


def _words(rows: list[dict[str, object]]) -> str:
    return json.dumps({"kind": "forces", "touches": rows})
