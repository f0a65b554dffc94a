"""Texture registration: how the picture of an avatar lies on each island of its texture coordinates.

An island is a part of the surface whose texture coordinates are connected. The texture of an island is turned and scaled about its
middle and moved, until the picture's eyes lie on the mesh's (Singh §5.1: the wireframe shows the mapping while it is registered).
The resulting coordinates are drawn and exported; the transforms are kept beside them, so that each can be changed or undone."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from vistel.arrays import F64, I32, U8
from vistel.figure.avatar.atlas import atlas
from vistel.figure.avatar.avatar import Avatar, Mesh, Registration


@dataclass(frozen=True)
class Island:
    """number: 0 for the largest; part: name of the primitive most of it belongs to; triangles; area [m^2]; box: (4,) lowest
    u and v, highest u and v."""

    number: int
    part: str
    triangles: int
    area: float
    box: tuple[float, float, float, float]


def islands(avatar: Avatar) -> list[Island]:
    """Islands of the skin, largest first, then those of the eyeballs."""
    out: list[Island] = []
    of = island_of(avatar)
    for k, mesh in enumerate((avatar.mesh, *avatar.eyeballs)):
        face = of[k][mesh.corner_triangles[:, 0]]
        area = _face_areas(mesh)
        for number in np.unique(of[k]):
            rows = face == number
            uv = mesh.uv[of[k] == number]
            limbs = np.bincount(mesh.limb[mesh.triangles[rows, 0]], area[rows])
            part = avatar.body.names[int(np.argmax(limbs))] if k == 0 else ("left eye", "right eye")[k - 1]
            (u0, v0), (u1, v1) = uv.min(axis=0).tolist(), uv.max(axis=0).tolist()
            out.append(Island(int(number), part, int(rows.sum()), float(area[rows].sum()), (u0, v0, u1, v1)))
    return out


def island_of(avatar: Avatar) -> list[I32]:
    """(R,) number of the island of each drawn vertex, of the skin and of each eyeball."""
    out: list[I32] = []
    start = 0
    for mesh in (avatar.mesh, *avatar.eyeballs):
        corner = mesh.corner_triangles
        ends = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]]])
        graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(len(mesh.uv), len(mesh.uv)))
        count: int
        label: I32
        count, label = connected_components(graph, directed=False)
        area = np.bincount(label[corner[:, 0]], _face_areas(mesh), count)
        rank = np.empty(count, np.int32)
        rank[np.lexsort((np.arange(count), -np.round(area, 9)))] = np.arange(start, start + count)
        out.append(rank[label])
        start += count
    return out


def registered(avatar: Avatar, new: Registration) -> Avatar:
    """The avatar with the registration `new` of one island, relative to the mesh's own coordinates; its middle is computed. Raises
    ValueError for an unknown island or an impossible scale."""
    of = island_of(avatar)
    last = max(int(numbers.max()) for numbers in of)
    if not 0 <= new.island <= last:
        raise ValueError(f"island {new.island}: expected 0 to {last}")
    if not 1e-3 <= new.scale <= 1e3 or not np.isfinite((*new.move, new.turn)).all():
        raise ValueError(f"scale {new.scale:g}, move {new.move}: expected a scale of 0.001 to 1000 and finite numbers")
    plain = unregistered(avatar, new.island)
    k = next(k for k, numbers in enumerate(of) if (numbers == new.island).any())
    mesh = (plain.mesh, *plain.eyeballs)[k]
    uv = mesh.uv[of[k] == new.island].astype(np.float64)
    u, v = (0.5 * (uv.min(axis=0) + uv.max(axis=0))).tolist()
    new = replace(new, middle=(u, v))
    return replace(_moved(plain, new.island, new), registration=tuple(sorted((*plain.registration, new), key=lambda r: r.island)))


def unregistered(avatar: Avatar, island: int) -> Avatar:
    """The avatar with the registration of an island removed."""
    for old in avatar.registration:
        if old.island == island:
            left = tuple(r for r in avatar.registration if r.island != island)
            return replace(_moved(avatar, island, old, back=True), registration=left)
    return avatar


def with_picture(avatar: Avatar, island: int, picture: U8) -> Avatar:
    """The avatar with another picture (H, W, 3) on an island: the island's box of coordinates spans it."""
    avatar = unregistered(avatar, island)
    of = island_of(avatar)
    if not any((numbers == island).any() for numbers in of):
        raise ValueError(f"island {island}: expected 0 to {max(int(n.max()) for n in of)}")
    box = next(i.box for i in islands(avatar) if i.number == island)
    low, size = np.array(box[:2]), np.maximum(np.array(box[2:]) - box[:2], 1e-9)
    albedo, where = atlas([avatar.albedo, picture])

    def placed(mesh: Mesh, mine: NDArray[np.bool_]) -> Mesh:
        uv = mesh.uv.astype(np.float64)
        old = where[0, :2] + uv * where[0, 2:]
        # Half a texel inside, so that the neighbour in the picture does not bleed in.
        inset = 0.5 / np.array(picture.shape[1::-1])
        on = where[1, :2] + np.clip((uv - low) / size, inset, 1.0 - inset) * where[1, 2:]
        return replace(mesh, uv=np.where(mine[:, None], on, old).astype(np.float32))

    kept = tuple(
        replace(r, middle=_scaled(r.middle, where[0], 1.0), move=_scaled(r.move, where[0], 0.0)) for r in avatar.registration
    )
    out = _each_level(avatar, of, island, placed)
    patches = tuple(p.within(where[0]) for p in avatar.patches)
    return replace(
        out,
        albedo=albedo,
        registration=kept,
        patches=patches,
        coarser=tuple(replace(level, albedo=albedo, patches=patches) for level in out.coarser),
    )


