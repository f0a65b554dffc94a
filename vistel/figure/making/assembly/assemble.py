"""A person assembled from separately scanned parts, blended at the joints into one closed surface (Singh §5.1)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from vistel.arrays import F64
from vistel.figure.making.assembly.colour import coloured
from vistel.figure.making.assembly.file import Assembly, read_assembly
from vistel.figure.making.assembly.joint import ZONES, End, JointFrame, blended, frame_of
from vistel.figure.making.assembly.piece import MeshPiece, closed, joined, loops
from vistel.figure.making.files.read import Extras, read_source
from vistel.figure.making.parts import soundness, weld
from vistel.figure.making.source import MakingError, SourceMaterial, SourceMesh

WELD = 1e-6
"""Vertices of cuts that are one lie no further apart [m]."""
SHORT = 5e-5
"""Edges shorter than this are removed [m]."""
LARGEST = 1024
"""Texels along a side of a part's picture: all have to go into one."""
FARTHEST = 4.0
"""Middles of ends further apart than this many of their radii are not of one joint."""


@dataclass(frozen=True)
class JointMade:
    """What was done at a joint: its parts, radius, half length of the zone and gap between the ends [m] (negative: they
    overlapped), the number of new triangles."""

    between: tuple[str, str]
    radius: float
    zone: float
    gap: float
    triangles: int


@dataclass(frozen=True)
class Assembled:
    """The whole surface as a source for `make_avatar`, and what was done at each joint."""

    source: SourceMesh
    joints: tuple[JointMade, ...]
    height: float | None
    name: str


def assemble(path: Path, step: Callable[[str], None] = lambda _: None) -> Assembled:
    """The person that the file `path` describes. step: called with what is being done. Raises MakingError, OSError."""
    assembly = read_assembly(path)
    names = [p.part for p in assembly.parts]
    pieces: list[MeshPiece] = []
    materials: list[SourceMaterial] = []
    groups: list[str] = []
    part_of: list[int] = []
    notes: list[str] = []
    for number, part in enumerate(assembly.parts):
        step(f"reading {part.part}")
        source = read_source(path.parent / part.file, Extras(path.parent / part.texture if part.texture else None))
        notes += [f"{part.part}: {n}" for n in source.notes]
        pieces.append(_piece(source, part.placed(source.points, assembly.unit), len(groups), len(materials), part.part))
        materials += [_smaller(m) for m in source.materials]
        groups += [f"{part.part} {g}".strip() for g in source.groups]
        part_of += [number] * len(source.groups)
    size = float(np.ptp(np.concatenate([p.points for p in pieces]), axis=0).max())
    if not 0.3 <= size <= 4.0:
        raise MakingError(f"{path}: the parts together are {size:.3g} m large; set unit to the metres of one unit of the scans")
    ends = _ends(pieces)
    pairs = _pairs(assembly, pieces, ends, path)
    frames = [
        frame_of((pieces[a.part], pieces[b.part]), (a, b), zone, f"{path}: {names[a.part]} and {names[b.part]}")
        for a, b, zone in pairs
    ]
    whole = list(pieces)
    out: list[MeshPiece] = []
    made: list[JointMade] = []
    for (a, b, zone), frame in zip(pairs, frames, strict=True):
        label = f"{names[a.part]} and {names[b.part]}"
        step(f"blending {label}")
        reason = MakingError(label)
        others = tuple(_others(frame, frames, pairs, e.part) for e in (a, b))
        both = whole[a.part], whole[b.part]
        # Cuts renumber vertices: the ends are found again where they were.
        here = tuple(_again(pieces[e.part], e, w) for e, w in zip((a, b), both, strict=True))
        limbs = pieces[a.part], pieces[b.part]
        for shorter in (1.0,) if zone is not None else (1.0, ZONES[1] / ZONES[0]):
            frame = replace(frame, zone=max(shorter * frame.zone, 0.5 * frame.gap + 0.1 * frame.radius))  # noqa: PLW2901
            try:
                joint = blended(both, here, frame, others, f"{path}: {label}")  # type: ignore[arg-type]
                sides = [joint.kept.of_faces(np.array(part_of)[joint.kept.part] == e.part) for e in (a, b)]
                skin, picture = coloured(joint.made, sides, limbs, materials, f"{path}: {label}")
                break
            except MakingError as fault:
                reason = fault
        else:
            raise reason
        whole[a.part], whole[b.part] = joint.first, joint.second
        skin = replace(skin, material=np.full(len(skin.triangles), len(materials)), part=np.full(len(skin.triangles), len(groups)))
        materials.append(SourceMaterial(f"seam of {label}", None, picture))
        groups.append(f"seam of {label}")
        part_of.append(-1)
        out += [joint.kept, skin]
        made.append(JointMade((names[a.part], names[b.part]), frame.radius, frame.zone, frame.gap, len(skin.triangles)))
    step("closing")
    body = joined([*whole, *out], WELD)
    body = _without_short_edges(body)
    for loop in loops(body.triangles):
        where = body.points[loop].mean(axis=0)
        notes.append(f"a hole of {len(loop)} edges at ({where[0]:.2f}, {where[1]:.2f}, {where[2]:.2f}) m closed")
        body = closed(body, loop)
    _check(body, names, path)
    return Assembled(
        _source(body, groups, materials, assembly, notes, path), tuple(made), assembly.height, assembly.name or path.stem
    )


