"""People by measures and seeds: what a person is told to be becomes a look of the body model that has it, and an avatar."""

import warnings
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.body import Body
from vistel.figure.body_model.assemble import assemble, limbs, painted
from vistel.figure.body_model.fit import ADULT, Fitted, fitted, statistics
from vistel.figure.body_model.hair.beard import BEARDS, beard
from vistel.figure.body_model.hair.ground_paint import paint_ground
from vistel.figure.body_model.hair.hair import hair
from vistel.figure.body_model.hair.natural import natural_colour, receding, usual_beard, usual_style
from vistel.figure.body_model.hair.scalp import Scalp
from vistel.figure.body_model.hair.styles import STYLES
from vistel.figure.body_model.look import ORIGINS, Look
from vistel.figure.body_model.measures import COLUMNS
from vistel.figure.body_model.model import BodyModel, body_model
from vistel.figure.body_model.paint import Colours, paint
from vistel.figure.clothes.outfit import outfit
from vistel.figure.clothes.wardrobe import Outfit, drawn_outfit
from vistel.figure.glasses.glasses import GLASSES, glasses
from vistel.figure.part import joined
from vistel.figure.skeleton import Skeleton

SEXES = ("female", "male")
_COVERED = {"age": (1.0, 90.0), "height": (0.6, 2.2), "weight": (5.0, 200.0), "muscle": (0.0, 1.0), "skin": (0.0, 1.0)}
"""What the model covers: years, metres, kilograms, and shares."""
_GROWTH = {  # age [years]: height [m] and weight [kg] of girls, then of boys; CDC growth charts of 2000, 50th percentiles, rounded
    1.0: (0.74, 9.0, 0.76, 10.0), 5.0: (1.08, 18.0, 1.09, 18.4), 10.0: (1.38, 33.0, 1.385, 32.0), 14.0: (1.60, 49.0, 1.64, 51.0),
    18.0: (1.63, 57.0, 1.76, 67.0),
}  # fmt: skip
_FACE = ("head-", "forehead-", "eyebrows-", "eye-", "nose-", "mouth-", "ear-", "chin-", "cheek-")
_NO_FACE = ("age", "fat", "shape", "trans", "epicanthus")
"""Parts of names of details that no face is given at random: they go with age, weight and origin, or are no people's."""
_MIDDLE = {"mouth-angles": 0.25}
"""Where details of a face are on average, where that is not where MakeHuman has them: its mouths are sad."""
_OLD = {"head-age": 1.0, "eye-bag": 0.9, "mouth-laugh-lines": 0.8, "mouth-upperlip-volume": -0.8, "mouth-lowerlip-volume": -0.6,
        "ear-scale-vert": 0.5, "ear-lobe": 0.7, "nose-scale-vert": 0.2, "cheek-volume": -0.5, "eye-eyefold": 0.4}  # fmt: skip
"""What differs in people of 80 years."""
_OLD_WOMAN = 0.55
"""Share of it in women: MakeHuman's old faces, folds and thin lips are men's."""
_WOMAN = {"chin-width": -0.3, "nose-volume": -0.25, "eye-scale": 0.15, "mouth-upperlip-volume": 0.2, "chin-bones": -0.2}
"""What differs in women, besides what MakeHuman makes of the sexes."""
_HAIRY = 0.9
"""How much of the skin is hidden where hair grows."""
_SHAVED = 0.65
"""The same of a shaved head."""
_OF_CLOTHES = 0.016
"""How far hair lies off dressed shoulders [m]."""
_BITE = ("mouth-lowerlip", "mouth-upperlip", "mouth-trans", "mouth-scale-depth", "chin-prognathism", "chin-jaw-drop")
"""Beginnings of names of details with which lips soon do not meet."""
_IRIS = ((60, 40, 28), (92, 62, 38), (116, 88, 52), (98, 106, 78), (92, 116, 138))
_CLOTH = ((74, 92, 118), (112, 62, 62), (66, 96, 80), (150, 138, 120), (92, 88, 116), (70, 74, 82))


class PersonWarning(UserWarning):
    """Something that the model does not cover: the nearest that it covers is taken."""


@dataclass(frozen=True)
class Person:
    """What a person is told to be. age [years]; height [m], weight [kg]: None for the usual of that sex and age (and height);
    muscle: 0 little .. 1 much, 1/2 usual; origin: shares of `ORIGINS`; skin: 0 the lightest .. 1 the darkest; measures: others that
    are known, by the names of `vistel.figure.body_model.measures.COLUMNS` [m]; hair: one of
    `vistel.figure.body_model.hair.styles.STYLES`, beard: one of `vistel.figure.body_model.hair.beard.BEARDS`, empty for usual ones;
    outfit: what they wear, None for what is drawn from the face's seed; dressed: whether they wear anything but painted clothes;
    glasses: one of `vistel.figure.glasses.glasses.GLASSES`, empty for none."""

    sex: str = "female"
    age: float = 30.0
    height: float | None = None
    weight: float | None = None
    muscle: float = 0.5
    origin: tuple[float, float, float] = (1.0, 1.0, 1.0)
    face_seed: int = 0
    skin: float = 0.3
    measures: Mapping[str, float] = field(default_factory=dict[str, float])
    hair: str = ""
    beard: str = ""
    outfit: Outfit | None = None
    dressed: bool = True
    glasses: str = ""


