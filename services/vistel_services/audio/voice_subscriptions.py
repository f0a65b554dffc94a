"""Which voices a site receives: all of a small conference, of a crowd those of the near and of the loud."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from vistel.wire.bus import Bus, Sample
from vistel.wire.motion.interest import NEAR, ChosenSubscriptions, loudest
from vistel.wire.topics import BY_NAME

LOUD_NS = 1_000_000_000
"""How long a level counts."""


class VoiceSubscriptions:
    """Receives voices."""

    def __init__(self, bus: Bus, crowd: Mapping[str, str], own: Collection[str]) -> None:
        """crowd: see `Conference.crowd`; own: whose microphones are here."""
        self._own = frozenset(own)
        self._all = bus.subscribe(BY_NAME["voice_level" if crowd else "voice"], queue_all=not crowd, polled=True)
        self._chosen = ChosenSubscriptions(bus, BY_NAME["voice"], crowd) if crowd else None
        self._levels: dict[str, tuple[float, int]] = {}

    def choose(self, far: Mapping[str, float], now_ns: int) -> None:
        """In a crowd, receive the near and the loud from now on. far: distances from the listener [m], as known."""
        if self._chosen is None:
            return
        for sample in self._all.take():
            if sample.names["participant"] not in self._own:
                self._levels[sample.names["participant"]] = sample.message.level_db, sample.received_ns
        self._levels = {name: (db, t_ns) for name, (db, t_ns) in self._levels.items() if now_ns - t_ns < LOUD_NS}
        near = sorted(far, key=lambda name: far[name])[:NEAR]
        self._chosen.choose({*near, *loudest({name: db for name, (db, _) in self._levels.items()}, far)})

    def take(self) -> list[Sample]:
        """The voices that have arrived since the last call."""
        return self._all.take() if self._chosen is None else self._chosen.take()

    def close(self) -> None:
        """Receive nothing more."""
        self._all.close()
        if self._chosen is not None:
            self._chosen.close()
