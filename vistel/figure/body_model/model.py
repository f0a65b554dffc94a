"""The body model: from a look to points, joints and faces. One file of the package holds it (`data/body.npz`; `data/body.md` beside
it says how it was made).

Points are MakeHuman's base mesh (skin, tongue, lashes, teeth), then the eyeballs', then the middles of its joint cubes. A person is
the base, plus components in the shares that the macro targets give them, plus details. Frame: metres, Y up, facing +Z, the left arm
along +X and down, as MakeHuman's mesh stands; the floor is where `Shape` puts it."""

import hashlib
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32, U8
from vistel.figure.body_model.look import Look, rule, shares
from vistel.undisturbed import undisturbed

VERSION = 1
"""Version of the file; it changes when its arrays or their meaning do."""
STEP = 5e-5
"""Places are whole multiples of this in the file [m]."""
FILE = Path(__file__).with_name("data") / "body.npz"


class BodyModelError(ValueError):
    """A file that is not this body model: one line."""


@dataclass(frozen=True, eq=False)
class Targets:
    """Shapes that are added to points: of target k the rows vertex[start[k]:start[k + 1]] move by offset (N, 3) [m]."""

    names: tuple[str, ...]
    start: I32
    vertex: I32
    offset: F32

    def add(self, points: F64, k: int, share: float) -> None:
        """Target k, in place."""
        rows = slice(self.start[k], self.start[k + 1])
        points[self.vertex[rows]] += share * self.offset[rows]


@dataclass(frozen=True, eq=False)
class Level:
    """A level of detail. vertex: (V,) of the finest; corner_vertex: (R,) of its own vertices, of each drawn one; uv: (R, 2) origin
    bottom left; corner_triangles: (F, 3) drawn vertices."""

    vertex: I32
    corner_vertex: I32
    uv: F32
    corner_triangles: I32

    @property
    def triangles(self) -> I32:
        """(F, 3) vertices of this level."""
        return self.corner_vertex[self.corner_triangles]


@dataclass(frozen=True, eq=False)
class Shape:
    """A person's body as it was modelled, soles on y = 0. points: (V, 3) of the skin and what is in the mouth; eyes: (2, 3) middles
    of the eyeballs, left first; eye_radius: theirs; joints: places by VISTEL's names. Metres."""

    points: F64
    eyes: F64
    eye_radius: float
    joints: dict[str, F64]

    @property
    def stature(self) -> float:
        """[m]"""
        return float(self.points[:, 1].max())


@dataclass(frozen=True, eq=False)
class BodyModel:
    """base: (P, 3) [m]. of, mixing: which shares make a macro target, and (K, R) what of each component it brings; components:
    (R, P * 3) [m]. details: axes -1 .. 1, by name the target of either end, -1 for none. levels: the finest first. bone, weight:
    (V, 4), limb: (body,) as `vistel.figure.avatar.avatar.Mesh` has them. body: number of vertices that are the closed skin, which
    come first. masks: (H, 2 H) of the texture's parts, 0 to 255, first row at the top. boxes: (4,) lowest u and v, highest u and v
    of what is a rectangle in it: eye (from the front), lashes, upper_teeth, lower_teeth, tongue. slopes: what
    `vistel.figure.body_model.fit.jacobian` gave, by sex."""

    base: F32
    of: I32
    mixing: F32
    components: F32
    targets: Targets
    details: dict[str, tuple[int, int]]
    units: Targets
    joints: tuple[str, ...]
    levels: tuple[Level, ...]
    bone: I32
    weight: F32
    limb: I32
    body: int
    masks: dict[str, U8]
    boxes: dict[str, F64]
    slopes: dict[str, F64]

    @cached_property
    def closed(self) -> I32:
        """(F, 3) triangles of the closed skin."""
        triangles = self.levels[0].triangles
        return triangles[(triangles < self.body).all(axis=1)]

    @property
    def eyes_apart(self) -> float:
        """Between the base's eyes, to whose head `units` refer [m]."""
        return float(np.linalg.norm(np.subtract(*self.base[[self._joint("left_eye"), self._joint("right_eye")]])))

    def _joint(self, name: str) -> int:
        return len(self.base) - len(self.joints) + self.joints.index(name)

    def points(self, look: Look) -> F64:
        """(P, 3) all points, where the model has them. Raises KeyError for a detail that is not known."""
        made = shares(look, self.of).astype(np.float32) @ self.mixing
        out = (self.base.ravel() + made @ self.components).astype(np.float64).reshape(-1, 3)
        for name, share in look.details.items():
            low, high = self.details[name]
            k = high if share > 0.0 else low
            if k >= 0 and share:
                self.targets.add(out, k, abs(share))
        return out

    def shape(self, look: Look, scale: float = 1.0) -> Shape:
        """A person, `scale` times as large as the model has them."""
        return self.stood(scale * self.points(look))

    def stood(self, points: F64) -> Shape:
        """What all points are, with the soles on the floor."""
        skin, joints = len(self.bone), len(points) - len(self.joints)
        p = points - (0.0, points[: self.body, 1].min(), 0.0)
        eyes = p[skin:joints].reshape(2, -1, 3)
        low, high = eyes.min(axis=1), eyes.max(axis=1)
        radius = 0.25 * float((high - low)[:, :2].mean(axis=0).sum())
        front = high[:, 2] - radius
        middle = np.column_stack((0.5 * (low + high)[:, :2], front))
        return Shape(p[:skin], middle, radius, dict(zip(self.joints, p[joints:], strict=True)))


