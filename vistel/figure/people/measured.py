"""People of the body model by specification: "builtin" (by the name), "builtin:person=ben", "builtin:sex=male,age=40,weight=85"."""

import zlib
from collections.abc import Collection
from dataclasses import replace

from vistel.figure.body_model.builtin_people import PEOPLE, builtin_person
from vistel.figure.body_model.hair.beard import BEARDS
from vistel.figure.body_model.hair.styles import STYLES
from vistel.figure.body_model.person import SEXES, Person, drawn
from vistel.figure.clothes.wardrobe import Outfit, drawn_outfit
from vistel.figure.clothes.weave import WEAVES
from vistel.figure.glasses.glasses import GLASSES

_NUMBERS = {"age": (3.0, 90.0), "weight": (10.0, 200.0), "muscle": (0.0, 1.0), "skin": (0.0, 1.0)}
_SEEDS = {"seed": (0.0, 2.0**31), "face": (0.0, 2.0**31)}
_WEARS = ("top", "pattern", "bottom", "shoes")
KEYS = ("person", "sex", *_NUMBERS, *_SEEDS, "hair", "beard", "glasses", *_WEARS)
"""Words of such a specification."""


def measured(spec: str, name: str, height: float) -> Person:
    """The person of a specification, `height` metres tall. Raises ValueError naming the word and what was expected."""
    given: dict[str, str] = {}
    for item in filter(None, spec.partition(":")[2].split(",")):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or key not in KEYS:
            raise ValueError(f"avatar {spec!r}: expected word=value of the words {', '.join(KEYS)}; got {item!r}")
        given[key] = value
    sex = _one_of(spec, "sex", given["sex"], SEXES) if "sex" in given else None
    known = given.get("person", name if not given and name in PEOPLE else "")
    numbers = {key: _number(spec, key, text, *_NUMBERS[key]) for key, text in given.items() if key in _NUMBERS}
    seeds = {key: int(_number(spec, key, text, *_SEEDS[key])) for key, text in given.items() if key in _SEEDS}
    # Of who is drawn only who they are: how tall they are is told, and their weight goes with that.
    who = drawn(seeds.get("seed", zlib.crc32(name.encode())), sex)
    person = _known(spec, known, height) if known else replace(who, height=height, weight=None)
    person = replace(
        person,
        sex=sex or person.sex,
        face_seed=seeds.get("face", person.face_seed),
        hair=_one_of(spec, "hair", given["hair"], STYLES) if "hair" in given else person.hair,
        beard=_one_of(spec, "beard", given["beard"], BEARDS) if "beard" in given else person.beard,
        glasses=_one_of(spec, "glasses", given["glasses"], GLASSES) if "glasses" in given else person.glasses,
        **numbers,
    )
    wears = {key: given[key] for key in _WEARS if key in given}
    return replace(person, outfit=_dressed(spec, person, wears)) if wears else person


def _dressed(spec: str, person: Person, wears: dict[str, str]) -> Outfit:
    usual = person.outfit or drawn_outfit(person.sex, person.age, person.face_seed)
    if "pattern" in wears:
        _one_of(spec, "pattern", wears["pattern"], WEAVES)
    try:
        return replace(usual, **wears)
    except ValueError as fault:
        raise ValueError(f"avatar {spec!r}: {fault}") from None


def _known(spec: str, name: str, height: float) -> Person:
    try:
        person = builtin_person(name)
    except ValueError as fault:
        raise ValueError(f"avatar {spec!r}: {fault}") from None
    assert person.height is not None and person.weight is not None, "of the built-in people both are told"
    return replace(person, height=height, weight=person.weight * (height / person.height) ** 2)


def _one_of(spec: str, key: str, value: str, words: Collection[str]) -> str:
    if value not in words:
        raise ValueError(f"avatar {spec!r}: {key}: expected one of {', '.join(words)}, got {value!r}")
    return value


def _number(spec: str, key: str, text: str, low: float, high: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not low <= value <= high:
        raise ValueError(f"avatar {spec!r}: {key}: expected a number from {low:g} to {high:g}, got {text!r}")
    return value