def _piece(source: SourceMesh, points: F64, first_group: int, first_material: int, name: str) -> MeshPiece:
    if not np.isfinite(points).all():
        raise MakingError(f"part {name}: vertices that are not finite; repair the scan")
    _, triangles, _ = weld(points, source.triangles)
    uv = np.full((len(triangles), 3, 2), np.nan)
    has = (source.uv_triangles >= 0).all(axis=1)
    if len(source.uv):
        uv[has] = source.uv[source.uv_triangles[has]]
    keep = (triangles != np.roll(triangles, -1, axis=1)).all(axis=1)
    piece = MeshPiece(
        points,
        triangles.astype(np.int64),
        uv,
        source.material.astype(np.int64) + first_material,
        source.group.astype(np.int64) + first_group,
    ).of_faces(keep)
    if soundness(piece.triangles.astype(np.int32), len(points)).branching:
        raise MakingError(f"part {name}: three or more faces meet at an edge; make the scan manifold")
    return _outwards(piece)


def _outwards(piece: MeshPiece) -> MeshPiece:
    """Faces turned over where they look inwards."""
    corner = piece.points[piece.triangles]
    corner = corner - corner.mean(axis=(0, 1))
    if np.linalg.det(corner).sum() >= 0.0:
        return piece
    return replace(piece, triangles=piece.triangles[:, ::-1].copy(), uv=piece.uv[:, ::-1].copy())


def _smaller(material: SourceMaterial) -> SourceMaterial:
    if material.picture is None or max(material.picture.shape) <= LARGEST:
        return material
    image = Image.fromarray(material.picture)
    image.thumbnail((LARGEST, LARGEST), Image.Resampling.LANCZOS)
    return replace(material, picture=np.asarray(image, np.uint8))


def _ends(pieces: list[MeshPiece]) -> list[End]:
    """All borders of all parts, small holes too."""
    return [End(k, loop) for k, piece in enumerate(pieces) for loop in loops(piece.triangles) if len(loop) >= 6]


def _pairs(assembly: Assembly, pieces: list[MeshPiece], ends: list[End], path: Path) -> list[tuple[End, End, float | None]]:
    """Ends that belong together: the nearest first, each once. Raises MakingError when a part is joined to nothing."""
    names = [p.part for p in assembly.parts]
    wanted = {frozenset(s.between): s.zone for s in assembly.joints}
    middle = [pieces[e.part].points[e.loop].mean(axis=0) for e in ends]
    radius = [float(np.linalg.norm(pieces[e.part].points[e.loop] - m, axis=1).mean()) for e, m in zip(ends, middle, strict=True)]
    near: list[tuple[float, int, int]] = []
    for i, a in enumerate(ends):
        for j in range(i + 1, len(ends)):
            if ends[j].part == a.part:
                continue
            apart = float(np.linalg.norm(middle[i] - middle[j]))
            alike = 0.4 < radius[i] / radius[j] < 2.5
            if apart < FARTHEST * min(radius[i], radius[j]) and alike:
                near.append((apart, i, j))
    used: set[int] = set()
    done: set[frozenset[str]] = set()
    out: list[tuple[End, End, float | None]] = []
    for _, i, j in sorted(near):
        key = frozenset((names[ends[i].part], names[ends[j].part]))
        if used & {i, j} or key in done:
            continue
        used |= {i, j}
        done.add(key)
        out.append((ends[i], ends[j], wanted.get(key)))
    missing = next((k for k in wanted if k not in done), None)
    if missing:
        raise MakingError(
            f"{path}: {' and '.join(sorted(missing))} have no open ends that face each other; cut them open there, or move them"
        )
    joined_to: set[int] = {0}
    for _ in names:
        joined_to |= {e.part for a, b, _ in out for e in (a, b) if {a.part, b.part} & joined_to}
    alone = [k for k in range(len(names)) if k not in joined_to]
    if alone:
        raise MakingError(
            f"{path}: {', '.join(names[k] for k in alone)}: joined to nothing; is the part before "
            f"{names[alone[0]]} missing, or does it lie elsewhere (move, landmarks)?"
        )
    return out


def _others(frame: JointFrame, frames: list[JointFrame], pairs: list[tuple[End, End, float | None]], part: int) -> list[F64]:
    """Centres of a part's other joints."""
    return [f.centre for f, (a, b, _) in zip(frames, pairs, strict=True) if f is not frame and part in (a.part, b.part)]


def _again(piece: MeshPiece, end: End, now: MeshPiece) -> End:
    ring = piece.points[end.loop]
    best = min(loops(now.triangles), key=lambda b: float(np.abs(now.points[b].mean(axis=0) - ring.mean(axis=0)).max()))
    return End(end.part, best)


def _without_short_edges(piece: MeshPiece) -> MeshPiece:
    """Vertices of hardly any edge between them made one, as long as the surface stays closed as it was."""
    merged = joined([piece], SHORT)
    before, after = (soundness(p.triangles.astype(np.int32), len(p.points)) for p in (piece, merged))
    return merged if (after.border, after.branching) == (before.border, before.branching) else piece


def _check(body: MeshPiece, names: list[str], path: Path) -> None:
    found = soundness(body.triangles.astype(np.int32), len(body.points))
    if found.border or found.branching:
        raise MakingError(f"{path}: the surface is not closed ({found.border} open edges, {found.branching} with three faces)")


def _source(
    body: MeshPiece, groups: list[str], materials: list[SourceMaterial], assembly: Assembly, notes: list[str], path: Path
) -> SourceMesh:
    flat = body.uv.reshape(-1, 2)
    bare = ~np.isfinite(body.uv).all(axis=(1, 2))
    index = np.arange(len(flat), dtype=np.int32).reshape(-1, 3)
    index[bare] = -1
    return SourceMesh(
        path.stem,
        body.points,
        body.triangles.astype(np.int32),
        np.where(np.isfinite(flat), flat, 0.0),
        index,
        body.part.astype(np.int32),
        tuple(groups),
        body.material.astype(np.int32),
        tuple(materials),
        None,
        1.0,
        assembly.up,
        tuple(notes),
    )
