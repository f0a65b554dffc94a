"""Tops that are pulled over: T-shirt and sweater."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F32, F64
from vistel.figure.clothes.build import ARM, TRUNK, Build
from vistel.figure.clothes.cloth import Cloth
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.panels import of_top
from vistel.figure.clothes.sheet import Paint
from vistel.figure.clothes.shell import Pattern, Tables, of_skin, shell
from vistel.figure.clothes.strip import hem, offsets, with_strip
from vistel.figure.clothes.tube import Tube, eased, hung
from vistel.figure.clothes.weave import Floats, Look, Weave
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
    """Of a top. Lengths are in metres, for a body of usual height. clear: least distance from the skin; over: how much farther out
    it lies over what is worn below the waist; thick: of its cloth; loose, ease, sleeve_ease, taper: as `trunk_table` and
    `sleeve_table` have them; sleeve: as `sleeves` has it; hem: as `hem_height` has it; neck: as `neckline` has it; collar: height
    of a ribbed one; ribs: height of ribbed cuffs and hem, 0 for hems that are folded in; tucked: whether it goes under what is worn
    below the waist."""

    clear: float = 0.006
    over: float = 0.010
    thick: float = 0.0022
    loose: float = 0.55
    ease: float = 0.012
    sleeve: float = 0.34
    sleeve_ease: float = 0.010
    taper: float = 0.10
    hem: float = 0.30
    neck: tuple[float, float] = (1.22, 0.016)
    collar: float = 0.016
    ribs: float = 0.0
    tucked: bool = False


T_SHIRT = Cut()
SWEATER = Cut(0.010, 0.014, 0.0035, 0.75, 0.016, 0.99, 0.013, 0.13, 0.22, (1.24, 0.012), 0.024, 0.055)
_HANGS = 0.65
_HEM = 0.032
_RIB = 0.0062
"""Width of a rib [m]."""


def top_pattern(build: Build, cut: Cut, borders: Mapping[str, Field]) -> Pattern:
    """Trunk and sleeves inside borders."""
    over = above(build.waist + 0.05 * build.scale)

    def clear(p: F64) -> F64:
        return cut.clear + cut.over * smooth(-over(p) / (0.06 * build.scale))

    arms = [sleeve_table(tube, cut.clear, cut.sleeve_ease, cut.taper) for tube in build.arms]
    trunk = trunk_table(build, cut.clear, cut.loose, cut.ease)
    if cut.tucked:
        low = build.trunk.origin[1] - build.trunk.s[:, None]
        tight = build.trunk.girth + cut.clear
        trunk = tight + smooth((low - build.waist - 0.01 * build.scale) / (0.07 * build.scale)) * (trunk - tight)
    tables: Tables = (trunk, arms[0], arms[1], None, None)
    return Pattern(UPPER, borders, clear, tables, of_top(build), hangs=0.0 if cut.tucked else _HANGS)


def beyond_wrist(build: Build, rim: F64, room: float) -> float:
    """How much farther a rim (N, 3) round an arm is from it than a cuff with so much room round the wrist [m]."""
    far = float(np.linalg.norm((rim - rim.mean(axis=0))[:, 1:], axis=1).mean())
    return max(0.0, far - float(build.arms[0].girth[-1].mean()) - room)


def round_wrists(build: Build, rows: F64, room: float) -> F64:
    """Rows of points (K, N, 3) round an arm with at least so much room [m] round it: wrists are flat, what is drawn in is not."""
    tube = build.arms[int(rows[..., 0].mean() < 0.0)]
    s, angle, far, way = tube.polar(rows.reshape(-1, 3))
    more = np.maximum(tube.read(tube.girth, s, angle) + room - far, 0.0)
    return rows + (more[:, None] * way).reshape(rows.shape)


def pulled_over(name: str, build: Build, cut: Cut, weave: Weave, seed: int) -> Worn:
    """A T-shirt or a sweater."""
    scale = build.scale
    ribs = cut.ribs * scale
    cuff = sleeves(build, cut.sleeve)
    borders: dict[str, Field] = {
        "neck": neckline(build, *cut.neck),
        "hem": above(hem_height(build, cut.hem) + ribs),
        "cuff": lambda p: cuff(p) - ribs,
    }
    pattern = top_pattern(build, cut, borders)
    made = shell(build, pattern)
    cloth = made.cloth
    hems: list[Cloth] = []
    for rim, rings in made.rims.items():
        for at in rings:
            if rim == "neck":
                up = cut.collar * scale
                steps = [(0.0014, 0.0), (0.0016, 0.5 * up), (0.0006, up)]
            else:
                tight = beyond_wrist(build, cloth.points[at], 0.006) if rim == "cuff" else 0.2 * cut.ease
                steps = [(-0.35 * tight, 0.06 * ribs), (-tight, 0.3 * ribs), (-tight, ribs)] if ribs else []
            ring = at
            if steps:
                rows = offsets(cloth, at, steps)
                if rim == "cuff":
                    rows = round_wrists(build, rows, 0.004)
                cloth, ring = with_strip(cloth, at, rows, f"{rim}_rib", _of_rib(build, rim, rows))
            hems.append(hem(cloth, ring, cut.thick, _HEM, edge=rim != "hem"))
    whole = replace(pattern, borders=borders | {"hem": above(hem_height(build, cut.hem)), "cuff": cuff})
    return Worn(
        name,
        cloth,
        whole.hides(build, 0.008 if cut.ribs else 0.016),
        whole.sinks(build),
        whole.inside,
        painter(weave, seed),
        (1500, 560),
        hems=tuple(hems),
        both_sides=True,
    )


def _of_rib(build: Build, rim: str, rows: F64) -> F32 | None:
    """Bones' shares of ribs (K, N, 3): round neck and wrists they go with the skin, a hem with the cloth above it."""
    beside = {"neck": ("neck", *TRUNK), "cuff": (*ARM, "palm")}
    return of_skin(build, rows, *beside[rim]) if rim in beside else None


def painter(weave: Weave, seed: int) -> Paint:
    """The look of all panels, ribs on those whose names say so."""

    def paint(panel: str, u: Floats, v: Floats) -> Look:
        rng = np.random.default_rng((seed, sum(panel.encode())))
        if not panel.endswith("_rib"):
            return weave.look(u, v, rng)
        plain = replace(weave, kind="plain").look(u, v, rng)
        rib = np.cos(2.0 * np.pi * u / _RIB)
        return Look(plain.colour * (0.93 + 0.05 * rib)[..., None], plain.height + 0.0005 * rib)

    return paint
