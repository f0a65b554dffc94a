"""Skirts and dresses: cloth that hangs round both legs at once from the hips."""

from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.clothes.build import SIDES, TRUNK, Build
from vistel.figure.clothes.cloth import BONES, Cloth
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.panels import of_top
from vistel.figure.clothes.shell import Pattern, Tables, shell
from vistel.figure.clothes.strip import hem, offsets, with_strip
from vistel.figure.clothes.tops import Cut, above, below, neckline, painter, sleeves, top_pattern
from vistel.figure.clothes.tube import COLUMNS, Tube, hung, tube
from vistel.figure.clothes.weave import Weave
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.smoothstep import smooth

DRESS = Cut(0.006, 0.0, 0.0020, 0.35, 0.010, 0.30, 0.006, 0.16, 0.0, (1.45, 0.035))
_ROWS = 6
_BAND = 0.035


@dataclass(frozen=True)
class SkirtCut:
    """length: how far down it goes, 0 at the crotch, 1 at the knee, 2 at the ankle; flare: how much wider it becomes per metre;
    folds: how many, and their depth at the hem, for a body of usual height [m]; clear, thick [m]."""

    length: float = 0.86
    flare: float = 0.07
    folds: tuple[int, float] = (9, 0.005)
    clear: float = 0.011
    thick: float = 0.0020


def skirt(name: str, build: Build, cut: SkirtCut, weave: Weave, seed: int) -> Worn:
    """From the waist."""
    scale = build.scale
    band = _BAND * scale
    borders = {"waist": below(build.waist - band), "hips": above(_hips(build))}
    tables: Tables = (build.trunk.girth + cut.clear, None, None, None, None)
    pattern = Pattern((*TRUNK, "thigh"), borders, lambda p: np.full(len(p), cut.clear), tables, of_top(build))
    made = shell(build, pattern)
    cloth = made.cloth
    hems: list[Cloth] = []
    for at in made.rims["waist"]:
        cloth, ring = with_strip(cloth, at, offsets(cloth, at, [(0.0015, 0.001), (0.0018, band)]), "waistband")
        hems.append(hem(cloth, ring, cut.thick, 0.02))
    cloth, edge = _hung(build, cloth, made.rims["hips"][0], cut)
    hems.append(edge)
    whole = replace(
        pattern, limbs=(*TRUNK, "thigh", "shank"), borders={"waist": below(build.waist), "hem": above(_end(build, cut))}
    )
    return Worn(
        name,
        cloth,
        whole.hides(build, 0.03),
        whole.sinks(build),
        whole.inside,
        painter(weave, seed),
        (1100, 480),
        hems=tuple(hems),
        both_sides=True,
        hangs=below_hips(build),
    )


def dress(name: str, build: Build, cut: Cut, lower: SkirtCut, weave: Weave, seed: int) -> Worn:
    """A top and a skirt of one piece."""
    borders = {"neck": neckline(build, *cut.neck), "hips": above(_hips(build)), "cuff": sleeves(build, cut.sleeve)}
    pattern = top_pattern(build, cut, borders)
    made = shell(build, pattern)
    cloth = made.cloth
    hems: list[Cloth] = []
    for rim, rings in made.rims.items():
        for ring in rings:
            if rim == "hips":
                cloth, edge = _hung(build, cloth, ring, lower)
                hems.append(edge)
            else:
                hems.append(hem(cloth, ring, cut.thick, 0.018))
    whole = replace(pattern, limbs=(*pattern.limbs, "shank"), borders=borders | {"hips": above(_end(build, lower))})
    return Worn(
        name,
        cloth,
        whole.hides(build, 0.045),
        whole.sinks(build),
        whole.inside,
        painter(weave, seed),
        (1900, 800),
        hems=tuple(hems),
        both_sides=True,
        hangs=below_hips(build),
    )


def _hips(build: Build) -> float:
    """Height below which cloth hangs free [m]."""
    return float(max(build.crotch + 0.035 * build.scale, build.joint("left_upper_leg")[1] - 0.03 * build.scale))


