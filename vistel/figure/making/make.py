"""From what a file held to an avatar: upright, jointed, in the T-pose, fitted, dressed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from vistel.arrays import F64, I32
from vistel.figure.avatar.avatar import Avatar, Mesh, Target
from vistel.figure.avatar.detail import coarser
from vistel.figure.avatar.patch import MOST_PATCHES
from vistel.figure.body import pose_body, standard_body
from vistel.figure.face.targets import meant
from vistel.figure.making.dress import TexturedMesh, drawn, dress
from vistel.figure.making.joints import NEEDED, Jointed, jointed
from vistel.figure.making.landmarks import joints_by_shape
from vistel.figure.making.levels import with_coarser
from vistel.figure.making.names import SPINE
from vistel.figure.making.parts import Parts, Soundness, covered, parts_of, soundness, weld
from vistel.figure.making.places import joints_by_place
from vistel.figure.making.primitives import WITH_FINGERS, BodyFit, fit_body
from vistel.figure.making.repose import repose
from vistel.figure.making.rigs import mapped
from vistel.figure.making.source import MakingError, SourceMesh
from vistel.figure.making.upright import Upright, upright
from vistel.figure.making.weights import blended_weights, limb_groups_of, strongest
from vistel.figure.posture.posture import JointPose
from vistel.figure.rigid.weights import TWIST_BONES, bone_weights, smoothed
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, REFERENCE_HEIGHT, Skeleton

_SOFTER = 8
"""Rounds of averaging that a file's weights get."""
MOST_TRIANGLES = 30_000
"""More than that is not seen in a conference and costs time at every picture."""


@dataclass(frozen=True)
class Making:
    """The avatar, and what was found on the way. joint_of: name of the rig's joint to ours; pose_angle: of the upper arms
    below the horizontal as the file had them [rad]."""

    avatar: Avatar
    notes: tuple[str, ...]
    skeleton_from: str
    joint_of: Mapping[str, str]
    unknown: tuple[str, ...]
    weights_from: str
    pose_angle: float
    sound: Soundness
    fit: BodyFit


