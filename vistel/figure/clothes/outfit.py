"""An outfit on a body: its garments made, laid over one another, as parts that a person has on."""

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.clothes.blazer import BLAZER, blazer
from vistel.figure.clothes.build import Build
from vistel.figure.clothes.folds import Folds
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.legs import LegCut, trousers
from vistel.figure.clothes.shirt import SHIRT, UNDER_JACKET, shirt
from vistel.figure.clothes.shoes import ShoeCut, shoes
from vistel.figure.clothes.skirt import DRESS, SkirtCut, dress, skirt
from vistel.figure.clothes.tops import SWEATER, T_SHIRT, pulled_over
from vistel.figure.clothes.wardrobe import Outfit
from vistel.figure.clothes.weave import Colour, Weave
from vistel.figure.part import Part

_SOLES: dict[str, Colour] = {"shoes": (34, 32, 30), "sneakers": (226, 224, 218)}
_MARGIN = 0.022
"""What is worn beneath goes on so far under a border [m]."""


def outfit(body: Avatar, wearing: Outfit) -> tuple[Part, ...]:
    """The garments on a naked body of the body model, the outermost first. The same words make the same parts."""
    build = Build.of(body)
    layers = _layers(build, wearing)
    folds = Folds(build, wearing.seed)
    margin = _MARGIN * build.scale
    return tuple(worn.beneath(build, layers[:k], margin).part(folds) for k, worn in enumerate(layers))


def _layers(build: Build, wearing: Outfit) -> list[Worn]:
    """The outermost first."""
    weave = Weave(wearing.pattern, wearing.top_colour, wearing.second)
    legs = Weave("denim" if wearing.bottom == "jeans" else "plain", wearing.bottom_colour, (170, 178, 190))
    cut = ShoeCut(sock=0.0) if wearing.top == "dress" or wearing.bottom == "skirt" else ShoeCut()
    worn = shoes(wearing.shoes, build, cut, wearing.shoe_colour, _SOLES[wearing.shoes], wearing.seed)
    if wearing.top == "dress":
        return [dress("dress", build, DRESS, SkirtCut(), weave, wearing.seed), worn]
    if wearing.bottom == "skirt":
        lower = skirt("skirt", build, SkirtCut(), legs, wearing.seed)
    else:
        belt = wearing.top in ("shirt", "blazer")
        lower = trousers(wearing.bottom, build, LegCut(), legs, wearing.seed, belt=belt)
    if wearing.top == "shirt":
        return [lower, shirt("shirt", build, SHIRT, weave, wearing.seed), worn]
    if wearing.top == "blazer":
        under = Weave("plain", wearing.second)
        jacket = blazer("blazer", build, BLAZER, weave, wearing.seed)
        return [jacket, lower, shirt("shirt", build, UNDER_JACKET, under, wearing.seed), worn]
    return [pulled_over(wearing.top, build, SWEATER if wearing.top == "sweater" else T_SHIRT, weave, wearing.seed), lower, worn]