def below_hips(build: Build) -> Field:
    """How far below the hips a place is."""
    hips = _hips(build)
    return lambda p: hips - p[:, 1]


def _end(build: Build, cut: SkirtCut) -> float:
    knee, ankle = build.joint("left_lower_leg")[1], build.joint("left_foot")[1]
    return float(np.interp(cut.length, (0.0, 1.0, 2.0), (build.crotch, knee, ankle)))


def _both_legs(build: Build) -> Tube:
    top = build.joint("spine_8")
    p = build.places("pelvis", "crotch", "thigh", "shank")
    low = build.joint("left_foot")[1] + 0.03
    return tube(p, top, -np.eye(3)[1], np.eye(3)[2], (float(top[1] - _hips(build) - 0.06), float(top[1] - low)))


def _hung(build: Build, cloth: Cloth, ring: I32, cut: SkirtCut) -> tuple[Cloth, Cloth]:
    """The cloth with a skirt sewn to a rim at the hips, and its hem."""
    legs, scale, p = _both_legs(build), build.scale, cloth.points[ring]
    # To the sides it hangs straight; in front and behind it stays near the thighs, on which it lies when they are raised.
    hull, side = legs.girth + cut.clear, np.abs(np.sin(np.arange(COLUMNS) * (2.0 * np.pi / COLUMNS)))
    table = np.maximum(hung(legs, hull, -1.0, 0.22), side**2 * hung(legs, hull, -1.0, 0.04))
    start, end = float(p[:, 1].mean()), _end(build, cut)
    s, angle, far, way = legs.polar(p)
    rows: list[F64] = []
    for k in range(1, _ROWS + 1):
        t = k / _ROWS
        down = t * (start - end)
        wanted = legs.read(table, s + down, angle) + cut.flare * down
        wave = cut.folds[1] * scale * t**1.5 * (1.0 + np.cos(cut.folds[0] * angle))
        at = p + (smooth(3.0 * t) * (wanted - far) + wave)[:, None] * way
        at[:, 1] = p[:, 1] - down
        rows.append(at)
    stack = np.array(rows)
    weight, limb = _following(build, stack, cloth.weight[ring])
    cloth, edge = with_strip(cloth, ring, stack, "skirt", weight, limb)
    # Not all of a skirt is a border.
    cloth.rim[-stack[..., 0].size : -len(ring)] = False
    return cloth, hem(cloth, edge, cut.thick, 0.025, edge=False)


def _following(build: Build, rows: F64, rim: F32) -> tuple[F32, I32]:
    """(K, N, BONES) and (K, N): a skirt goes from the hips over to both thighs, below the knees to the shanks, and between left and
    right from one to the other."""
    scale, x, y = build.scale, rows[..., 0], rows[..., 1]
    hip, knee = build.joint("left_upper_leg"), build.joint("left_lower_leg")[1]
    leg = smooth((hip[1] + 0.05 * scale - y) / (0.15 * scale))
    shank = 0.85 * smooth((knee + 0.05 * scale - y) / (0.10 * scale))
    left = smooth(0.5 + 0.5 * x / hip[0])
    weight = np.zeros((*x.shape, BONES), np.float32)
    for side, share in zip(SIDES, (left, 1.0 - left), strict=True):
        weight[..., JOINT_INDEX[f"{side}_upper_leg"]] = leg * share * (1.0 - shank)
        weight[..., JOINT_INDEX[f"{side}_lower_leg"]] = leg * share * shank
    weight[..., JOINT_INDEX["hips"]] = 1.0 - leg
    blend = smooth((np.arange(len(rows)) + 1.0) / 3.0)[:, None, None].astype(np.float32)
    weight = blend * weight + (1.0 - blend) * rim
    index = {n: build.names.index(n) for n in build.names}
    of = [[index[f"{side}_{name}"] for name in ("thigh", "shank")] for side in SIDES]
    limb = np.where(shank > 0.5, np.where(x > 0.0, of[0][1], of[1][1]), np.where(x > 0.0, of[0][0], of[1][0]))
    return weight.astype(np.float32), limb.astype(np.int32)
