"""Charts: sleeves and trouser legs get textures of their own, unrolled, on which cloth can move (Singh §5.1, §5.3.2).

The texture coordinates of an avatar's file may cut a sleeve into islands anywhere; cloth that moves along the arm would run into
other islands. So the colour of each charted region is copied to a plane, and the mesh is registered on that plane."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64, U8
from vistel.figure.avatar.atlas import atlas
from vistel.figure.avatar.atlas_kernels import rasterise
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import Patch, patch_of
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.islands import shown_by, spread_out
from vistel.wrinkle.region import Region, Tube, builtin_regions, sides_of, tube

TEXELS_PER_METRE = 1000.0
"""At most: charts lie side by side below the avatar's own texture and together are no wider than it."""
MARGIN = 0.06
"""How much more than one turn a chart covers at least [turns], because triangles lie across the seam."""
BEFORE = 0.01
"""How far a chart begins before its seam [turns], and before and after its ends [v]."""
APART = 16
"""Texels round a chart that repeat its edge, so that mipmaps do not mix in what lies beside it."""
_LITTLE = 1e-4
"""[m]"""
EVEN = 64
"""Texels that the sides of the texture are a multiple of."""


@dataclass(frozen=True)
class Chart:
    """Where a region's plane lies on a dressed avatar's texture: coordinates = origin + scale * (u, v).

    box: lowest and highest texture coordinates of it.
    """

    name: str
    origin: tuple[float, float]
    scale: tuple[float, float]
    box: tuple[float, float, float, float]

    def drawn(self, mesh: Mesh) -> I64:
        """Drawn vertices that lie on it."""
        low, high = np.array(self.box[:2]), np.array(self.box[2:])
        return np.flatnonzero(((mesh.uv >= low) & (mesh.uv <= high)).all(axis=1))


@dataclass(frozen=True)
class ChartedAvatar:
    """An avatar whose charted regions have textures of their own."""

    avatar: Avatar
    charts: tuple[Chart, ...]


def dressed(avatar: Avatar, regions: Sequence[str] = ("sleeve", "trouser_leg")) -> ChartedAvatar:
    """The avatar with a chart for each of the regions that it has, on all levels. Registrations of its islands become part of the
    texture."""
    known = builtin_regions()
    tubes = [one for name in regions for side in sides_of(known[name]) if (one := _there(avatar, known[name], side)) is not None]
    if not tubes:
        return ChartedAvatar(avatar, ())
    spans, beyond = zip(*(_extent((avatar, *avatar.coarser), one) for one in tubes), strict=True)
    wide = sum(one.plane[0] * (1.0 + BEFORE + more) for one, more in zip(tubes, beyond, strict=True))
    density = min(TEXELS_PER_METRE, (avatar.albedo.shape[1] - len(tubes) * (2 * APART + 1)) / max(wide, 1e-6))
    pictures = [unrolled(avatar, one, span, density, more) for one, span, more in zip(tubes, spans, beyond, strict=True)]
    own = spread_out(avatar.albedo, shown_by((avatar.mesh, *avatar.eyeballs), avatar.albedo.shape[:2]))
    framed = [np.pad(p, ((APART, APART), (APART, APART), (0, 0)), mode="edge") for p in pictures]
    albedo, where = _even(*atlas([own, *framed]))
    boxes = [_inside(box, p.shape[:2]) for box, p in zip(where[1:], framed, strict=True)]
    charts = tuple(_chart(t.name, span, more, box) for t, span, more, box in zip(tubes, spans, beyond, boxes, strict=True))

    patches = (*(p.within(where[0]) for p in avatar.patches), *_on_charts(avatar, tubes, charts))

    def level(of: Avatar) -> Avatar:
        mesh = _kept(of.mesh, where[0])
        for one, chart in zip(tubes, charts, strict=True):
            mesh = _registered(mesh, _alike(of, one), chart)
        eyes = tuple(_kept(eye, where[0]) for eye in of.eyeballs)
        return replace(of, mesh=mesh, eyeballs=eyes, albedo=albedo, registration=(), patches=patches, coarser=())

    return ChartedAvatar(replace(level(avatar), coarser=tuple(level(x) for x in avatar.coarser)), charts)


