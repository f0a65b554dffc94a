"""Turns of talk, drawn from a seed cycle after cycle, and the loudness of voices."""

import math

import numpy as np

from vistel_sim.motion.tracks import bump

TURN_CYCLE_S = 20.0


class Conversation:
    """Turns of two to five seconds with short pauses; nobody speaks twice in a row, nor alone."""

    def __init__(self, people: tuple[str, ...], seed: int) -> None:
        self._people = people
        self._seed = seed
        self._turns: dict[int, list[tuple[float, float, str]]] = {}

    def turns(self, cycle: int) -> list[tuple[float, float, str]]:
        """(start, end, speaker) of one cycle, seconds from the very start."""
        if cycle < 0 or len(self._people) < 2:
            return []
        if cycle not in self._turns:
            rng = np.random.default_rng((self._seed, 77, cycle))
            out: list[tuple[float, float, str]] = []
            t, last = 0.3, -1
            while t < TURN_CYCLE_S - 2.0:
                who = int(rng.integers(len(self._people)))
                if who == last:
                    who = (who + 1) % len(self._people)
                end = min(TURN_CYCLE_S - 0.3, t + float(rng.uniform(2.0, 5.0)))
                out.append((cycle * TURN_CYCLE_S + t, cycle * TURN_CYCLE_S + end, self._people[who]))
                t, last = end + float(rng.uniform(0.3, 0.9)), who
            if len(self._turns) > 16:
                self._turns.clear()
            self._turns[cycle] = out
        return self._turns[cycle]

    def weight(self, participant: str, t: float) -> float:
        """How far it is the participant's turn, 0 to 1, smooth."""
        return max(
            (bump(t, (a - 0.25, a + 0.35), (b - 0.4, b + 0.3)) for a, b, who in self._near(t) if who == participant), default=0.0
        )

    def loudness(self, participant: str, t: float) -> float:
        """0 to 1: the turn times syllables (about 4 a second) and phrases."""
        w = self.weight(participant, t)
        if w == 0.0:
            return 0.0
        own = sum(ord(c) for c in participant)
        syllable = 0.5 + 0.5 * math.sin(2.0 * math.pi * 4.2 * t + 1.3 * math.sin(2.1 * t + own))
        phrase = 0.65 + 0.35 * math.sin(2.0 * math.pi * 0.55 * t + own)
        return w * phrase * (0.25 + 0.75 * syllable)

    def glances(self, participant: str, start: float, end: float) -> list[tuple[float, str]]:
        """(time, name) of those to whom the participant turns between `start` and `end`; listeners look at who speaks."""
        out: list[tuple[float, str]] = [(start, self.whom_to_watch(participant, start))]
        for a, b, who in self.turns(int(start // TURN_CYCLE_S)):
            if who != participant:
                # A listener needs a moment to turn.
                out.append((a + 0.25, who))
                continue
            others = [p for p in self._people if p != participant] or [participant]
            t, k = a, int(a * 7)
            while t < b:
                out.append((t, others[k % len(others)]))
                t, k = t + 1.7, k + 1
        return [g for g in out if start <= g[0] < end]

    def whom_to_watch(self, participant: str, t: float) -> str:
        """Who speaks, or spoke last, other than the participant; else the first of the others."""
        spoken = [who for a, _, who in self._near(t) if a <= t and who != participant]
        others = [p for p in self._people if p != participant] or [participant]
        return spoken[-1] if spoken else others[0]

    def _near(self, t: float) -> list[tuple[float, float, str]]:
        cycle = int(t // TURN_CYCLE_S)
        return self.turns(cycle - 1)[-1:] + self.turns(cycle) + self.turns(cycle + 1)[:1]
