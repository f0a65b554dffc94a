"""People moved by the log of a conference, as they moved in it."""

from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path

from vistel.arrays import F64
from vistel.figure.posture.posture import Posture, interpolate
from vistel.figure.posture.sensors import Placement
from vistel.log import Log, LogError
from vistel_sim.motion.source import MotionError, SimulatedPerson, receivers_of


class LoggedMotion:
    """Motion source: times begin with the log; before the first and after the last posture people keep still."""

    def __init__(self, path: Path, people: Mapping[str, SimulatedPerson]) -> None:
        """people: by their names in the log. Raises MotionError, one line, for what is no log, or has no posture of one of them."""
        self._people = dict(people)
        try:
            log = Log(path)
            self._moved = {name: [*log.postures(name)] for name in people}
        except (LogError, ValueError, OSError) as e:
            raise MotionError(str(e)) from e
        for name, postures in self._moved.items():
            if not postures:
                raise MotionError(f"{path}: no posture of {name}; there are {', '.join(log.participants)}")
        self._times = {name: [t for t, _ in postures] for name, postures in self._moved.items()}

    @property
    def participants(self) -> tuple[str, ...]:
        """Whom it moves."""
        return tuple(self._people)

    def posture(self, participant: str, t_s: float) -> Posture:
        """As recorded, between two recorded ones in between."""
        times, moved = self._times[participant], self._moved[participant]
        k = bisect_right(times, t_s)
        if k in (0, len(times)):
            return moved[min(k, len(times) - 1)][1]
        return interpolate(moved[k - 1][1], moved[k][1], (t_s - times[k - 1]) / max(1e-9, times[k] - times[k - 1]))

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        """Of receivers on an average person of their height."""
        return receivers_of(self._people[participant], self.posture(participant, t_s))

    def hand_angles(self, participant: str, t_s: float) -> F64:
        """As recorded."""
        return self.posture(participant, t_s).hands

    def speaking(self, participant: str, t_s: float) -> float:
        """Nobody speaks."""
        return 0.0

    def things(self, t_s: float) -> dict[str, Placement]:
        """It moves none."""
        return {}
