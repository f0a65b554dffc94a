"""Shoes: an upper round the foot, a welt and a sole that stands on the floor."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, Bool
from vistel.figure.clothes.build import SIDES, Build
from vistel.figure.clothes.cloth import Cloth, dense, sewn, thinned
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.sheet import Paint
from vistel.figure.clothes.shell import covered, spread
from vistel.figure.clothes.strip import rolled
from vistel.figure.clothes.weave import Colour, Floats, Look
from vistel.geometry.smoothstep import smooth

_COLUMNS = 28
_INSTEP = 0.022
"""How much higher the opening is in front, for a body of usual height [m]."""
_LACES = 0.018, 0.042
"""Where laces begin below the edge that is folded in, and how far they go [m]."""
_DIRECTIONS = 96


@dataclass(frozen=True)
class ShoeCut:
    """Lengths for a body of usual height [m]. sole: its height; welt: how far it stands out; room: round the foot; top: height of
    the opening above the ankle joint; sock: how far a sock shows above it, 0 for none."""

    sole: float = 0.022
    welt: float = 0.004
    room: float = 0.004
    top: float = 0.004
    sock: float = 0.075


def shoes(name: str, build: Build, cut: ShoeCut, colour: Colour, sole: Colour, seed: int) -> Worn:
    """A pair."""
    cloth = thinned(sewn([piece for side in SIDES for piece in _shoe(build, side, cut)]), 640)[0]
    hides, sinks = _beneath(build, cut)
    return Worn(name, cloth, hides, sinks, lambda p: np.full(len(p), -1.0), _painter(colour, sole, seed), (540, 260), 0.45)


def _opening(build: Build, cut: ShoeCut) -> float:
    return float(build.joint("left_foot")[1]) + cut.top * build.scale


def _beneath(build: Build, cut: ShoeCut) -> tuple[tuple[Bool, ...], tuple[F32, ...]]:
    """What `vistel.figure.part.Part` hides and sinks: the skin below the opening, which is higher on the instep, or
    below the edge of the sock."""
    scale, hides, sinks = build.scale, list[Bool](), list[F32]()
    ankle = float(build.joint("left_foot")[2])
    for mesh in build.levels:
        y, z = mesh.vertices[:, 1].astype(np.float64), mesh.vertices[:, 2].astype(np.float64)
        instep = np.clip((z - ankle) / (0.06 * scale) + 0.5, 0.0, 1.0)
        deep = _opening(build, cut) + scale * (0.8 * cut.sock if cut.sock else _INSTEP * instep - 0.010) - y
        deep = np.where(build.on(mesh, "foot", "shank"), deep, -1.0)
        hides.append(covered(mesh, deep > 0.0))
        way = deep / (0.02 * scale)
        # Heels are rounder than the shoe's rings, which are evened.
        sinks.append((0.004 * (smooth(way + 1.0) + smooth(way)) * (deep > -0.5)).astype(np.float32))
    return tuple(hides), tuple(sinks)


def _shoe(build: Build, side: str, cut: ShoeCut) -> list[Cloth]:
    mesh, scale = build.levels[0], build.scale
    row = build.on(mesh, f"{side}_foot", f"{side}_shank") & (mesh.vertices[:, 1] < _opening(build, cut) + 0.14 * scale)
    p = mesh.vertices[row].astype(np.float64)
    sole, top = cut.sole * scale, _opening(build, cut)
    # The foot stands in the shoe, on the sole; at the ankle it is where it was.
    lift = 0.8 * sole * np.clip((top - p[:, 1]) / (top - 0.3 * top), 0.0, 1.0)
    p[:, 1] += lift

    def ring(height: float, room: float) -> F64:
        q = p[(p[:, 1] >= height - 0.002) & (p[:, 1] < top + 0.03 * scale)][:, [0, 2]]
        at = _outline(q, room * scale)
        return np.column_stack([at[:, 0], np.full(_COLUMNS, height), at[:, 1]])

    share = np.array((1.0, 0.86, 0.7, 0.54, 0.38, 0.22, 0.08, 0.0))
    upper = _fair(np.array([ring(h, cut.room) for h in sole + (top - sole) * share]))
    # Higher on the instep than at the heel.
    front = np.clip((upper[0, :, 2] - upper[0, :, 2].mean()) / np.ptp(upper[0, :, 2]) + 0.5, 0.0, 1.0)
    upper[:, :, 1] += _INSTEP * scale * np.maximum(share - 0.3, 0.0)[:, None] / 0.7 * front
    rim, floor = upper[0], upper[-1]
    inside = rim + 0.06 * (rim.mean(axis=0) - rim)
    deep = inside - np.array((0.0, 0.012 * scale, 0.0))
    up = np.eye(3)[1]
    edge = _grown(floor, cut.welt * scale)
    low = _at_height(_grown(floor, 0.4 * cut.welt * scale), 0.0)
    sides = [edge + 0.0006 * up, edge - 0.2 * sole * up, _at_height(edge, 0.2 * sole), low]
    flat = _at_height(floor.mean(axis=0) + 0.3 * (floor - floor.mean(axis=0)), 0.0)
    panels = ["lining"] * 2 + ["upper"] * 7 + ["sole"] * 4 + ["tread"]
    skin, foot = mesh.vertices[row].astype(np.float64), build.names.index(f"{side}_foot")
    bones = dense(mesh.bone, mesh.weight)[row].astype(np.float64) if mesh.bone is not None and mesh.weight is not None else None
    assert bones is not None, "a body has bones"
    made: list[Cloth] = []
    pieces = [(np.array([deep, inside, *upper, *sides, flat]), panels)]
    if cut.sock:
        # All over the shank: of its vertices a slice may have none.
        shank = build.places(f"{side}_shank", f"{side}_foot")
        shank = shank[(shank[:, 1] > 0.5 * top) & (shank[:, 1] < top + 0.14 * scale)]
        sock = _sock(shank, rim, cut.sock, scale)
        pieces.append((sock, ["sock"] * (len(sock) - 1)))
    for rows, names in pieces:
        weight = spread(skin, bones, rows.reshape(-1, 3)).astype(np.float32).reshape(*rows.shape[:2], -1)
        limb = np.full(rows.shape[:2], foot, np.int32)
        made.append(rolled(rows, [f"{side}_{name}" for name in names], weight, limb))
    return made


def _sock(p: F64, rim: F64, high: float, scale: float) -> F64:
    """(K, _COLUMNS, 3) rings up the shank from inside a shoe's opening."""
    top, out = float(rim[:, 1].max()) + high * scale, list[F64]()
    heights: list[float] = np.linspace(top, float(rim[:, 1].min()) - 0.012 * scale, 5).tolist()
    for height in heights:
        q = p[np.abs(p[:, 1] - height) < 0.012 * scale][:, [0, 2]]
        at = _outline(q[q[:, 1] < rim[:, 2].max()], 0.003)
        out.append(np.column_stack([at[:, 0], np.full(_COLUMNS, height), at[:, 1]]))
    return _fair(np.array(out))


