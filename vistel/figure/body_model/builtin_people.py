"""Ten built-in people of all ages, shapes and origins. Their faces were chosen by looking at seeds."""

from vistel.figure.body_model.person import Person
from vistel.figure.clothes.wardrobe import Outfit

_BLAZER = Outfit("blazer", top_colour=(44, 50, 66), second=(214, 214, 210), bottom_colour=(104, 92, 74), shoe_colour=(52, 38, 30))
_SWEATER = Outfit("sweater", "knit", "jeans", "sneakers", (122, 46, 54), bottom_colour=(52, 60, 78), shoe_colour=(196, 194, 188))

PEOPLE: dict[str, Person] = {
    "aiko": Person("female", 34.0, 1.64, 54.0, origin=(0.0, 1.0, 0.0), face_seed=7, skin=0.22, hair="bob"),
    "ben": Person(
        "male", 45.0, 1.82, 82.0, muscle=0.6, origin=(1.0, 0.0, 0.0), face_seed=5, skin=0.80, hair="short", outfit=_BLAZER
    ),
    "carla": Person("female", 29.0, 1.71, 63.0, origin=(0.35, 0.0, 0.65), face_seed=1, skin=0.42, hair="long", outfit=_SWEATER),
    "david": Person("male", 67.0, 1.76, 79.0, origin=(0.0, 0.0, 1.0), face_seed=8, skin=0.10),
    "erik": Person("male", 38.0, 1.86, 84.0, origin=(0.0, 0.0, 1.0), face_seed=4, skin=0.14, hair="side_parting"),
    "farah": Person("female", 52.0, 1.60, 66.0, origin=(0.15, 0.25, 0.60), face_seed=3, skin=0.48, hair="bob"),
    "grace": Person("female", 73.0, 1.59, 64.0, origin=(1.0, 0.0, 0.0), face_seed=10, skin=0.76, hair="curly"),
    "hiro": Person("male", 24.0, 1.73, 65.0, origin=(0.0, 1.0, 0.0), face_seed=12, skin=0.26),
    "ines": Person("female", 11.0, 1.45, 37.0, origin=(0.0, 0.0, 1.0), face_seed=9, skin=0.20),
    "jonas": Person("male", 31.0, 1.79, 104.0, origin=(0.0, 0.1, 0.9), face_seed=11, skin=0.12),
}
"""By name; the demonstration's three come first."""


def builtin_person(name: str) -> Person:
    """Raises ValueError, one line, for a name that is not known."""
    if name not in PEOPLE:
        raise ValueError(f"no built-in person {name!r}; expected one of {', '.join(PEOPLE)}")
    return PEOPLE[name]