def make_avatar(
    source: SourceMesh,
    *,
    name: str,
    unit: float | None = None,
    up: str | None = None,
    height: float | None = None,
    primitives: int = WITH_FINGERS,
    step: Callable[[str], None] = lambda _: None,
) -> Making:
    """An avatar of the person in `source`.

    unit: metres of one unit, up: "Y" or "Z", height [m]: where they are known better than the file or its proportions say;
    step: called with what is being done. Raises MakingError.
    """
    step("parts")
    known = mapped(source.rig)
    parts = parts_of(source, known.gaze(source.triangles))
    notes = [*source.notes, *parts.notes]
    used = np.unique(source.triangles[parts.skin])
    if not np.isfinite(source.points).all():
        bad = int(np.argmin(np.isfinite(source.points).all(axis=1)))
        raise MakingError(f"vertex {bad} is not finite; repair the mesh")
    left = known.left()
    placed = upright(
        source.points[used], unit=unit, up=up, height=height, left=left, head=known.head(), stated=(source.unit, source.up)
    )
    notes += placed.notes
    points = placed(source.points)
    to, triangles, doubled = weld(points, source.triangles)
    if doubled and parts.skin.any():
        notes.append(f"{doubled} vertices at the places of others: welded")
    body, eyes = triangles[parts.skin], triangles[parts.eyes]
    worn = parts.worn[parts.skin]
    hidden = np.zeros(len(body), np.bool_)
    if worn.any():
        hidden[~worn] = covered(points, body[~worn], body[worn], float(np.ptp(points[used, 1])) / REFERENCE_HEIGHT)
        notes.append(f"{int(hidden.sum())} faces under the clothes left out")
    keep = ~hidden & (body[:, 0] != body[:, 1]) & (body[:, 1] != body[:, 2]) & (body[:, 2] != body[:, 0])
    skin_faces = np.flatnonzero(parts.skin)[keep]
    body = _outwards(points, body[keep])
    sound = soundness(body, len(points))
    notes += sound.notes()

    step("skeleton")
    rows = np.unique(body)
    crown = float(points[rows, 1].max())
    at = {n: placed(p[None])[0] for n, p in known.at.items()}
    skeleton_from = f"rig ({len(known.joint_of)} of {known.count} joints known)"
    if any(n not in at for n in NEEDED):
        missing = next(n for n in NEEDED if n not in at)
        places = {} if source.rig is None else joints_by_place(placed(source.rig.at), source.rig.parents, crown)
        if source.rig is not None and places:
            known = mapped(replace(source.rig, told={**source.rig.told, **places}))
            at = {n: placed(p[None])[0] for n, p in known.at.items()}
            names = source.rig.names
            notes.append("joints told by position: " + ", ".join(f"{names[j]} = {ours}" for j, ours in sorted(places.items())))
            skeleton_from = f"rig ({len(places)} of {known.count} joints by position)"
        else:
            if known.count:
                notes.append(f"the rig has no joint known as {missing}: joints by the shape of the mesh instead")
            try:
                at = dict(joints_by_shape(points[rows], np.searchsorted(rows, body).astype(np.int32)))
            except MakingError as fault:
                if not known.count:
                    raise
                raise MakingError(
                    f"its rig has no joint known as {missing}, and none that lies there ({fault}); name its joints as VRM does"
                ) from fault
            skeleton_from = "shape of the mesh"
    at |= _eye_centres(points, eyes)
    joints = jointed(at, crown)

    step("weights")
    index = np.full(len(points), -1, np.int32)
    index[rows] = np.arange(len(rows), dtype=np.int32)
    tri, p0 = index[body], points[rows]
    file = None if known.weight is None or skeleton_from.startswith("shape") else known.weight[rows]
    limb_joint = limb_joints(joints, p0, file, known.joint_of_column)
    own = bone_weights(joints.found, p0.astype(np.float32), tri, limb_joint)
    weight = own if file is None else blended_weights(file, known.joint_of_column, own)
    weight0 = weight
    p = repose(p0, weight, joints)
    own = bone_weights(joints.rest, p.astype(np.float32), tri, limb_joint)
    # Weights painted for straight blends go over so abruptly that skin folds into itself at finger roots and elbows.
    weight = own if file is None else smoothed(blended_weights(file, known.joint_of_column, own), tri, _SOFTER)
    # Soles on the floor, and over them the ankles, wherever legs that stood apart or bent have come to be.
    ankles = 0.5 * (joints.rest.rest[JOINT_INDEX["left_foot"], 2] + joints.rest.rest[JOINT_INDEX["right_foot"], 2])
    floor = np.array((0.0, -p[:, 1].min(), -ankles))
    p, rest = p + floor, Skeleton(joints.rest.rest + floor, joints.rest.tip)
    bone, share = strongest(weight, None if file is None else limb_groups_of(known.joint_of_column))

    step("primitives")
    fit = fit_body(rest, p, tri, bone[:, 0], primitives)

    step("texture")
    dressed = _dress(source, parts, skin_faces, index, bone, p, points, to)
    notes += dressed.notes
    vertex, uv, corner = drawn(dressed.corner_uv[: len(tri)], tri)
    targets, said = _targets(source, placed, index[to], p0, lambda v, q: repose(q, weight0[v], joints))
    notes += said
    mesh = Mesh(p.astype(np.float32), tri, vertex, uv, corner, fit.limb, bone, share, targets)
    head = fit.body.names.index("skull")
    balls = _eyeballs(points + floor, eyes, dressed.corner_uv[len(tri) :], head)
    avatar = Avatar(name, rest, fit.body, mesh, balls, dressed.albedo, patches=dressed.patches[:MOST_PATCHES])
    if sound.manifold:
        step("levels of detail")
        if len(tri) > MOST_TRIANGLES:
            notes.append(f"{len(tri)} triangles reduced to about {MOST_TRIANGLES}")
            avatar = replace(avatar, mesh=coarser(mesh, MOST_TRIANGLES))
    elif len(tri) > 4 * MOST_TRIANGLES:
        raise MakingError(f"{len(tri)} triangles and not manifold; repair the mesh or reduce it to {4 * MOST_TRIANGLES} first")
    else:
        step("levels of detail")
    avatar = with_coarser(avatar, manifold=sound.manifold)
    arm = joints.found.tip[JOINT_INDEX["left_upper_arm"]]
    return Making(
        avatar,
        tuple(notes),
        skeleton_from,
        known.joint_of,
        known.unknown,
        "rig" if file is not None else "joint chain",
        float(np.arctan2(-arm[1], np.hypot(arm[0], arm[2]))),
        sound,
        fit,
    )