def _outline(q: F64, room: float) -> F64:
    """(_COLUMNS, 2) points on the hull of points (N, 2), `room` outside it, from the heel on, clockwise seen from above."""
    turn = np.arange(_DIRECTIONS) * (2.0 * np.pi / _DIRECTIONS)
    way = np.column_stack([-np.sin(turn), -np.cos(turn)])
    reach = q @ way.T
    hull = q[reach.argmax(axis=0)] + room * way
    step = np.linalg.norm(np.diff(hull, axis=0, append=hull[:1]), axis=1)
    at = np.concatenate([[0.0], np.cumsum(step)])
    wanted = np.arange(_COLUMNS) * (float(at[-1]) / _COLUMNS)
    closed = np.vstack([hull, hull[:1]])
    return np.column_stack([np.interp(wanted, at, closed[:, k]) for k in range(2)])


def _fair(rows: F64) -> F64:
    """Evened from row to row and round each."""
    out = rows.copy()
    for _ in range(3):
        out = 0.5 * out + 0.25 * (np.roll(out, 1, axis=1) + np.roll(out, -1, axis=1))
        out[1:-1] = 0.6 * out[1:-1] + 0.2 * (out[:-2] + out[2:])
    return out


def _grown(ring: F64, by: float) -> F64:
    """A ring wider by so much."""
    along = np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0)
    out = np.cross(np.eye(3)[1], along)
    out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    sign = np.sign((out * (ring - ring.mean(axis=0))).sum())
    return ring + sign * by * out


def _at_height(ring: F64, height: float) -> F64:
    out = ring.copy()
    out[:, 1] = height
    return out


def _painter(colour: Colour, sole: Colour, seed: int) -> Paint:
    inks: dict[str, Colour] = {"sock": (46.0, 46.0, 50.0), "sole": sole, "tread": sole, "upper": colour}
    inks["lining"] = (0.5 * colour[0], 0.5 * colour[1], 0.5 * colour[2])

    def paint(panel: str, u: Floats, v: Floats) -> Look:
        rng, part = np.random.default_rng((seed, sum(panel.encode()))), panel.rpartition("_")[2]
        grain = rng.standard_normal(u.shape, np.float32)
        look = Look(np.array(inks[part], np.float32) * (1.0 + 0.03 * grain)[..., None], 0.00004 * grain)
        return _laced(look, u, v, sum(sole) > sum(colour)) if part == "upper" else look

    return paint


def _laced(look: Look, u: Floats, v: Floats, light: bool) -> Look:
    """Laces across the instep and a seam before the toes, on an upper that is unrolled from the heel round to the heel."""
    across, down = np.abs(u - 0.5 * (float(u.min()) + float(u.max()))), -v - _LACES[0]
    rows = np.cos(2.0 * np.pi * down / 0.009)
    there = (across < 0.019) & (down > 0.0) & (down < _LACES[1])
    lace = np.clip(2.0 * rows, 0.0, 1.0) * there
    tongue = np.exp(-np.square((across - 0.022) / 0.0022)) * (down > -0.01) * (down < _LACES[1] + 0.004)
    ink = np.array((224.0, 222.0, 214.0) if light else (26.0, 24.0, 22.0), np.float32)
    colour = look.colour * (1.0 - 0.3 * tongue)[..., None]
    return Look(colour + 0.85 * lace[..., None] * (ink - colour), look.height + 0.0012 * lace - 0.0005 * tongue)
