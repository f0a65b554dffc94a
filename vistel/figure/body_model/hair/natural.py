"""Hair as people have it: colours by skin and age, styles by sex and age, drawn at random."""

import numpy as np

Colour = tuple[float, float, float]

COLOURS: dict[str, Colour] = {
    "black": (26, 22, 21), "dark brown": (46, 33, 27), "brown": (72, 50, 36), "auburn": (92, 48, 32), "light brown": (108, 78, 52),
    "red": (140, 74, 40), "dark blond": (140, 108, 72), "blond": (184, 150, 104), "grey": (142, 139, 136), "white": (206, 203, 198),
}  # fmt: skip
"""sRGB, 0 to 255."""
_SHARES = {  # how usual each is in people of light skin; with darker skins the first ones prevail
    "black": 0.10, "dark brown": 0.27, "brown": 0.25, "auburn": 0.05, "light brown": 0.14, "red": 0.03, "dark blond": 0.10,
    "blond": 0.06,
}  # fmt: skip
_STYLES: dict[str, dict[str, float]] = {  # how usual a style is
    "female": {"bob": 0.24, "long": 0.28, "bun": 0.18, "curly": 0.14, "short": 0.06, "side_parting": 0.10},
    "male": {"short": 0.36, "side_parting": 0.28, "cropped": 0.20, "curly": 0.10, "shaved": 0.06},
}


def natural_colour(skin: float, age: float, rng: np.random.Generator) -> Colour:
    """A hair colour usual for people of that skin, 0 the lightest to 1 the darkest, and age [years]: greyer from 35 years on."""
    names = tuple(_SHARES)
    share = np.array([_SHARES[name] for name in names])
    dark = np.clip((skin - 0.25) / 0.3, 0.0, 1.0)
    share = (1.0 - dark) * share + dark * np.array([0.8, 0.2] + [0.0] * (len(names) - 2))
    own = np.array(COLOURS[names[int(rng.choice(len(names), p=share / share.sum()))]], np.float64)
    own *= rng.uniform(0.9, 1.1)
    grey = float(np.clip((age - rng.uniform(35.0, 60.0)) / 28.0, 0.0, 1.0))
    pale = np.array(COLOURS["white" if age > 72.0 else "grey"])
    r, g, b = ((1.0 - grey) * own + grey * pale).tolist()
    return r, g, b


def usual_style(sex: str, age: float, rng: np.random.Generator) -> str:
    """The name of a style (of `styles.STYLES`) usual for that sex, "female" or "male", and age [years]."""
    usual = dict(_STYLES[sex])
    if sex == "female" and age > 55.0:
        usual |= {"long": 0.03, "bob": 0.30, "curly": 0.24, "short": 0.12}
    if sex == "male" and age > 45.0:
        usual |= {"shaved": 0.14, "curly": 0.05}
    if age < 13.0:
        usual.pop("shaved", None)
        usual["bun"] = 0.5 * usual.get("bun", 0.0)
    share = np.array(list(usual.values()))
    return list(usual)[int(rng.choice(len(share), p=share / share.sum()))]


def usual_beard(sex: str, age: float, rng: np.random.Generator) -> str:
    """The name of a beard (of `beard.BEARDS`) usual for that sex, "female" or "male", and age [years]."""
    drawn = float(rng.random())
    if sex != "male" or age < 20.0 or drawn > 0.36:
        return "none"
    return "short_beard" if drawn < 0.22 else "full_beard" if drawn < 0.29 else "moustache"


def receding(sex: str, age: float, rng: np.random.Generator) -> float:
    """How far the hairline has gone back at the temples, 0 to 1."""
    most = float(rng.random()) ** 1.5
    return most * float(np.clip((age - 22.0) / 45.0, 0.0, 1.0)) * (1.0 if sex == "male" else 0.15)
