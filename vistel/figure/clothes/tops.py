"""Tops that are pulled over: T-shirt and sweater."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.clothes.build import ARM, TRUNK, Build
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.panels import of_top
from vistel.figure.clothes.shell import Pattern, Tables, shell
from vistel.figure.clothes.sheet import Look, Paint
from vistel.figure.clothes.strip import hemmed, offsets, with_strip
from vistel.figure.clothes.tube import Tube, eased, hung
from vistel.figure.clothes.weave import Weave
from vistel.geometry.smoothstep import smooth

UPPER = (*TRUNK, *ARM, "neck", "thigh", "palm")
"""Limbs that a top may cover."""


def neckline(build: Build, wide: float, deep: float) -> Field:
    """Round the neck: wide: of its radius; deep: how much farther it goes to the front [m]."""
    middle, radius = build.neck
    base = build.joint("neck")[1]
    top = 0.5 * (base + build.joint("head")[1])
    axis = build.joint("head") - build.joint("neck")
    axis = axis / np.linalg.norm(axis)
    front = np.cross(np.eye(3)[0], axis)

    def inside(p: F64) -> F64:
        q = p - middle
        z = q @ front
        reach = wide * radius
        far = np.hypot(q[:, 0] / reach, z / (reach + np.where(z > 0.0, deep, 0.0)))
        # The tube round the neck goes on through back and chest, where it is none.
        low = base - 0.012 * build.scale - 1.6 * np.maximum(z, 0.0)
        return np.minimum(np.maximum((far - 1.0) * reach, low - p[:, 1]), top - p[:, 1])

    return inside


def sleeves(build: Build, share: float) -> Field:
    """Sleeves as long as a share of the arm, 1 to the wrist."""
    shoulder, wrist = build.joint("left_upper_arm")[0], build.joint("left_hand")[0]
    end = shoulder + share * (wrist - shoulder)
    return lambda p: end - np.abs(p[:, 0])


def above(height: float) -> Field:
    """Down to a height [m]."""
    return lambda p: p[:, 1] - height


def below(height: float) -> Field:
    """Up to a height [m]."""
    return lambda p: height - p[:, 1]


def hem_height(build: Build, share: float) -> float:
    """0 at the crotch, 1 at the waist [m]."""
    return build.crotch + share * (build.waist - build.crotch)


def trunk_table(build: Build, clear: float, loose: float, ease: float) -> F64:
    """Cloth that hangs from the chest: loose: 0 follows the body to 1 hangs straight; ease: more of it all round below [m]."""
    tube = build.trunk
    hull = tube.girth + clear
    bust = float(tube.origin[1] - build.armpit) + 0.02 * build.scale
    straight = hung(tube, hull, bust, 0.10)
    return hull + eased(tube, bust - 0.08, bust + 0.12) * (loose * (straight - hull) + ease)


def sleeve_table(tube: Tube, clear: float, ease: float, taper: float) -> F64:
    """A sleeve that hangs from the shoulder."""
    hull = tube.girth + clear + ease
    even = 0.35 * hull + 0.65 * hull.mean(axis=1, keepdims=True)
    return hung(tube, even, 0.03, taper)


@dataclass(frozen=True)
class Cut:
    """Of a top. thick: of its cloth [m]; over: how much farther out it lies over what is worn below the waist [m]; loose, ease, sleeve_ease, taper: as `trunk_table` and `sleeve_table` have them; ribs: height
    of ribbed collar, cuffs and hem [m], 0 for hems that are folded in."""

    clear: float = 0.006
    thick: float = 0.0022
    over: float = 0.010
    loose: float = 0.55
    ease: float = 0.012
    sleeve: float = 0.34
    sleeve_ease: float = 0.010
    taper: float = 0.06
    hem: float = 0.30
    neck: tuple[float, float] = (1.22, 0.016)


def pulled_over(name: str, build: Build, cut: Cut, weave: Weave, seed: int) -> Worn:
    """A T-shirt or a sweater."""
    hem = hem_height(build, cut.hem)
    borders = {"neck": neckline(build, *cut.neck), "hem": above(hem), "cuff": sleeves(build, cut.sleeve)}
    over = above(build.waist + 0.05 * build.scale)
    clear = lambda p: cut.clear + cut.over * smooth(-over(p) / (0.06 * build.scale))  # noqa: E731
    arms = [sleeve_table(tube, cut.clear, cut.sleeve_ease, cut.taper) for tube in build.arms]
    tables: Tables = (trunk_table(build, cut.clear, cut.loose, cut.ease), arms[0], arms[1], None, None)
    pattern = Pattern(UPPER, borders, clear, tables, of_top(build))
    made = shell(build, pattern)
    cloth = made.cloth
    for rim, rings in made.rims.items():
        for ring in rings:
            if rim == "neck":
                cloth, ring = with_strip(cloth, ring, offsets(cloth, ring, [(0.0014, 0.0), (0.0010, 0.016)]), "collar")
            cloth = hemmed(cloth, ring, cut.thick, 0.018)
    return Worn(name, cloth, pattern.hides(build, 0.028), pattern.inside, painter(weave, seed), (2300, 900, 380))


def painter(weave: Weave, seed: int) -> Paint:
    """The look of all panels."""

    def paint(panel: str, u: F64, v: F64) -> Look:
        rng = np.random.default_rng((seed, sum(panel.encode())))
        return weave.look(u, v, rng)

    return paint