def checked(given: Person) -> Person:
    """Everything given and within what the model covers; a PersonWarning names what had to be brought there. Raises ValueError, one
    line, for a sex or a measure that is not known, and for numbers that are none."""
    if given.sex not in SEXES:
        raise ValueError(f"sex: expected one of {', '.join(SEXES)}, got {given.sex!r}")
    for name in given.measures:
        if name not in COLUMNS:
            raise ValueError(f"no measure {name!r}; expected one of {', '.join(COLUMNS)}")
    if given.hair and given.hair not in STYLES:
        raise ValueError(f"hair: expected one of {', '.join(STYLES)}, got {given.hair!r}")
    if given.beard and given.beard not in BEARDS:
        raise ValueError(f"beard: expected one of {', '.join(BEARDS)}, got {given.beard!r}")
    if given.glasses and given.glasses not in GLASSES:
        raise ValueError(f"glasses: expected one of {', '.join(GLASSES)}, got {given.glasses!r}")
    given = _within(given, ("age", "muscle", "skin", "height", "weight"))
    if len(given.origin) != len(ORIGINS) or not np.isfinite(given.origin).all() or min(given.origin) < 0.0 or not sum(given.origin):
        raise ValueError(f"origin: expected shares of {', '.join(ORIGINS)}, got {given.origin}")
    height = _usual(given.sex, given.age)[0] if given.height is None else given.height
    weight = usual_weight(given.sex, given.age, height) if given.weight is None else given.weight
    return replace(given, height=height, weight=weight)


def fit(given: Person) -> Fitted:
    """The look of the model that is this person. Warns and raises as `checked` does, and warns where their weight is not
    reached."""
    person = checked(given)
    assert person.height is not None and person.weight is not None
    model = body_model()
    rng = np.random.default_rng(person.face_seed)
    face = face_of(model, rng, person.age)
    for name, more in _of_age(person.sex, person.age).items():
        face[name] = float(np.clip(face.get(name, 0.0) + more, -1.0, 1.0))
    look = Look(float(person.sex == "male"), person.age, person.muscle, origin=person.origin, details=face)
    differs = {name: float(z) for name, z in zip(COLUMNS, np.clip(rng.normal(0.0, 0.5, len(COLUMNS)), -1.0, 1.0), strict=True)}
    found = fitted(model, look, person.height, person.weight, person.measures, differs)
    if abs(found.weight - person.weight) > max(1.0, 0.02 * person.weight):
        _warn(f"weight: {person.weight:.0f} kg at {person.height:.2f} m is beyond the model; {found.weight:.0f} kg taken")
    return found


def make(given: Person, name: str = "person") -> Avatar:
    """The avatar of a person. Warns and raises as `fit` does."""
    person, model = checked(given), body_model()
    rng = np.random.default_rng(person.face_seed + 2)
    usual, back = usual_style(person.sex, person.age, rng), receding(person.sex, person.age, rng)
    style = person.hair or usual
    colours = colours_of(person)
    if person.dressed:
        colours = replace(colours, top=None, shorts=None)
    with ThreadPoolExecutor(1) as beside:  # the skin's picture takes as long as all the rest, and neither needs the other
        skin = beside.submit(paint, model, colours)
        body = assemble(model, fit(given).shape, name=name)
        of_chin = person.beard or usual_beard(person.sex, person.age, rng)
        grown = (
            hair(body, style, colours.hair, rng, receding=back, over=_OF_CLOTHES * person.dressed),
            beard(model, body, of_chin, colours.hair, rng),
            glasses(body, person.glasses or "none"),
        )
        worn = outfit(body, person.outfit or drawn_outfit(person.sex, person.age, person.face_seed)) if person.dressed else ()
        picture, patches = skin.result()
    hides = _SHAVED if style == "shaved" else _HAIRY
    paint_ground(picture, Scalp(body, back), colours.hair, hides, rng, shaved=style == "shaved")
    return joined(painted(body, picture, patches), [part for part in (*grown, *worn) if part is not None])


def limbs_of(given: Person) -> tuple[Skeleton, Body]:
    """Joint chain and primitives of `make(told)`, sooner. Warns and raises as `fit` does."""
    return limbs(body_model(), fit(given).shape)


def face_of(model: BodyModel, rng: np.random.Generator, age: float = 30.0) -> dict[str, float]:
    """Details of a face: most near the middle, the two sides a little different; children's [age in years] less."""
    out: dict[str, float] = {}
    differs = float(np.interp(age, (4.0, 16.0), (0.5, 1.0)))
    for name, (low, _) in model.details.items():
        if name.startswith(_FACE) and not any(part in name for part in _NO_FACE):
            x = _MIDDLE.get(name, 0.0) + differs * float(np.clip(rng.normal(0.0, 0.20), -0.5, 0.5))
            if name.startswith(_BITE):
                x = 0.5 * x
            out[name] = x if low >= 0 else max(0.0, x - 0.15)
        elif name.startswith("asym-"):
            out[name] = max(0.0, float(rng.normal(0.0, 0.08)))
    return out