def paired(names: tuple[str, ...]) -> dict[str, tuple[int, int]]:
    """Axes of targets that are each other's opposites: name-decr and name-incr make `name`. A target without one is an axis from
    0."""
    index = {name: k for k, name in enumerate(names)}
    out: dict[str, tuple[int, int]] = {}
    for low, high in (("decr", "incr"), ("in", "out"), ("down", "up"), ("backward", "forward"), ("concave", "convex"),
                      ("compress", "uncompress"), ("small", "large")):  # fmt: skip
        for name in names:
            stem, _, end = name.rpartition("-")
            if end == high and f"{stem}-{low}" in index:
                axis = stem if end == "incr" or stem not in out else f"{stem}-{high}"
                out[axis] = (index.pop(f"{stem}-{low}"), index.pop(name))
    return out | {name: (-1, k) for name, k in index.items()}


@undisturbed
def load(path: Path = FILE) -> BodyModel:
    """Raises BodyModelError, one line, where the file is not a model of this version, whole."""
    mend = "make it anew with: make body-model WHEEL=FILE"
    try:
        told = path.with_suffix(".md").read_text("utf-8")
        if hashlib.sha256(path.read_bytes()).hexdigest() not in told:
            raise BodyModelError(f"body model {path}: not the file that {path.stem}.md beside it describes; {mend}")
        with np.load(path, allow_pickle=False) as file:
            data: dict[str, NDArray[Any]] = dict(file)
        if int(data["version"]) != VERSION:
            raise BodyModelError(f"body model {path}: is of version {int(data['version'])}, expected {VERSION}; {mend}")
        return _model(data)
    except (OSError, ValueError, EOFError, KeyError) as fault:
        if isinstance(fault, BodyModelError):
            raise
        raise BodyModelError(f"body model {path}: cannot be read ({fault}); {mend}") from fault


def _model(data: dict[str, NDArray[Any]]) -> BodyModel:
    def metres(name: str) -> F32:
        return np.cumsum(data[name], axis=-1, dtype=np.int16).astype(np.float32) * np.float32(STEP)

    def targets(name: str) -> Targets:
        counts, vertex = data[f"{name}_count"], np.cumsum(data[f"{name}_vertex"], dtype=np.uint16)
        start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        offset = np.ascontiguousarray(data[f"{name}_offset"].T) * np.float32(STEP)
        return Targets(tuple(data[f"{name}_names"].tolist()), start, vertex.astype(np.int32), offset)

    names = [n for n in data if n.startswith("level")]
    levels = tuple(
        Level(
            data[f"level{k}_vertex"].astype(np.int32),
            data[f"level{k}_corner"].astype(np.int32),
            (data[f"level{k}_uv"] / np.float32(65535)).astype(np.float32),
            data[f"level{k}_triangles"].astype(np.int32),
        )
        for k in range(len(names) // 4)
    )
    base = np.ascontiguousarray(metres("base").T)
    components = metres("components").transpose(0, 2, 1).reshape(len(data["components"]), -1)
    known = targets("detail")
    return BodyModel(
        base=base,
        of=rule(data["macro_names"].tolist()),
        mixing=data["mixing"],
        components=np.ascontiguousarray(components),
        targets=known,
        details=paired(known.names),
        units=targets("unit"),
        joints=tuple(data["joints"].tolist()),
        levels=levels,
        bone=data["bone"].astype(np.int32),
        weight=data["weight"].astype(np.float32) / np.maximum(data["weight"].sum(axis=1, keepdims=True), 1),
        limb=data["limb"].astype(np.int32),
        body=int(data["body"]),
        masks={n.removeprefix("mask_"): data[n] for n in data if n.startswith("mask_")},
        slopes={n.removeprefix("slope_"): data[n] for n in data if n.startswith("slope_")},
        boxes={n.removeprefix("box_"): data[n] for n in data if n.startswith("box_")},
    )


@cache
def body_model() -> BodyModel:
    """The model of this package, loaded once."""
    return load()
