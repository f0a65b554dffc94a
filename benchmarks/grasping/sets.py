"""Three sets of hands, things and recordings, disjoint: rules are tuned on one, chosen by the second, reported on the third.

`tune` and `choose` may be looked at as often as one likes. `report` is scored by `benchmarks.grasping.report`, once for a commit,
and every score is kept. What it is made of was never scored before: recordings of other people, other things, other seeds.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.figures import grasp_held_out as perturbed
from benchmarks.figures.grasp_held_out import Take, Takes
from benchmarks.grasping.errors import GLOVE, WEBCAM
from benchmarks.grasping.simulated import false_trials, true_trials
from benchmarks.grasping.things import Things, made, rod, upright
from benchmarks.grasping.trials import Trial, of_recorded
from vistel.space.things.things import ThingPrimitive

WEBCAM_KINDS = ("power", "pinch", "tripod", "two hands")
"""What a hand before a camera is asked to do: it does not see what is between two fingers."""

Rng = np.random.Generator


@dataclass(frozen=True)
class GraspSet:
    """A set: seed and things of its simulated hands, and its recordings (None: none)."""

    name: str
    seed: int
    things: Things
    takes: Takes | None = None

    def true_trials(self, each: int = 2) -> Iterator[Trial]:
        """Hands with gloves that take hold."""
        yield from true_trials(self.things, GLOVE, each, self.seed)
        if self.takes is not None:
            yield from map(of_recorded, perturbed.true_trials(self.takes, 1))

    def false_trials(self, each: int = 1) -> Iterator[Trial]:
        """Hands with gloves that take nothing."""
        yield from false_trials(self.things, GLOVE, each, self.seed)
        if self.takes is not None:
            yield from map(of_recorded, perturbed.false_trials(self.takes, 1))

    def webcam_trials(self, each: int = 2) -> Iterator[Trial]:
        """Hands seen by a camera that take hold."""
        yield from true_trials(self.things, WEBCAM, each, self.seed + 1, WEBCAM_KINDS)

    def webcam_false(self, each: int = 1) -> Iterator[Trial]:
        """Hands seen by a camera that take nothing."""
        yield from false_trials(self.things, WEBCAM, each, self.seed + 1)


def _ball(rng: Rng) -> ThingPrimitive:
    return ThingPrimitive("sphere", (rng.uniform(0.024, 0.038),))


def tune() -> GraspSet:
    """Balls, bars, boxes; the recordings that thresholds were always settled on."""
    u = "superellipsoid"
    return GraspSet(
        "tune",
        11,
        Things(
            whole=(
                lambda r: made("ball", r, _ball(r)),
                lambda r: made("bar", r, rod(r.uniform(0.011, 0.022), 0.08)),
                lambda r: made(
                    "box", r, ThingPrimitive(u, (r.uniform(0.04, 0.07), r.uniform(0.02, 0.04), r.uniform(0.016, 0.028), 0.2, 0.2))
                ),
            ),
            small=(
                lambda r: made("marble", r, ThingPrimitive("sphere", (r.uniform(0.006, 0.014),))),
                lambda r: made("stick", r, rod(r.uniform(0.005, 0.011), 0.03)),
                lambda r: made("cube", r, ThingPrimitive(u, (r.uniform(0.007, 0.013),) * 3 + (0.2, 0.2))),
            ),
            flat=(lambda r: made("plate", r, ThingPrimitive(u, (r.uniform(0.004, 0.008), 0.016, 0.018, 0.2, 0.2))),),
            rods=(lambda r: made("pen", r, rod(r.uniform(0.004, 0.007), 0.04, turn=upright("x"))),),
            large=(
                lambda r: made("crate", r, ThingPrimitive(u, (r.uniform(0.08, 0.14), 0.07, 0.09, 0.1, 0.1)), turned=0.08, mass=0.8),
                lambda r: made("beach ball", r, ThingPrimitive("sphere", (r.uniform(0.09, 0.13),)), mass=0.3),
            ),
        ),
        perturbed.settled_on(),
    )


def choose(folder: Path | None) -> GraspSet:
    """Eggs, cups, tubes; the recordings that were held out once. folder: `recorder/recordings` of leapmotion/leapjs-playback at
    4ff4b5b; None: without recordings."""
    u = "superellipsoid"
    return GraspSet(
        "choose",
        22,
        Things(
            whole=(
                lambda r: made(
                    "egg", r, ThingPrimitive(u, (r.uniform(0.03, 0.045), r.uniform(0.022, 0.03), r.uniform(0.022, 0.03), 1.0, 1.0))
                ),
                lambda r: made(
                    "cup",
                    r,
                    ThingPrimitive(u, (q := r.uniform(0.024, 0.034), q, r.uniform(0.03, 0.045), 0.3, 1.0), rotation=upright("z")),
                ),
                lambda r: made(
                    "hammer",
                    r,
                    rod(r.uniform(0.010, 0.016), 0.08),
                    ThingPrimitive(u, (0.018, 0.018, 0.04, 0.3, 0.3), np.array([0.11, 0.0, 0.0])),
                ),
            ),
            small=(
                lambda r: made(
                    "bean",
                    r,
                    ThingPrimitive(u, (r.uniform(0.010, 0.016), r.uniform(0.006, 0.010), r.uniform(0.006, 0.010), 1.0, 1.0)),
                ),
                lambda r: made("peg", r, rod(r.uniform(0.006, 0.010), 0.02, turn=upright("x"))),
            ),
            flat=(
                lambda r: made(
                    "token", r, ThingPrimitive(u, (0.016, 0.016, r.uniform(0.004, 0.008), 0.3, 1.0), rotation=upright("side"))
                ),
            ),
            rods=(
                lambda r: made(
                    "chalk", r, ThingPrimitive(u, (q := r.uniform(0.004, 0.007), q, 0.035, 0.3, 1.0), rotation=upright("z"))
                ),
            ),
            large=(
                lambda r: made(
                    "cushion", r, ThingPrimitive(u, (r.uniform(0.10, 0.15), 0.06, 0.08, 0.6, 0.6)), turned=0.08, mass=0.4
                ),
                lambda r: made(
                    "drum", r, ThingPrimitive(u, (q := r.uniform(0.09, 0.13), q, 0.07, 0.2, 1.0), rotation=upright("z")), mass=0.8
                ),
            ),
        ),
        None if folder is None else perturbed.held_out(folder),
    )


def report(folder: Path | None) -> GraspSet:
    """Bottles, dumb-bells, dice, coins; recordings that nobody had scored: buttons and slider of raimo/leapjs-widgets at
    4c7da0f, finger-tap of leapmotion/leapjs-plugins at dcaaafe (both Apache-2.0). folder: where they are; None: without them."""
    u = "superellipsoid"

    def pear(r: Rng) -> tuple[ThingPrimitive, ...]:
        big, small = r.uniform(0.024, 0.034), r.uniform(0.014, 0.022)
        return (ThingPrimitive("cone_sphere", (-0.02, 0.0, 0.0, 0.04, 0.0, 0.0, big, small)),)

    def dumbbell(r: Rng) -> tuple[ThingPrimitive, ...]:
        ends = r.uniform(0.022, 0.03)
        return (
            rod(r.uniform(0.010, 0.014), 0.07),
            *(ThingPrimitive("sphere", (ends,), np.array([x, 0.0, 0.0])) for x in (-0.08, 0.08)),
        )

    def bottle(r: Rng) -> tuple[ThingPrimitive, ...]:
        radius = r.uniform(0.022, 0.032)
        return (
            ThingPrimitive(u, (radius, radius, 0.06, 0.3, 1.0), rotation=upright("side")),
            rod(0.4 * radius, 0.03, np.array([0.075, 0.0, 0.0])),
        )

    return GraspSet(
        "report",
        33,
        Things(
            whole=(
                lambda r: made("pear", r, *pear(r)),
                lambda r: made("dumb-bell", r, *dumbbell(r)),
                lambda r: made("bottle", r, *bottle(r)),
                lambda r: made(
                    "brick",
                    r,
                    ThingPrimitive(u, (r.uniform(0.05, 0.08), r.uniform(0.015, 0.03), r.uniform(0.018, 0.027), 0.35, 0.35)),
                ),
            ),
            small=(
                lambda r: made("die", r, ThingPrimitive(u, (q := r.uniform(0.006, 0.012), q, q, 0.4, 0.4))),
                lambda r: made(
                    "bolt", r, rod(r.uniform(0.005, 0.009), 0.025), ThingPrimitive("sphere", (0.012,), np.array([0.03, 0.0, 0.0]))
                ),
                lambda r: made(
                    "cone", r, ThingPrimitive("cone_sphere", (0.0, -0.008, 0.0, 0.0, 0.014, 0.0, r.uniform(0.009, 0.013), 0.005))
                ),
            ),
            flat=(lambda r: made("card", r, ThingPrimitive(u, (r.uniform(0.003, 0.007), 0.02, 0.014, 0.15, 0.15))),),
            rods=(lambda r: made("brush", r, rod(r.uniform(0.004, 0.006), 0.05, turn=upright("x"))),),
            large=(
                lambda r: made(
                    "parcel", r, ThingPrimitive(u, (r.uniform(0.09, 0.15), 0.06, 0.07, 0.25, 0.25)), turned=0.08, mass=0.6
                ),
                lambda r: made("melon", r, ThingPrimitive(u, (r.uniform(0.09, 0.13), 0.09, 0.10, 1.0, 1.0)), mass=0.5),
            ),
        ),
        None if folder is None else _unscored(folder),
    )


def _unscored(folder: Path) -> Takes:
    buttons, slider, tap = (Take(folder / name) for name in ("buttons.lz", "slider.lz", "finger-tap-54fps.json.lz"))
    return Takes((buttons, slider), (buttons,), tap, tap, (tap,), 1733)