def _scaled(point: tuple[float, float], box: F64, shift: float) -> tuple[float, float]:
    return float(shift * box[0] + point[0] * box[2]), float(shift * box[1] + point[1] * box[3])


def _moved(avatar: Avatar, island: int, how: Registration, *, back: bool = False) -> Avatar:
    texels = np.array(avatar.albedo.shape[1::-1], np.float64)
    c, s = np.cos(how.turn), np.sin(how.turn)
    turn = np.array([[c, -s], [s, c]])
    middle, move = np.array(how.middle), np.array(how.move)

    def placed(mesh: Mesh, mine: NDArray[np.bool_]) -> Mesh:
        uv = mesh.uv.astype(np.float64)
        # Coordinates move against the picture. Turned in texels, because pictures need not be square.
        if back:
            there = ((uv[mine] - middle) * texels) @ turn.T / texels * how.scale + middle + move
        else:
            there = ((uv[mine] - middle - move) * texels) @ turn / texels / how.scale + middle
        uv[mine] = there
        return replace(mesh, uv=uv.astype(np.float32))

    return _each_level(avatar, island_of(avatar), island, placed)


def _each_level(avatar: Avatar, of: list[I32], island: int, change: Callable[[Mesh, NDArray[np.bool_]], Mesh]) -> Avatar:
    """`change(mesh, mask of drawn vertices)` done to the meshes of all levels; coarser ones have a subset of the finest's drawn
    vertices, by which their islands are found."""
    finest = (avatar.mesh, *avatar.eyeballs)
    trees = [KDTree(np.hstack([m.vertices[m.corner_vertex], m.uv])) for m in finest]

    def level(one: Avatar) -> Avatar:
        meshes: list[Mesh] = []
        for k, mesh in enumerate((one.mesh, *one.eyeballs)):
            nearest = trees[k].query(np.hstack([mesh.vertices[mesh.corner_vertex], mesh.uv]))[1]
            meshes.append(change(mesh, np.asarray(of[k][nearest] == island, np.bool_)))
        return replace(one, mesh=meshes[0], eyeballs=tuple(meshes[1:]))

    return replace(level(avatar), coarser=tuple(level(one) for one in avatar.coarser))


def _face_areas(mesh: Mesh) -> F64:
    corner = mesh.vertices[mesh.triangles].astype(np.float64)
    return 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