def _on_charts(avatar: Avatar, tubes: Sequence[Tube], charts: Sequence[Chart]) -> list[Patch]:
    """Material of each chart: that of most of its faces, uniform, because pictures of it are laid out differently."""
    out: list[Patch] = []
    on = patch_of(avatar.patches, avatar.mesh.uv, avatar.mesh.corner_triangles)
    for one, chart in zip(tubes, charts, strict=True):
        of = on[one.member[avatar.mesh.triangles].all(axis=1)]
        most = int(np.bincount(of + 1).argmax()) - 1 if len(of) else -1
        if most >= 0:
            out.append(replace(avatar.patches[most].evenly(), box=chart.box))
    return out


def _there(avatar: Avatar, region: Region, side: str) -> Tube | None:
    """The region on the avatar, if it has one."""
    try:
        one = tube(avatar, region, side)
    except WrinkleError:
        return None
    return one if one.member[avatar.mesh.triangles].all(axis=1).any() else None


def _alike(avatar: Avatar, one: Tube) -> Tube:
    """The same region on a coarser level."""
    return tube(avatar, one.region, one.name.removesuffix(one.region.name), like=one)


def _extent(levels: Sequence[Avatar], one: Tube) -> tuple[tuple[float, float], float]:
    """Lowest and highest v of a region, and how far its triangles reach beyond once round, on all levels: the coarser they are the
    farther they lie across the seam."""
    low, high, beyond = np.inf, -np.inf, MARGIN
    for level in levels:
        here = _alike(level, one)
        faces = _outside(here, level.mesh)
        if len(faces):
            at = _turns(here, level.mesh, faces)
            low, high = min(low, float(at[..., 1].min())), max(high, float(at[..., 1].max()))
            beyond = max(beyond, float(at[..., 0].max()) - 1.0 + BEFORE)
    return (low - BEFORE, high + BEFORE), beyond


def _even(picture: U8, where: F64) -> tuple[U8, F64]:
    """The picture with rows added below, so that it can be halved several times without a remainder, and where its parts are
    then."""
    height, width = picture.shape[:2]
    more, wider = -height % EVEN, -width % EVEN
    out = np.pad(picture, ((0, more), (0, wider), (0, 0)), mode="edge")
    where = where * np.array((width, height, width, height))
    where[:, 1] += more
    return out, where / np.array((out.shape[1], out.shape[0], out.shape[1], out.shape[0]))


def _inside(box: F64, texels: tuple[int, int]) -> F64:
    """The part of a framed picture's box (left, bottom, width, height) that is within the frame; texels: (H, W) of the picture."""
    frame = APART * box[2:] / np.array((texels[1], texels[0]))
    return np.concatenate((box[:2] + frame, box[2:] - 2.0 * frame))


def _chart(name: str, span: tuple[float, float], beyond: float, box: F64) -> Chart:
    width = 1.0 + BEFORE + beyond
    scale = float(box[2]) / width, float(box[3]) / (span[1] - span[0])
    origin = float(box[0]) + BEFORE * scale[0], float(box[1]) - span[0] * scale[1]
    return Chart(name, origin, scale, (float(box[0]), float(box[1]), float(box[0] + box[2]), float(box[1] + box[3])))


def _kept(mesh: Mesh, box: F64) -> Mesh:
    return replace(mesh, uv=(box[:2] + mesh.uv * box[2:]).astype(np.float32))


def _outside(one: Tube, mesh: Mesh) -> I64:
    """(F,) triangles of a region that face outwards, the innermost first: hems that are folded in keep their own texture, and of
    a cuff over another the outer one is seen."""
    faces = np.flatnonzero(one.member[mesh.triangles].all(axis=1))
    corner = mesh.vertices[mesh.triangles[faces]].astype(np.float64)
    middle = corner.mean(axis=1)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal *= _LITTLE / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    far = one.away(middle)
    outwards = one.away(middle + normal) > far - 0.5 * _LITTLE
    return faces[outwards][np.argsort(far[outwards], kind="stable")]


def _turns(one: Tube, mesh: Mesh, triangles: I64) -> F64:
    """(F, 3, 2) u, v of the corners of triangles, u above 1 where they lie across the seam."""
    at = one.place(mesh.vertices)[mesh.triangles[triangles]]
    across = np.ptp(at[..., 0], axis=1) > 0.5
    at[..., 0] += across[:, None] & (at[..., 0] < 0.5)
    return at


