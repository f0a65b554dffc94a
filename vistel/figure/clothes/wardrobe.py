"""What people wear: kinds of garments, colours that go together, and an outfit drawn for a person."""

from dataclasses import dataclass, fields

import numpy as np

from vistel.figure.clothes.weave import WEAVES, Colour

TOPS = ("t-shirt", "sweater", "shirt", "blazer", "dress")
BOTTOMS = ("trousers", "jeans", "skirt")
SHOES = ("shoes", "sneakers")
TOP_COLOURS: tuple[Colour, ...] = (
    (52, 74, 108), (112, 50, 54), (62, 92, 80), (188, 174, 150), (94, 90, 116), (212, 212, 208),
    (170, 118, 66), (78, 82, 88), (146, 88, 104), (44, 48, 58), (128, 142, 150), (226, 222, 212),
)  # fmt: skip
"""sRGB of cloth: blue, wine, green, sand, violet, off-white, ochre, grey, rose, ink, steel, cream."""
BOTTOM_COLOURS: tuple[Colour, ...] = ((40, 46, 62), (58, 57, 56), (104, 92, 74), (50, 64, 92), (80, 82, 88), (126, 110, 88))
JACKET_COLOURS: tuple[Colour, ...] = ((44, 50, 64), (62, 62, 64), (92, 82, 70), (70, 80, 76), (112, 100, 84), (34, 36, 42))
JEANS_COLOURS: tuple[Colour, ...] = ((50, 64, 92), (38, 46, 66), (82, 98, 122), (44, 46, 50))
SHIRT_COLOURS: tuple[Colour, ...] = ((222, 222, 218), (176, 194, 214), (206, 196, 180), (150, 164, 190))
SHOE_COLOURS: tuple[Colour, ...] = ((52, 38, 30), (32, 32, 34), (104, 70, 46), (196, 194, 188))
_LIGHT: Colour = (222, 220, 212)

_DARK: Colour = (66, 78, 98)


@dataclass(frozen=True)
class Outfit:
    """top, bottom, shoes: one of TOPS, BOTTOMS, SHOES. pattern: of the top, one of WEAVES. Colours are sRGB, 0 to 255; second: of
    stripes and checks. Raises ValueError, one line, for what is not known."""

    top: str = "t-shirt"
    pattern: str = "plain"
    bottom: str = "trousers"
    shoes: str = "shoes"
    top_colour: Colour = TOP_COLOURS[0]
    second: Colour = _LIGHT
    bottom_colour: Colour = BOTTOM_COLOURS[0]
    shoe_colour: Colour = SHOE_COLOURS[0]
    seed: int = 0

    def __post_init__(self) -> None:
        known = {"top": TOPS, "bottom": BOTTOMS, "shoes": SHOES, "pattern": WEAVES}
        for name, words in known.items():
            if getattr(self, name) not in words:
                raise ValueError(f"outfit: {name}: expected one of {', '.join(words)}, got {getattr(self, name)!r}")
        for each in fields(self):
            value: Colour | str | int = getattr(self, each.name)
            if isinstance(value, tuple) and (len(value) != 3 or not np.isfinite(value).all() or min(value) < 0 or max(value) > 255):
                raise ValueError(f"outfit: {each.name}: expected red, green and blue from 0 to 255, got {value}")


_KINDS = {  # share of each of TOPS that children, men and women wear
    "child": (0.55, 0.40, 0.05, 0.0, 0.0),
    "male": (0.24, 0.26, 0.26, 0.24, 0.0),
    "female": (0.20, 0.25, 0.21, 0.16, 0.18),
}
_PATTERNS = {  # share of each of WEAVES but denim, by kind of top
    "t-shirt": (0.60, 0.0, 0.32, 0.08),
    "sweater": (0.22, 0.58, 0.20, 0.0),
    "shirt": (0.55, 0.0, 0.20, 0.25),
    "blazer": (0.82, 0.0, 0.0, 0.18),
    "dress": (0.85, 0.0, 0.15, 0.0),
}
_CHILD = 13.0
"""Years."""


def drawn_outfit(sex: str, age: float, seed: int) -> Outfit:
    """What a person of that sex and age [years] may wear."""
    rng = np.random.default_rng((seed, 23))
    who = "child" if age < _CHILD else sex
    top = str(rng.choice(TOPS, p=_KINDS[who]))
    pattern = str(rng.choice(WEAVES[:4], p=_PATTERNS[top]))
    palette = JACKET_COLOURS if top == "blazer" else TOP_COLOURS
    colour = palette[int(rng.integers(len(palette)))]
    skirt = who == "female" and top in ("shirt", "blazer", "sweater") and rng.random() < 0.3
    jeans = rng.random() < (0.25 if top == "blazer" else 0.5)
    bottoms = JEANS_COLOURS if jeans and not skirt else BOTTOM_COLOURS
    light = sum(colour) > 480
    plain_shoes = top in ("blazer", "dress", "shirt") or rng.random() < 0.35
    return Outfit(
        top,
        pattern,
        "skirt" if skirt else "jeans" if jeans else "trousers",
        "shoes" if plain_shoes and who != "child" else "sneakers",
        colour,
        SHIRT_COLOURS[int(rng.integers(len(SHIRT_COLOURS)))] if top == "blazer" else _DARK if light else _LIGHT,
        bottoms[int(rng.integers(len(bottoms)))],
        SHOE_COLOURS[int(rng.integers(len(SHOE_COLOURS) - plain_shoes))],
        seed,
    )
