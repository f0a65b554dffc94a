"""Shells: cloth cut from the skin, brought out to where the garment's cut has it, and eased."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32, Bool
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.clothes.build import SIDES, Build, Neighbours
from vistel.figure.clothes.cloth import Cloth, dense, thinned
from vistel.figure.clothes.cut import Cutting, Field
from vistel.figure.clothes.lowered import lowered
from vistel.figure.clothes.panels import PANELS, Panels
from vistel.figure.clothes.strip import even_ring
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.smoothstep import smooth

Tables = tuple[F64 | None, F64 | None, F64 | None, F64 | None, F64 | None]
"""Of trunk, left and right arm, left and right leg: like `vistel.figure.clothes.tube.Tube.girth`, how far the cloth stands from the
axis; None: as the skin does."""
_ROUNDS = 8
_BACK = 1.04
_WEIGHT_ROUNDS = 6
_CHUNK = 256
_SINKS = (0.0035, 0.005, 0.01)
_GIVEN = 0.022
_UNSEEN = 0.003
"""How much farther skin gives way so far inside a border that nobody sees it: what presses sleeves presses them through it [m]."""
_LAP = 0.12, 0.62
"""Cosine of the angle from the front, seen from above, at which cloth begins to go with raised thighs, and from which it does."""
_MARGINS = (1.0, 0.8, 0.3)
"""Of each level, as shares: larger triangles reach farther under a border anyhow."""


@dataclass(frozen=True, eq=False)
class Pattern:
    """What a garment is cut like. limbs: of the body that it may cover. borders: by name, how far inside each a place is. clear:
    least distance from the skin at places (N, 3) [m]. tables: the cut. rounds: of easing; waves: what goes round a rim more often
    than so many times is evened. triangles: of the shell, about. soft: where, 0 to 1, cloth is
    drawn straight over hollows; hangs: share of what thighs move that
    stays with the hips."""

    limbs: tuple[str, ...]
    borders: Mapping[str, Field]
    clear: Field
    tables: Tables
    panels: Panels
    rounds: int = _ROUNDS
    waves: int = 5
    triangles: int = 1150
    soft: Field | None = None
    hangs: float = 0.0

    def inside(self, p: F64) -> F64:
        """(N,) how far places lie inside all borders [m]."""
        return np.min([border(p) for border in self.borders.values()], axis=0)

    def border_at(self, p: F64) -> str:
        """The border that a rim with these points (N, 3) before they were brought out belongs to."""
        return min(self.borders, key=lambda name: float(np.abs(self.borders[name](p)).mean()))

    def hides(self, build: Build, margin: float) -> tuple[Bool, ...]:
        """For each level (F,) triangles of the body that lie farther inside than `margin` [m]."""
        out: list[Bool] = []
        for mesh, inside, share in zip(build.levels, self._depths(build), _MARGINS, strict=False):
            out.append(covered(mesh, inside > share * margin))
        return tuple(out)

    def sinks(self, build: Build) -> tuple[F32, ...]:
        """For each level (V,) how far skin that it covers gives way [m]: coarse meshes of skin and cloth would cross."""
        depths = self._depths(build)
        return tuple(
            (most * smooth((d + _GIVEN) / _GIVEN) + _UNSEEN * smooth(d / _GIVEN)).astype(np.float32)
            for d, most in zip(depths, _SINKS, strict=False)
        )

    def _depths(self, build: Build) -> list[F64]:
        """For each level (V,) how far vertices of the body lie inside [m]."""
        meshes = build.levels
        return [np.where(build.on(m, *self.limbs), self.inside(m.vertices.astype(np.float64)), -1.0) for m in meshes]


@dataclass(frozen=True, eq=False)
class Shell:
    """rims: rings of vertices at each border, by its name, the cloth on their left."""

    cloth: Cloth
    rims: Mapping[str, Sequence[I32]]


def shell(build: Build, pattern: Pattern) -> Shell:
    """The garment without its borders' finish."""
    mesh = build.levels[0]
    cut = Cutting(mesh, build.normals[0], build.on(mesh, *pattern.limbs), pattern.inside, pattern.panels.seams)
    out = _brought_out(build, pattern, cut)
    weight = _evened(cut, pattern)
    seen = (out,) if pattern.panels.legs else lowered(build, out, cut.triangles, weight, cut.limb)
    panel, flat = pattern.panels.cut(cut.points, seen, cut.triangles)
    cloth, place = thinned(
        Cloth(out, cut.triangles, weight, cut.limb, panel, flat, np.zeros(len(out), np.bool_), PANELS), pattern.triangles
    )
    rims: dict[str, list[I32]] = {}
    for ring in cut.rims:
        rims.setdefault(pattern.border_at(cut.points[ring]), []).append(place[ring])
    return Shell(cloth, rims)


def covered(mesh: Mesh, deep: Bool) -> Bool:
    """(F,) triangles whose vertices all are deep, which (V,) says."""
    return np.asarray(deep[mesh.triangles].all(axis=1), np.bool_)