def unrolled(avatar: Avatar, one: Tube, span: tuple[float, float], density: float, beyond: float = MARGIN) -> U8:
    """(H, W, 3) colour of a region on its plane, v of `span`, the lowest at the bottom; u goes on by BEFORE and `beyond` beyond
    once round. density: texels per metre."""
    mesh = avatar.mesh
    plane = one.plane
    width, height = 1.0 + BEFORE + beyond, span[1] - span[0]
    columns, rows = (max(8, round(s * density)) for s in (plane[0] * width, plane[1] * height))
    faces = _outside(one, mesh)
    at = _turns(one, mesh, faces)
    size = max(columns, rows)
    # Drawn three times, so that triangles across the seam are drawn at both ends.
    corner = np.concatenate([at + np.array((k, 0.0)) for k in (-1.0, 1.0, 0.0)]).reshape(-1, 2)
    corner = (corner + np.array((BEFORE, -span[0]))) / np.array((width, height)) * np.array((columns, rows)) / size
    # The rasteriser's picture is square, its first row at v = 1.
    corner[:, 1] += 1.0 - rows / size
    owner, weight = rasterise(corner, np.arange(len(corner)).reshape(-1, 3), size)
    owner, weight = owner[:rows, :columns], weight[:rows, :columns]
    seen = owner >= 0
    drawn = mesh.corner_triangles[faces[owner[seen] % len(faces)]]
    w = np.concatenate((weight[seen], 1.0 - weight[seen].sum(axis=1, keepdims=True)), axis=1)
    colour = _read(avatar.albedo, (mesh.uv[drawn] * w[..., None]).sum(axis=1))
    out = np.zeros((rows, columns, 3), np.uint8)
    out[seen] = colour
    return _filled(out, seen)


def _filled(picture: U8, seen: NDArray[np.bool_]) -> U8:
    """The picture with each texel that is not seen in the colour of the nearest seen one above or below it; cloth may move over
    it."""
    rows = np.arange(len(picture))[:, None]
    above = np.maximum.accumulate(np.where(seen, rows, -1), axis=0)
    below = np.minimum.accumulate(np.where(seen, rows, 2 * len(picture))[::-1], axis=0)[::-1]
    nearest = np.where((rows - above <= below - rows) & (above >= 0) | (below >= len(picture)), above, below)
    return picture[np.maximum(nearest, 0), np.arange(picture.shape[1])[None]]


def _registered(mesh: Mesh, one: Tube, chart: Chart) -> Mesh:
    """The mesh with the triangles of a region on its chart."""
    faces = _outside(one, mesh)
    if len(faces) == 0:
        return mesh
    at = _turns(one, mesh, faces)
    vertex = mesh.triangles[faces]
    # One drawn vertex for each vertex and turn.
    key = 2 * vertex.astype(np.int64) + (at[..., 0] >= 1.0)
    unique, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    uv = np.array(chart.origin) + at.reshape(-1, 2)[first] * np.array(chart.scale)
    corners = mesh.corner_triangles.copy()
    corners[faces] = (len(mesh.uv) + inverse.reshape(-1, 3)).astype(np.int32)
    corner_vertex = np.concatenate((mesh.corner_vertex, (unique // 2).astype(np.int32)))
    used, corners = np.unique(corners, return_inverse=True)
    return replace(
        mesh,
        corner_vertex=corner_vertex[used],
        uv=np.concatenate((mesh.uv, uv.astype(np.float32)))[used],
        corner_triangles=corners.reshape(-1, 3).astype(np.int32),
    )


def _read(picture: U8, uv: NDArray[np.floating]) -> F64:
    """(N, 3) colours at texture coordinates (N, 2), bilinear."""
    height, width = picture.shape[:2]
    x = np.clip(uv[:, 0] * width - 0.5, 0, width - 1)
    y = np.clip((1.0 - uv[:, 1]) * height - 0.5, 0, height - 1)
    x0, y0 = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    x1, y1 = np.minimum(x0 + 1, width - 1), np.minimum(y0 + 1, height - 1)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    above = picture[y0, x0] * (1 - fx) + picture[y0, x1] * fx
    return above * (1 - fy) + (picture[y1, x0] * (1 - fx) + picture[y1, x1] * fx) * fy