def _targets(
    source: SourceMesh, placed: Upright, row: I32, points: F64, bent: Callable[[I32, F64], F64]
) -> tuple[tuple[Target, ...], list[str]]:
    """The expressions of a file that a face knows, on the mesh as it is made. row: (V,) of each vertex of the file, -1 none;
    points: (N, 3) of the mesh, upright; bent: points of these rows in the T-pose."""
    names = [t.name for t in source.targets]
    wanted = meant(names)
    kept: list[Target] = []
    for t in source.targets:
        to = row[t.vertex]
        if t.name not in wanted or not (to >= 0).any():
            continue
        v, first = np.unique(to[to >= 0], return_index=True)
        offset = placed.turned(t.offset[to >= 0][first])
        moved = bent(v, points[v] + offset) - bent(v, points[v])
        kept.append(Target(t.name, v.astype(np.int32), moved.astype(np.float32)))
    if not names:
        return (), []
    said = f"{len(kept)} targets of expressions drive its face"
    left = [n for n in names if n not in wanted]
    if left:
        said += f"; {len(left)} whose names say nothing left out ({', '.join(left[:4])}{', ...' if len(left) > 4 else ''})"
    return tuple(kept), [said]


def refit(avatar: Avatar, primitives: int) -> tuple[Avatar, BodyFit]:
    """The avatar with another set of primitives fitted to its mesh."""
    mesh = avatar.mesh
    bone = mesh.bone
    if bone is None:
        own = bone_weights(avatar.skeleton, mesh.vertices, mesh.triangles, avatar.body.joint[mesh.limb])
        bone = strongest(own)[0]
    fit = fit_body(avatar.skeleton, mesh.vertices.astype(np.float64), mesh.triangles, bone[:, 0], primitives)
    head = fit.body.names.index("skull")
    whole = _relimbed(avatar, fit, fit.limb, head)
    return replace(whole, coarser=tuple(_of_level(level, avatar, fit, head) for level in avatar.coarser)), fit


def _of_level(level: Avatar, finest: Avatar, fit: BodyFit, head: int) -> Avatar:
    """A coarser level's vertices are a part of the finest's: the limb comes from the nearest of them."""
    _, nearest = KDTree(finest.mesh.vertices).query(level.mesh.vertices)
    return _relimbed(level, fit, fit.limb[nearest], head)


def _relimbed(avatar: Avatar, fit: BodyFit, limb: I32, head: int) -> Avatar:
    balls = tuple(replace(b, limb=np.full(len(b.vertices), head, np.int32)) for b in avatar.eyeballs)
    return replace(avatar, body=fit.body, mesh=replace(avatar.mesh, limb=limb.astype(np.int32)), eyeballs=balls, coarser=())


