"""Whom of a crowd a site receives in full: the near, and the loud. Of the others it receives the thin motion, and no voice.

The router filters: a site subscribes to the keys of those whom it wants in full, and to the thin motion of all.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from vistel.arrays import F64
from vistel.wire.bus import Bus, Sample, Subscription
from vistel.wire.topics import BY_NAME, Topic

NEAR = 8
"""How many others a site receives in full because they are near."""
LOUD = 4
"""How many more because they are loud."""
STAYS = 0.8
"""Factor of the distance of who is received in full already, so that two at the same distance do not take turns."""
STRAY_NS = 1_000_000_000
"""Of full and thin motion the newer frame counts; one that is older by more begins a new life of its sender."""
LEAST_M = 0.5
"""Voices grow no louder than at this distance [m]."""


def nearest(here: Sequence[F64], people: Mapping[str, F64], now: Collection[str] = (), most: int = NEAR) -> frozenset[str]:
    """The `most` people who are nearest to any of the places `here` [m], `now` being those received in full so far."""
    if not here:
        return frozenset()
    far = {name: min(float(np.linalg.norm(p - h)) for h in here) * (STAYS if name in now else 1.0) for name, p in people.items()}
    return frozenset(sorted(far, key=lambda name: (far[name], name))[:most])


def loudest(levels: Mapping[str, float], far: Mapping[str, float], most: int = LOUD) -> frozenset[str]:
    """The `most` people whose voices are the loudest here. levels: at their microphones [dB]; far: distances [m], as known."""
    heard = {name: level - 20.0 * float(np.log10(max(LEAST_M, far.get(name, LEAST_M)))) for name, level in levels.items()}
    return frozenset(sorted(heard, key=lambda name: (-heard[name], name))[:most])


class ChosenSubscriptions:
    """Messages of one topic of those participants only who are chosen now."""

    def __init__(self, bus: Bus, topic: Topic, crowd: Mapping[str, str]) -> None:
        """crowd: participants and their sites: messages of a key that is subscribed to as a whole travel without its text."""
        self._bus, self._topic, self._crowd = bus, topic, crowd
        self._of: dict[str, Subscription] = {}

    @property
    def chosen(self) -> frozenset[str]:
        """Whose messages are received."""
        return frozenset(self._of)

    def choose(self, names: Iterable[str]) -> None:
        """Receive those of `names` from now on."""
        wanted = self._crowd.keys() & set(names)
        for name in self._of.keys() - wanted:
            self._of.pop(name).close()
        for name in sorted(wanted - self._of.keys()):
            self._of[name] = self._bus.subscribe(self._topic, queue_all=True, polled=True, participant=name, site=self._crowd[name])

    def take(self) -> list[Sample]:
        """What has arrived since the last call."""
        return [sample for subscription in self._of.values() for sample in subscription.take()]

    def close(self) -> None:
        """Receive nothing more."""
        self.choose(())


class MotionSubscriptions:
    """The motion of everybody: of a crowd in full only of a site's own people and of who is chosen, of the others thin."""

    def __init__(self, bus: Bus, crowd: Mapping[str, str], own: Collection[str]) -> None:
        """crowd: participants and their sites, empty: all are received in full; own: the site's participants."""
        self._own = frozenset(own)
        self._chosen = ChosenSubscriptions(bus, BY_NAME["motion"], crowd)
        self._all = bus.subscribe(BY_NAME["motion_thin" if crowd else "motion"], queue_all=True, polled=True)
        self.choose(())

    def choose(self, names: Collection[str]) -> None:
        """Who is received in full besides the site's own."""
        self._chosen.choose(self._own | frozenset(names))

    @property
    def chosen(self) -> frozenset[str]:
        """Who is received in full besides the site's own, by choice."""
        return self._chosen.chosen - self._own

    def take(self) -> list[Sample]:
        """What has arrived since the last call, in the order of each stream; `Sample.topic` tells the streams apart."""
        return [*self._chosen.take(), *self._all.take()]

    def close(self) -> None:
        """Receive nothing more."""
        self._chosen.close()
        self._all.close()