def spread(source: F64, values: F64, points: F64) -> F64:
    """(N, K) values at points: the mean of the three nearest sources (S, 3), nearer ones counting for more."""
    out = np.empty((len(points), values.shape[1]))
    a, square = source.astype(np.float32), (source * source).sum(axis=1).astype(np.float32)
    for k in range(0, len(points), _CHUNK):
        p = points[k : k + _CHUNK].astype(np.float32)
        away = square - 2.0 * p @ a.T
        near = np.argpartition(away, 3, axis=1)[:, :3]
        far = np.linalg.norm(source[near] - points[k : k + _CHUNK, None], axis=2)
        w = 1.0 / (far + 1e-5) ** 2
        out[k : k + _CHUNK] = np.einsum("nk,nkc->nc", w / w.sum(axis=1, keepdims=True), values[near])
    return out


def of_skin(build: Build, rows: F64, *limbs: str) -> F32:
    """(K, N, BONES) bones' shares of rows of points (K, N, 3) beside those limbs: as the skin beneath has them, so that it does not
    come through when it turns in what is round it."""
    mesh = build.levels[0]
    assert mesh.bone is not None and mesh.weight is not None, "a body has bones"
    mine = build.on(mesh, *limbs)
    share = spread(
        mesh.vertices[mine].astype(np.float64), dense(mesh.bone, mesh.weight)[mine].astype(np.float64), rows.reshape(-1, 3)
    )
    return share.astype(np.float32).reshape(*rows.shape[:2], -1)


def _brought_out(build: Build, pattern: Pattern, cut: Cutting) -> F64:
    """(V, 3) where the cloth lies."""
    skin, n = cut.points, cut.normals
    share = build.shares[cut.source]
    if not pattern.panels.legs:
        share = np.column_stack([share[:, 0] + share[:, 3] + share[:, 4], share[:, 1:3], 0.0 * share[:, 3:]])
    clear = pattern.clear(skin)
    out = skin + clear[:, None] * n
    for k, (tube, table) in enumerate(zip(pattern.panels.tubes, pattern.tables, strict=True)):
        if table is None:
            continue
        s, angle, far, way = tube.polar(skin)
        scale = build.scale
        if k == 0:
            ends = np.clip((build.armpit + 0.08 * scale - skin[:, 1]) / (0.10 * scale), 0.0, 1.0)
        else:
            ends = smooth((s - tube.s[0]) / ((0.15 if k < 3 else 0.06) * scale))
        more = np.maximum(tube.read(table, s, angle) - far - clear, 0.0)
        out += (np.clip(share[:, k], 0.0, 1.0) * ends * more)[:, None] * way
    beside = Neighbours(cut.triangles, len(skin))
    soft = None if pattern.soft is None else pattern.soft(skin)
    for _ in range(pattern.rounds):
        # There and back (Taubin 1995): sleeves would be drawn thin.
        once = beside.smoothed(out)
        back = _BACK if soft is None else _BACK * (1.0 - soft)[:, None]
        out = _along_rims(once - back * (beside.smoothed(once) - once), out, cut, pattern.waves)
        short = clear - ((out - skin) * n).sum(axis=1)
        out += np.maximum(short, 0.0)[:, None] * n
        if pattern.panels.legs:
            out[:, 0] = _apart(out[:, 0], share)
    for ring in cut.rims:
        out[ring] = even_ring(out[ring], pattern.waves)
    return out


def _along_rims(eased: F64, before: F64, cut: Cutting, waves: int) -> F64:
    """Rims go towards smooth curves, which are as long as they are: easing them as cloth is eased would draw them together."""
    for ring in cut.rims:
        eased[ring] = before[ring] + 0.5 * (even_ring(before[ring], waves) - before[ring])
    return eased


def _evened(cut: Cutting, pattern: Pattern) -> F32:
    """(V, BONES) bones' shares: cloth lies more evenly over a joint than skin does, but for its borders, where skin is seen."""
    free = np.clip(pattern.inside(cut.points) / 0.05, 0.0, 1.0)[:, None]
    weight = cut.weight.copy()
    beside = Neighbours(cut.triangles, len(weight))
    used = np.flatnonzero(weight.any(axis=0))
    weight[:, used] += free * (beside.smoothed(weight[:, used].astype(np.float64), _WEIGHT_ROUNDS) - weight[:, used])
    _to_the_hips(weight, pattern.hangs * _aside(pattern, cut.points))
    for ring in cut.rims:
        weight[np.ix_(ring, used)] = np.maximum(even_ring(weight[np.ix_(ring, used)].astype(np.float64), pattern.waves), 0.0)
    return weight / weight.sum(axis=1, keepdims=True)


def _to_the_hips(weight: F32, share: F64) -> None:
    """What hangs from the shoulders hardly goes along with thighs, in place; share: (V,) of what they move that stays."""
    for side in SIDES:
        leg = JOINT_INDEX[f"{side}_upper_leg"]
        weight[:, JOINT_INDEX["hips"]] += (share * weight[:, leg]).astype(np.float32)
        weight[:, leg] *= (1.0 - share).astype(np.float32)


def _aside(pattern: Pattern, p: F64) -> F64:
    """(N,) 0 in front to 1 at the sides and behind: in front raised thighs would come through cloth that stays."""
    _, angle, _, _ = pattern.panels.build.trunk.polar(p)
    return 1.0 - smooth((np.cos(angle) - _LAP[0]) / (_LAP[1] - _LAP[0]))


def _apart(x: F64, share: F64) -> F64:
    """Legs of cloth stay on their sides."""
    left, right = share[:, 3] > 0.75, share[:, 4] > 0.75
    return np.where(left, np.maximum(x, 0.003), np.where(right, np.minimum(x, -0.003), x))
