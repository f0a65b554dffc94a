"""A body as a tailor measures it: landmarks, and its trunk, arms and legs as tubes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vistel.arrays import F64, I32, Bool
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.body import Body
from vistel.figure.clothes.tube import Tube, tube
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.geometry.normals import vertex_normals

SIDES = ("left", "right")
TRUNK = ("pelvis", "abdomen", "waist", "chest", "breast", "crotch", "collar")
ARM = ("upper_arm", "forearm")
LEG = ("thigh", "shank")
_ROUNDS = 12
"""Of smoothing, over which one tube passes into the next."""


@dataclass(frozen=True, eq=False)
class Build:
    """Heights are above the floor [m], in the T-pose. levels: meshes of the naked body."""

    levels: tuple[Mesh, ...]
    skeleton: Skeleton
    body: Body

    @staticmethod
    def of(body: Avatar) -> "Build":
        """Of an avatar whose mesh is its skin."""
        return Build((body.mesh, *(a.mesh for a in body.coarser)), body.skeleton, body.body)

    @property
    def names(self) -> tuple[str, ...]:
        """Of its limbs."""
        return self.body.names

    @property
    def rest(self) -> F64:
        """(J, 3) joints [m]."""
        return self.skeleton.rest

    @property
    def height(self) -> float:
        """[m]"""
        return self.skeleton.height

    def joint(self, name: str) -> F64:
        """(3,) [m]"""
        return self.rest[JOINT_INDEX[name]]

    def on(self, mesh: Mesh, *limbs: str) -> Bool:
        """(V,) vertices of those limbs, named without their side unless it is meant."""
        mine = [name in limbs or name.removeprefix("left_").removeprefix("right_") in limbs for name in self.names]
        return np.array(mine)[mesh.limb]

    @cached_property
    def normals(self) -> tuple[F64, ...]:
        """(V, 3) of each level."""
        return tuple(vertex_normals(m.vertices.astype(np.float64), m.triangles) for m in self.levels)

    @property
    def scale(self) -> float:
        """To a body of usual height."""
        return self.height / 1.72

    @cached_property
    def crotch(self) -> float:
        """Height between the legs."""
        # Heavy thighs touch: only the midline of the mesh is sure to be between them.
        p = self.levels[0].vertices[self.on(self.levels[0], "crotch", "pelvis")]
        return float(p[np.abs(p[:, 0]) < 0.001][:, 1].min())

    @cached_property
    def waist(self) -> float:
        """Height at which trousers and skirts sit: some way above the hip joints."""
        hip, chest = self.joint("left_upper_leg")[1], self.joint("spine_8")[1]
        return float(hip + 0.26 * (chest - hip))

    @cached_property
    def neck(self) -> tuple[F64, float]:
        """Middle of the neck where it is thinnest, and its mean radius there."""
        p = self.places("neck")
        low, high = self.joint("neck")[1], self.joint("head")[1]
        cuts = [
            p[np.abs(p[:, 1] - y) < 0.006 * self.scale] for y in (low + share * (high - low) for share in (0.0, 0.13, 0.27, 0.4))
        ]
        ring = min((c for c in cuts if len(c) > 8), key=lambda c: float(np.ptp(c[:, 0])))
        middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
        return middle, float(np.hypot(*(ring - middle)[:, [0, 2]].T).mean())

    @cached_property
    def armpit(self) -> float:
        """Height."""
        arm = self.places("left_upper_arm")
        x = self.joint("left_upper_arm")[0] + 0.03 * self.scale
        return float(arm[np.abs(arm[:, 0] - x) < 0.02 * self.scale][:, 1].min())

    @cached_property
    def trunk(self) -> Tube:
        """From the top of the chest down to the crotch."""
        top = self.joint("spine_8")
        p = self.places(*(n for n in TRUNK if n != "collar"), "thigh")
        p = p[p[:, 1] > self.crotch - 0.02]
        # Arms stand out of the trunk: what is beyond the shoulder joints is theirs.
        p = p[np.abs(p[:, 0]) < np.where(p[:, 1] > self.armpit - 0.02, 0.9 * self.joint("left_upper_arm")[0], 9.0)]
        return tube(p, top, -np.eye(3)[1], np.eye(3)[2], (0.0, float(top[1] - self.crotch)))

    @cached_property
    def arms(self) -> tuple[Tube, Tube]:
        """Left and right, from the shoulder joint to the wrist."""

        def arm(side: str, sign: float) -> Tube:
            shoulder, wrist = self.joint(f"{side}_upper_arm"), self.joint(f"{side}_hand")
            p = self.places(*(f"{side}_{n}" for n in (*ARM, "palm")))
            return tube(p, shoulder, sign * np.eye(3)[0], np.eye(3)[2], (0.02, float(abs(wrist[0] - shoulder[0]))))

        return arm("left", 1.0), arm("right", -1.0)

    @cached_property
    def legs(self) -> tuple[Tube, Tube]:
        """Left and right, from the crotch to the ankle."""

        def leg(side: str) -> Tube:
            hip, ankle = self.joint(f"{side}_upper_leg"), self.joint(f"{side}_foot")
            p = self.places(*(f"{side}_{n}" for n in LEG))
            return tube(p, hip, -np.eye(3)[1], np.eye(3)[2], (float(hip[1] - self.crotch), float(hip[1] - ankle[1] - 0.03)))

        return leg("left"), leg("right")

    @cached_property
    def shares(self) -> F64:
        """(V, 5) of the finest level: how far a place belongs to the trunk, the left and right arm, the left and right leg."""
        mesh = self.levels[0]
        out = np.zeros((len(mesh.vertices), 5))
        for k, limbs in enumerate(
            (TRUNK, *([f"{s}_{n}" for n in ARM] for s in SIDES), *([f"{s}_{n}" for n in LEG] for s in SIDES))
        ):
            out[:, k] = self.on(mesh, *limbs)
        return Neighbours(mesh.triangles, len(mesh.vertices)).smoothed(out, _ROUNDS)

    def places(self, *limbs: str) -> F64:
        """(N, 3) places all over the skin of limbs."""
        mesh = self.levels[0]
        corner = mesh.vertices[mesh.triangles[self.on(mesh, *limbs)[mesh.triangles].all(axis=1)]].astype(np.float64)
        share = np.array([(a, b, 6 - a - b) for a in range(7) for b in range(7 - a)]) / 6.0
        return np.einsum("kc,fcx->fkx", share, corner).reshape(-1, 3)


class Neighbours:
    """Of the vertices of a mesh."""

    def __init__(self, triangles: I32, count: int) -> None:
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
        key = np.unique(np.concatenate([edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]]))
        self._from, self._to = np.divmod(key, count)
        self._start = np.searchsorted(self._from, np.arange(count))
        number = np.bincount(self._from, minlength=count)
        self._alone = number == 0
        self._number = np.maximum(number, 1)[:, None]

    def smoothed(self, values: F64, rounds: int = 1) -> F64:
        """(V, K) values, each moved halfway to the mean of its neighbours, `rounds` times."""
        for _ in range(rounds):
            total = np.add.reduceat(values[self._to], np.minimum(self._start, len(self._to) - 1), axis=0)
            values = np.where(self._alone[:, None], values, 0.5 * values + 0.5 * total / self._number)
        return values