def _of_age(sex: str, age: float) -> dict[str, float]:
    """Details that go with sex and age; and what clothes press flat."""
    old = float(np.clip((age - 50.0) / 30.0, 0.0, 1.0))
    share_of_old = old * (_OLD_WOMAN if sex == "female" else 1.0)
    out = {name: share_of_old * share for name, share in _OLD.items()} | {"nipple-point": -0.7}
    if sex == "female":
        out["breast-point"] = -0.5
        out |= {name: out.get(name, 0.0) + share * (age >= ADULT) for name, share in _WOMAN.items()}
    return out


def colours_of(person: Person) -> Colours:
    """Drawn from the face's seed, but for the skin: hair and eyes are dark unless skin and origin are those of the fair."""
    rng = np.random.default_rng(person.face_seed + 1)
    fair = person.origin[2] / sum(person.origin)
    most = 1 + round(4 * fair * max(0.0, 1.0 - 1.5 * person.skin))
    man = person.sex == "male" and person.age >= ADULT
    freckled = rng.random() < 0.5 * max(0.0, 1.0 - 3.0 * person.skin)
    return Colours(
        skin=person.skin,
        iris=_IRIS[rng.integers(most)],
        hair=natural_colour(max(person.skin, 0.55 * (1.0 - fair)), person.age, np.random.default_rng(person.face_seed + 3)),
        top=_CLOTH[rng.integers(len(_CLOTH))],
        stubble=float(rng.uniform(0.1, 0.6)) if man else 0.0,
        brows=float(np.clip(rng.normal(0.65 if man else 0.38, 0.15) - 0.25 * (person.age < 14.0), 0.0, 1.0)),
        freckles=float(rng.uniform(0.3, 1.0)) if freckled else 0.0,
        grey=float(np.clip((person.age - 45.0) / 35.0, 0.0, 1.0) * rng.uniform(0.4, 1.0)),
        age=person.age,
        lips=0.6 if person.sex == "female" else 0.3,
        seed=person.face_seed,
    )


def drawn(seed: int, sex: str | None = None) -> Person:
    """A random adult: height and weight as people of ANSUR II have them, between their 5th and 95th percentile."""
    rng = np.random.default_rng(seed)
    sex = SEXES[int(rng.random() < 0.5)] if sex is None else sex
    table = statistics()[sex]
    low, high = (float(table["stature"]["percentiles"][k]) for k in (1, 3))
    height = float(np.clip(rng.normal(0.5 * (low + high), (high - low) / 3.29), low, high))
    light, heavy = (float(table["weight"]["percentiles"][k]) for k in (1, 3))
    weight = float(np.clip(usual_weight(sex, 30.0, height) * np.exp(rng.normal(0.0, 0.11)), light, heavy))
    origin = rng.dirichlet((0.5, 0.5, 0.5))
    skin = float(np.clip(origin @ (0.78, 0.30, 0.18) + rng.normal(0.0, 0.06), 0.0, 1.0))
    three = (float(origin[0]), float(origin[1]), float(origin[2]))
    muscle = float(np.clip(rng.normal(0.5, 0.12), 0.2, 0.8))
    return Person(sex, float(rng.uniform(18.0, 75.0)), height, weight, muscle, three, int(rng.integers(1 << 31)), skin)


def usual_weight(sex: str, age: float, height: float) -> float:
    """[kg] of people of that sex ("female", "male"), age [years] and height [m]."""
    tall, heavy = _usual(sex, age)
    return heavy * (height / tall) ** 2


def _usual(sex: str, age: float) -> tuple[float, float]:
    """Height [m] and weight [kg] that are usual."""
    if age >= ADULT:
        table = statistics()[sex]
        return table["stature"]["percentiles"][2], table["weight"]["percentiles"][2]
    column = 2 * SEXES.index(sex)
    rows = np.array(list(_GROWTH.values()))
    return float(np.interp(age, list(_GROWTH), rows[:, column])), float(np.interp(age, list(_GROWTH), rows[:, column + 1]))


def _within(given: Person, names: tuple[str, ...]) -> Person:
    for name in names:
        value: float | None = getattr(given, name)
        if value is None:
            continue
        low, high = _COVERED[name]
        if not np.isfinite(value):
            raise ValueError(f"{name}: expected a number from {low:g} to {high:g}, got {value}")
        if not low <= value <= high:
            taken = min(max(value, low), high)
            _warn(f"{name}: {value:g} is beyond what the model covers, {low:g} to {high:g}; {taken:g} taken")
            given = replace(given, **{name: taken})
    return given


def _warn(text: str) -> None:
    warnings.warn(text, PersonWarning, stacklevel=4)
