"""Figures for programs and notebooks: built in or from a file, put into a posture by joint names."""

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.body_model.builtin_people import PEOPLE
from vistel.figure.body_model.person import Person, make
from vistel.figure.clothes.wardrobe import Outfit
from vistel.figure.formats.load import load_any
from vistel.figure.people.builtin import WRINKLES, builtin_avatar
from vistel.figure.posture.by_joint import Degrees, with_joints
from vistel.figure.posture.posture import Posture, Stance, standing


@dataclass(frozen=True)
class PosedFigure:
    """An avatar in a posture. wrinkles: names of built-in sets of wrinkles that it wears."""

    avatar: Avatar
    posture: Posture = field(default_factory=standing)
    wrinkles: tuple[str, ...] = ()

    def pose(self, **degrees: Degrees) -> "PosedFigure":
        """This figure with joints at these angles, in degrees: `pose(left_lower_arm=90, head=(0, 30, 0))`.

        The other joints keep their angles. See `vistel.figure.posture.by_joint.with_joints` for how many angles a joint takes.
        Raises ValueError for a name that is no joint.
        """
        return replace(self, posture=with_joints(self.posture, degrees))

    def at(self, x: float, z: float, heading: float = 0.0) -> "PosedFigure":
        """This figure standing at (x, z) on the floor [m], turned by `heading` about the vertical [degrees]; 0 faces +Z."""
        stance = Stance(np.array((x, 0.0, z)), math.radians(heading))
        return replace(self, posture=replace(self.posture, stance=stance))


def builtin(name: str, height: float | None = None) -> PosedFigure:
    """A built-in person, standing: one of the ten with names ("aiko", "ben", "carla" and others), or by look ("sex=male,age=40").

    height: in metres; by default the person's own, or 1.75. Making a person takes some seconds the first time.
    Raises ValueError, in one line, for neither name nor look.
    """
    if name in PEOPLE:
        spec, own = f"builtin:person={name}", PEOPLE[name].height
    elif name.startswith("builtin") or "=" in name:
        spec, own = name if name.startswith("builtin") else f"builtin:{name}", None
    else:
        near = difflib.get_close_matches(name, PEOPLE, 1)
        known = f"expected one of {', '.join(PEOPLE)}, or a look such as 'sex=male,age=40'"
        mend = f"did you mean {near[0]!r}?" if near else known
        raise ValueError(f"no built-in person {name!r}; {mend}")
    return PosedFigure(builtin_avatar(spec, name=name, height=height or own or 1.75), wrinkles=WRINKLES)


def person(
    sex: str = "female",
    age: float = 30.0,
    height: float | None = None,
    weight: float | None = None,
    muscle: float = 0.5,
    face_seed: int = 0,
    skin: float = 0.3,
    origin: tuple[float, float, float] = (1.0, 1.0, 1.0),
    measures: Mapping[str, float] | None = None,
    name: str = "person",
    hair: str = "",
    beard: str = "",
    outfit: Outfit | None = None,
    glasses: str = "",
) -> PosedFigure:
    """A person by measures, standing: `person(sex="male", age=40, height=1.82, weight=85, face_seed=7, skin=0.6)`.

    age in years, 1 to 90; height in metres, hit to a millimetre; weight in kilograms: by default the usual ones. muscle: 0 to 1.
    skin: 0 the lightest to 1 the darkest. origin: shares of African, Asian and Caucasian features. measures: others that are known,
    such as {"chest girth": 1.02, "waist girth": 0.9} [m]; see `vistel.figure.body_model.measures.COLUMNS`. hair: one of
    `vistel.figure.body_model.hair.styles.STYLES`, such as "bob"; beard: one of `vistel.figure.body_model.hair.beard.BEARDS`;
    outfit: what they wear (`vistel.figure.clothes.wardrobe.Outfit`): by default usual ones for sex, age and face_seed; glasses:
    one of `vistel.figure.glasses.glasses.GLASSES`, such as "round": by default none. What is not told is as people of that height
    and weight have it, a little different with every face_seed. What the model does not cover is brought to its bounds, with a
    PersonWarning. Raises ValueError, in one line, for words that are not known.
    """
    told = Person(sex, age, height, weight, muscle, origin, face_seed, skin, measures or {}, hair, beard, outfit, glasses=glasses)
    return PosedFigure(make(told, name))


def load(path: str | Path) -> PosedFigure:
    """The avatar of a file (docs/reference/avatar-file.md), standing. Raises ValueError or OSError naming what is wrong."""
    return PosedFigure(load_any(Path(path)))