def _outwards(points: F64, triangles: I32) -> I32:
    corner = points[triangles]
    volume = np.einsum("fi,fi->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))
    return triangles if volume >= 0.0 else np.ascontiguousarray(triangles[:, ::-1])


def _eye_centres(points: F64, eyes: I32) -> dict[str, F64]:
    """Middles of the eyeballs, by side."""
    out: dict[str, F64] = {}
    rows = np.unique(eyes)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        mine = rows[sign * points[rows, 0] > 0.0]
        if len(mine) < 8:
            continue
        low, high = points[mine].min(axis=0), points[mine].max(axis=0)
        # Flat ones, as drawn figures have them, turn about the joint behind them.
        if high[2] - low[2] > 0.35 * max(high[0] - low[0], high[1] - low[1]):
            out[f"{side}_eye"] = 0.5 * (low + high)
    return out


def limb_joints(joints: Jointed, p: F64, file: NDArray[np.float32] | None, joint_of: Mapping[int, str]) -> I32:
    """(V,) joint of the limb each vertex belongs to: by the rig's weights, else by the primitives of a standard person
    in the pose of the file."""
    body = standard_body(joints.rest)
    posed = pose_body(body, JointPose(np.ascontiguousarray(joints.turn.transpose(0, 2, 1)), joints.found.rest))
    ratio = np.empty((len(body), len(p)))
    for i in range(len(body)):
        d = posed.b[i] - posed.a[i]
        u = np.clip((p - posed.a[i]) @ d / max(float(d @ d), 1e-12), 0.0, 1.0)
        radius = posed.radius_a[i] + u * (posed.radius_b[i] - posed.radius_a[i])
        ratio[i] = np.linalg.norm(p - posed.a[i] - u[:, None] * d, axis=1) / radius
    near = body.joint[np.argmin(ratio, axis=0)]
    if file is None:
        return near.astype(np.int32)
    columns = sorted(joint_of)
    best = np.array([-1 if joint_of[c] == SPINE else JOINT_INDEX[joint_of[c]] for c in columns], np.int32)[
        np.argmax(file[:, columns], axis=1)
    ]
    names: list[str] = [JOINTS[j] for j in body.joint]
    trunk = np.flatnonzero([name == "hips" or name.startswith("spine") for name in names])
    of_trunk = body.joint[trunk[np.argmin(ratio[trunk], axis=0)]]
    return np.where((best < 0) | (best == JOINT_INDEX["hips"]), of_trunk, best).astype(np.int32)


def _dress(
    source: SourceMesh, parts: Parts, skin_faces: NDArray[np.int64], index: I32, bone: I32, p: F64, upright_points: F64, to: I32
) -> TexturedMesh:
    """The skin's faces, then the eyeballs'."""
    faces = np.concatenate([skin_faces, np.flatnonzero(parts.eyes)])
    eye = np.arange(len(faces)) >= len(skin_faces)
    chosen = replace(
        source,
        points=upright_points,
        triangles=to[source.triangles[faces]],
        uv_triangles=source.uv_triangles[faces],
        group=source.group[faces],
        material=source.material[faces],
    )
    # Of points outside the skin nothing is asked.
    row = np.maximum(index, 0)
    names = np.where(bone[:, 0] < len(JOINTS), bone[:, 0], [0]).astype(np.int32)
    for k, twist in enumerate(TWIST_BONES):
        names[bone[:, 0] == len(JOINTS) + k] = JOINT_INDEX[twist.joint]
    return dress(chosen, names[row], eye, p[row, 1], float(p[:, 1].max()))


def _eyeballs(points: F64, eyes: I32, corner_uv: F64, head: int) -> tuple[Mesh, ...]:
    out: list[Mesh] = []
    for sign in (1.0, -1.0):
        mine = sign * points[eyes[:, 0], 0] > 0.0 if len(eyes) else np.zeros(0, np.bool_)
        if mine.sum() < 8:
            return ()
        rows, tri = np.unique(eyes[mine], return_inverse=True)
        tri = tri.reshape(-1, 3).astype(np.int32)
        vertex, uv, corner = drawn(corner_uv[mine], tri)
        out.append(Mesh(points[rows].astype(np.float32), tri, vertex, uv, corner, np.full(len(rows), head, np.int32)))
    return tuple(out)
