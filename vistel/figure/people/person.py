"""A built-in person as the body model makes people: what a recipe's numbers mean."""

import numpy as np

from vistel.figure.body_model.person import Person, usual_weight
from vistel.figure.clothes.wardrobe import Outfit
from vistel.figure.people.recipe import HAIR_STYLES, PATTERNS, Recipe

_FACE: dict[str, tuple[tuple[str, float], ...]] = {  # details of the body model for 1 of each feature
    "nose": (("nose-scale-vert", 0.25), ("nose-scale-horiz", 0.30), ("nose-scale-depth", 0.25)),
    "jaw": (("chin-width", 0.40), ("chin-bones", 0.30)),
    "lips": (("mouth-lowerlip-volume", 0.40), ("mouth-upperlip-volume", 0.40)),
    "cheeks": (("cheek-volume", 0.45),),
    "eye_opening": (("eye-height2", 0.25),),
}
_LIGHTEST, _DARKER = 0.20, 0.115
"""Of `Person.skin`: the first colour of a recipe's palette, and by how much each further one is darker."""
_SECOND = {True: (66, 78, 98), False: (222, 220, 212)}
"""Colour of stripes and checks on light cloth and on dark."""


def person_of(recipe: Recipe, height: float) -> Person:
    """The person of a recipe, `height` metres tall."""
    sex = "female" if recipe.female > 0.5 else "male"
    skin = _LIGHTEST + _DARKER * recipe.skin
    dark = float(np.clip((skin - 0.35) / 0.35, 0.0, 1.0))
    asian = float(np.random.default_rng((recipe.seed, 11)).random()) * (1.0 - dark)
    return Person(
        sex,
        recipe.age,
        height,
        usual_weight(sex, recipe.age, height) * recipe.build**2,
        origin=(dark, asian, 1.0 - dark - asian),
        face_seed=recipe.seed,
        skin=skin,
        details={name: getattr(recipe, feature) * most for feature, row in _FACE.items() for name, most in row},
        hair=HAIR_STYLES[recipe.hair_style],
        hair_colour=recipe.colour("hair"),
        eyes=recipe.colour("eyes"),
        outfit=_outfit(recipe),
    )


def _outfit(recipe: Recipe) -> Outfit:
    pattern = PATTERNS[recipe.pattern]
    top = {"jacket": "blazer", "knit": "sweater"}.get(pattern, ("t-shirt", "shirt")[recipe.seed % 2])
    colour = recipe.colour("top")
    return Outfit(
        top,
        "plain" if pattern == "jacket" else pattern,
        ("trousers", "jeans")[recipe.seed // 2 % 2],
        ("shoes", "sneakers")[recipe.seed // 4 % 2],
        colour,
        _SECOND[sum(colour) > 480],
        recipe.colour("trousers"),
        recipe.colour("shoes"),
        recipe.seed,
    )
