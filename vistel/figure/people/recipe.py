"""What a built-in person looks like, as numbers; drawn from a seed, each number may be given in the avatar's spec."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

_PALETTES: dict[str, tuple[tuple[int, int, int], ...]] = {
    "skin": ((212, 164, 136), (201, 150, 120), (188, 136, 102), (170, 119, 85), (148, 99, 68), (122, 79, 53), (98, 62, 43)),
    "hair": ((28, 22, 20), (52, 35, 25), (84, 55, 34), (122, 82, 48), (173, 128, 75), (136, 66, 36), (150, 146, 142)),
    "top": (
        (46, 74, 118),
        (122, 38, 46),
        (52, 92, 78),
        (196, 178, 150),
        (92, 88, 120),
        (214, 214, 210),
        (196, 120, 44),
        (70, 74, 80),
        (158, 76, 104),
    ),
    "trousers": ((38, 44, 62), (58, 56, 54), (96, 84, 66), (44, 60, 92), (76, 78, 84), (122, 104, 80)),
    "shoes": ((44, 32, 26), (30, 30, 32), (108, 70, 42), (196, 194, 188)),
    "eyes": ((92, 58, 32), (64, 42, 28), (84, 110, 132), (92, 108, 74), (128, 104, 62)),
}


@dataclass(frozen=True)
class Recipe:
    """A person's look. Sizes are ratios to the average; colours are indices into the palettes.

    build: girth; female: 0 male look, 1 female look; hair_style: 0 short, 1 side parting, 2 bob, 3 bun, 4 cropped,
    5 long; pattern: 0 plain, 1 knit, 2 stripes, 3 checks, 4 jacket over a shirt; nose, jaw, lips, cheeks, eye_opening:
    -1 small to 1 large.
    """

    seed: int = 0
    build: float = 1.0
    female: float = 0.0
    skin: int = 1
    hair: int = 1
    hair_style: int = 0
    eyes: int = 0
    top: int = 0
    pattern: int = 0
    trousers: int = 0
    shoes: int = 0
    nose: float = 0.0
    jaw: float = 0.0
    lips: float = 0.0
    cheeks: float = 0.0
    eye_opening: float = 0.0

    def colour(self, what: str) -> tuple[int, int, int]:
        """sRGB of "skin", "hair", "top", "trousers", "shoes" or "eyes"."""
        index: int = getattr(self, what)
        return _PALETTES[what][index]


HAIR_STYLES = 6
PATTERNS = 5
_SHARED = {"skin", "hair", "top", "pattern", "shoes"}
"""Words that people of the body model have, too; here they are numbers of a palette."""
_FEATURES = ("nose", "jaw", "lips", "cheeks", "eye_opening")


_OF_SCULPTED = {f.name for f in fields(Recipe)} - _SHARED


def is_sculpted(spec: str) -> bool:
    """Whether a specification means a sculpted person, not one of the body model (`vistel.figure.people.measured`)."""
    kind, _, text = spec.partition(":")
    given = [item.partition("=")[::2] for item in text.split(",") if item.strip()]
    words = {word.strip() for word, _ in given}
    palettes = bool(words) and words <= _SHARED and all(value.strip().isdigit() for _, value in given)
    return kind == "builtin" and (bool(words & _OF_SCULPTED) or palettes)


def recipe_from_seed(seed: int) -> Recipe:
    """The person with this seed."""
    rng = np.random.default_rng(seed)
    female = float(rng.random() < 0.5)
    pick = {what: int(rng.integers(len(colours))) for what, colours in _PALETTES.items()}
    if pick["skin"] >= 4:
        pick["hair"] = int(rng.choice((0, 0, 1, 6)))
        pick["eyes"] = int(rng.integers(2))
    styles = (2, 3, 5) if female else (0, 1, 4)
    features = {feature: round(float(rng.uniform(-1.0, 1.0)), 3) for feature in _FEATURES}
    drawn: dict[str, Any] = {**pick, **features, "female": female}
    drawn["build"] = round(float(rng.uniform(0.93, 1.10)), 3)
    drawn["hair_style"] = int(rng.choice(styles))
    drawn["pattern"] = int(rng.integers(PATTERNS))
    return Recipe(seed=seed, **drawn)


def parse_spec(spec: str, name: str) -> Recipe:
    """The recipe of "builtin:build=1" (seeded by the name), "builtin:seed=3" or "builtin:seed=3,build=1.1,hair_style=2".

    Raises ValueError naming the key and what was expected.
    """
    kind, _, text = spec.partition(":")
    if kind != "builtin":
        raise ValueError(f"avatar {spec!r}: expected builtin or builtin:key=value,...")
    given: dict[str, str] = {}
    for item in filter(None, text.split(",")):
        key, equals, value = item.partition("=")
        if not equals:
            raise ValueError(f"avatar {spec!r}: expected key=value, got {item!r}")
        given[key.strip()] = value.strip()
    known = {f.name: f.type for f in fields(Recipe)}
    for key in given:
        if key not in known:
            raise ValueError(f"avatar {spec!r}: unknown key {key!r}, expected one of {', '.join(known)}")
    seed = _number(spec, "seed", given.get("seed", str(_seed_of(name))), 0, 2**32 - 1, whole=True)
    recipe = recipe_from_seed(int(seed))
    limits = {"build": (0.8, 1.35), "female": (0.0, 1.0), "hair_style": (0, HAIR_STYLES - 1), "pattern": (0, PATTERNS - 1)}
    limits |= dict.fromkeys(_FEATURES, (-1.0, 1.0))
    for key, value in given.items():
        if key == "seed":
            continue
        low, high = limits[key] if key in limits else (0, len(_PALETTES[key]) - 1)
        whole = known[key] == "int"
        number = _number(spec, key, value, low, high, whole=whole)
        recipe = replace(recipe, **{key: int(number) if whole else number})
    return recipe


def _seed_of(name: str) -> int:
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "little")


def _number(spec: str, key: str, text: str, low: float, high: float, *, whole: bool) -> float:
    try:
        value = int(text) if whole else float(text)
    except ValueError:
        value = None
    if value is None or not low <= value <= high:
        kind = "a whole number" if whole else "a number"
        raise ValueError(f"avatar {spec!r}: {key}: expected {kind} from {low} to {high}, got {text!r}")
    return value
