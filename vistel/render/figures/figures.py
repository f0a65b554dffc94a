"""Figures as the renderer needs them: an avatar that deforms, or a stand-in of bare limbs while there is none."""

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from vistel.arrays import F32, F64, I32, U8
from vistel.audio.heard_voices import Speech
from vistel.figure.avatar.avatar import Avatar, Mesh, rigid
from vistel.figure.avatar.detail import coarser, of_triangles
from vistel.figure.avatar.patch import patch_of
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.body import Body, PosedBody, pose_body, standard_body
from vistel.figure.face.countenance import Countenance
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.shape import Expression
from vistel.figure.face.skin import FaceSkin
from vistel.figure.figure import Figure
from vistel.figure.figure_plan import FigurePlanner
from vistel.figure.layers.places import Places
from vistel.figure.layers.skin import Anatomy, SkinLayers
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, Skeleton, standard_skeleton
from vistel.figure.swing.hanging import Hanging, HungMesh
from vistel.figure.swing.swing import Swing, SwungLevel
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.render.figures.bare_skin import bare_skin, is_bare
from vistel.render.figures.corner_kernels import lay_corners  # pyright: ignore[reportUnknownVariableType]
from vistel.render.figures.drawn import Corners, Creases, FigureModel, Planned
from vistel.render.figures.gpu_deform import SkinShape
from vistel.render.figures.wrinkles import WrinkleState
from vistel.space.things.tessellate import join, tessellate
from vistel.space.things.things import ThingPrimitive
from vistel.wrinkle.dressing import dressed
from vistel.wrinkle.shown import LevelWrinkles, shown
from vistel.wrinkle.wrinkle_sets import WrinkleSet, charted

# Materials of vertices, as the shaders read them.
CLOTH = 0.0
SKIN = 1.0
EYE = 2.0
CASTER = 0.82
"""Share of a limb's radius that casts its shadow: a sculpted skin dips below its primitives in places."""
COARSER_BELOW = (800.0, 260.0)
"""Pixels per metre below which each coarser level of the built-in people looks the same: at half of the vertices it strays from the
finest by up to 0.2 and 0.9 mm, hence by less than half a pixel (at one in ten by more than 2 and 7 mm)."""
_SKIRT = 0.25
"""Least share of triangles of a skirt or dress that are on legs; of a jacket it is about 0.15."""
_CASTING = 3000
"""Triangles of a small figure that throw its shadow in fast light: the shadow map's texels are 3.4 mm wide."""
_PHALANX = ("metacarpal", "proximal", "intermediate", "distal")
_HEAD = ("neck", "skull", "face")
_HEAD_JOINT = JOINT_INDEX["head"]

log = logging.getLogger("vistel.renderer")


@dataclass(frozen=True)
class PosedVertices:
    """A figure at one instant, room frame: the drawn vertices of `model`, or how the GPU gets them."""

    model: FigureModel
    skin: Corners | Planned
    joints: JointPose
    posed: PosedBody
    folds: F32 | None = None
    """(S,) how much of each set of the model's wrinkles is there."""


class DrawableFigure(Protocol):
    """A participant's figure."""

    skeleton: Skeleton
    body: Body
    casters: tuple[I32, I32]

    def pose(
        self,
        posture: Posture,
        ghosts: Sequence[GhostSource] = (),
        pixels_per_m: float = math.inf,
        *,
        planned: bool = False,
        at_ns: int | None = None,
        speech: Speech | None = None,
    ) -> PosedVertices:
        """The figure in `posture`, deformed by `ghosts`; what it returns is valid until its next `pose`.

        pixels_per_m: size in the picture, which decides how much detail is worth its time. planned: for the GPU to
        pose and deform, if it is of that sort. at_ns: when, for what cloth remembers and faces follow; None: they remember
        nothing. speech: what is heard of them, while they speak.
        """
        ...

    def ghosts(self, posed: PosedBody, target: NDArray[np.bool_] | None) -> GhostSource:
        """This figure as ghosts that act on the primitives `target` (P,) of another one, None for all."""
        ...


def avatar_model(
    avatar: Avatar,
    wrinkles: LevelWrinkles | None = None,
    picture: Callable[[], U8] | None = None,
    coarsest: Avatar | None = None,
    *,
    small: bool = False,
) -> FigureModel:
    """Texture coordinates, materials and triangles of an avatar; eyeballs follow the skin's drawn vertices. picture: of the
    wrinkles' light. coarsest: its coarsest level, which throws its shadow where few triangles are wanted. small: as `FigureModel`
    has it."""
    mesh = avatar.mesh
    names = avatar.body.names
    skin = np.where(bare_skin(avatar), SKIN, CLOTH).astype(np.float32)
    head = np.array([n in _HEAD for n in names])
    uv, material, triangles = [mesh.uv], [skin], [mesh.corner_triangles]
    start = len(mesh.uv)
    for ball in avatar.eyeballs:
        uv.append(ball.uv)
        material.append(np.full(len(ball.uv), EYE, np.float32))
        triangles.append(ball.corner_triangles + start)
        start += len(ball.uv)
    of_head = head[mesh.limb[mesh.triangles]].any(axis=1)
    casting = None
    if coarsest is not None and not avatar.patches:
        casting = _triangles_of(coarsest.mesh, mesh)
    elif small:
        casting = _solid(avatar)
    creases = None
    if wrinkles is not None and picture is not None:
        eyes = np.zeros((start - len(mesh.uv), wrinkles.sets.shape[1]), np.uint8)
        creases = Creases(np.vstack((wrinkles.sets, eyes)), np.vstack((wrinkles.pull, eyes.astype(np.float32))), picture)
    return FigureModel(
        np.concatenate(uv).astype(np.float32),
        np.concatenate(material),
        np.concatenate(triangles).astype(np.int32),
        np.ascontiguousarray(mesh.corner_triangles[~of_head]),
        avatar.albedo,
        creases,
        casting,
        avatar.patches,
        small,
    )


def _hang_round_legs(avatar: Avatar) -> set[int]:
    """Numbers of the patches that have an inside which is seen from afar, too: skirts and dresses."""
    mesh = avatar.mesh
    legs = [k for k, name in enumerate(avatar.body.names) if name.endswith(("thigh", "shank"))]
    of_leg = np.isin(mesh.limb[mesh.triangles], legs).any(axis=1)
    on = patch_of(avatar.patches, mesh.uv, mesh.corner_triangles)
    return {
        k
        for k, p in enumerate(avatar.patches)
        if p.both_sides and np.count_nonzero(of_leg & (on == k)) > _SKIRT * np.count_nonzero(on == k)
    }


def _triangles_of(coarse: Mesh, mesh: Mesh) -> I32:
    """(F, 3) the triangles of a coarser level as drawn vertices of a finer one, of whose vertices it has a part."""
    tree: Any = KDTree(mesh.vertices)
    return _drawn_vertex(mesh)[np.asarray(tree.query(coarse.vertices)[1], np.int64)[coarse.triangles]]


def _solid(avatar: Avatar) -> I32:
    """(F, 3) as drawn vertices: about `_CASTING` triangles of the shape of all that is no sheet."""
    mesh = avatar.mesh
    solid = patch_of(tuple(p for p in avatar.patches if p.sheet), mesh.uv, mesh.corner_triangles) < 0
    tri, place = mesh.triangles[solid].astype(np.int64), np.arange(len(mesh.vertices), dtype=np.int32)
    flat = Mesh(mesh.vertices, mesh.triangles, place, np.zeros((len(place), 2), np.float32), mesh.triangles, place)
    few = coarser(of_triangles(flat, tri, tri), _CASTING)
    return _drawn_vertex(mesh)[few.limb[few.triangles]]


def _drawn_vertex(mesh: Mesh) -> I32:
    """(V,) one of the drawn vertices of each vertex."""
    drawn = np.zeros(len(mesh.vertices), np.int32)
    drawn[mesh.corner_vertex] = np.arange(len(mesh.corner_vertex), dtype=np.int32)
    return drawn


class StandIn:
    """A figure of its bare limbs in grey: shown while an avatar is being made, and for one that cannot be had."""

    def __init__(self, height: float, proportions: Proportions | None = None) -> None:
        self.skeleton = proportions.skeleton if proportions else standard_skeleton(height)
        self.body = proportions.body if proportions else standard_body(self.skeleton)
        self.casters = casters(self.body)
        b = self.body
        parts = [
            tessellate(ThingPrimitive("cone_sphere", (*b.a[i], *b.b[i], b.radius_a[i], b.radius_b[i])), 0.5) for i in range(len(b))
        ]
        whole = join(parts)
        self._vertices, self._normals = whole.vertices, whole.normals
        limb = np.repeat(np.arange(len(b)), [len(p.vertices) for p in parts])
        self._joint = b.joint[limb]
        uv = np.column_stack((np.full(len(limb), 0.5), np.where([is_bare(b.names[i]) for i in limb], 0.75, 0.25)))
        texture = np.zeros((2, 2, 3), np.uint8)
        texture[0], texture[1] = (178, 166, 158), (126, 132, 140)
        texture = np.repeat(np.repeat(texture, 8, axis=0), 8, axis=1)
        of_head = np.array([b.names[i] in _HEAD for i in limb])[whole.triangles].any(axis=1)
        self._model = FigureModel(
            uv.astype(np.float32), np.zeros(len(limb), np.float32), whole.triangles, whole.triangles[~of_head], texture
        )

    def pose(
        self,
        posture: Posture,
        ghosts: Sequence[GhostSource] = (),
        pixels_per_m: float = math.inf,
        *,
        planned: bool = False,
        at_ns: int | None = None,
        speech: Speech | None = None,
    ) -> PosedVertices:
        """The limbs in `posture`, each stiff, whatever touches them."""
        joints = pose_joints(self.skeleton, posture)
        r = joints.rotation[self._joint].astype(np.float32)
        positions = np.einsum("nij,nj->ni", r, self._vertices) + joints.position[self._joint]
        normals = np.einsum("nij,nj->ni", r, self._normals)
        skin = Corners(np.hstack((positions, normals)).astype(np.float32))
        return PosedVertices(self._model, skin, joints, pose_body(self.body, joints))

    def ghosts(self, posed: PosedBody, target: NDArray[np.bool_] | None) -> GhostSource:
        """The bare limbs as ghosts, as soft as flesh."""
        limbs = PrimitiveSet.of_cone_spheres(posed.a, posed.b, posed.radius_a, posed.radius_b)
        return ghosts_of(limbs, groups=range(len(limbs)), target=target)


class AvatarFigure:
    """An avatar's figure, drawn with as much detail as can be seen. layers: muscles and bones move its skin. wears: sets of
    wrinkles; its sleeves and trouser legs then get textures on which cloth can move."""

    def __init__(self, avatar: Avatar, *, layers: bool = True, wears: Sequence[WrinkleSet] = ()) -> None:
        self.skeleton, self.body, self.casters = avatar.skeleton, avatar.body, casters(avatar.body)
        self.wearing: WrinkleState | None = None
        worn: tuple[LevelWrinkles | None, ...] = (None,) * (1 + len(avatar.coarser))
        if wears:
            made = dressed(avatar, charted(wears))
            whole = shown(made, wears)
            if whole.names:
                avatar, worn, self.wearing = made.avatar, whole.levels, WrinkleState(whole)
        picture = None if self.wearing is None else self.wearing.whole.picture
        levels = (avatar, *avatar.coarser)
        self._finest = _Level(avatar, None, worn[0], picture, levels[-1])
        others = zip(avatar.coarser, worn[1:], strict=True)
        self._levels = [self._finest, *(_Level(a, self._finest.figure, w, picture, levels[-1]) for a, w in others)]
        self._countenance: Countenance | None = None
        self._face_of(avatar)
        self._swing: Swing | None = None
        self._let_hang(avatar)
        if layers:
            anatomy = Anatomy.of(Places(avatar))
            for level in self._levels:
                level.figure.layers = SkinLayers(level.figure, anatomy)

    def _face_of(self, avatar: Avatar) -> None:
        """Let the levels have faces that move, where there is one."""
        try:
            marks = landmarks_of(avatar)
        except ValueError as fault:
            log.info("event=face_stays_still avatar=%s reason=%r", avatar.name, str(fault))
            return
        self._countenance = Countenance()
        for level in self._levels:
            level.face = FaceSkin(level.figure.avatar.mesh, marks, still=rigid(level.figure.avatar))

    def _let_hang(self, avatar: Avatar) -> None:
        """Let swing what hangs loose."""
        if (hanging := Hanging.of(avatar)) is not None:
            self._swing = Swing(hanging, avatar.body)
            for level in self._levels:
                level.swung = SwungLevel(HungMesh(level.figure.avatar, hanging), hanging)

    def without_layers(self) -> None:
        """Let the skin follow the joints alone from now on."""
        for level in self._levels:
            level.forget_layers()

    def without_wrinkles(self) -> None:
        """Have no wrinkles from now on."""
        self.wearing = None

    def pose(
        self,
        posture: Posture,
        ghosts: Sequence[GhostSource] = (),
        pixels_per_m: float = math.inf,
        *,
        planned: bool = False,
        at_ns: int | None = None,
        speech: Speech | None = None,
    ) -> PosedVertices:
        """The figure in `posture`, deformed by its own limbs and by `ghosts`."""
        enough = sum(pixels_per_m <= limit for limit in COARSER_BELOW[: len(self._levels) - 1])
        level = self._levels[enough]
        folds, expression, actions, swung = None, None, {}, None
        if self._countenance is not None:
            face = self._countenance.step(posture, at_ns, speech)
            actions, expression = face.actions, None if face.expression.still else face.expression
        if self.wearing is not None or self._swing is not None:
            joints = pose_joints(self.skeleton, posture)
            if self.wearing is not None:
                folds = self.wearing.weights(joints, actions, at_ns)
            if self._swing is not None:
                swung = self._swing.step(joints, self._finest.figure.skin.matrices(joints), at_ns)
        moved = _Moved(folds, expression, swung)
        return level.plan(posture, ghosts, moved) if planned else level.pose(posture, ghosts, moved)

    def ghosts(self, posed: PosedBody, target: NDArray[np.bool_] | None) -> GhostSource:
        """This figure, posed, as ghosts for another."""
        return self._finest.figure.ghosts(posed, target=target)


class _Moved(NamedTuple):
    """What moves on a figure beside its bones and what touches it. folds: (S,) weights of its wrinkles; swung: (N, 3) as
    `Swing.step` gives it; None: nothing of the kind."""

    folds: F64 | None
    expression: Expression | None
    swung: F64 | None

    @property
    def moves(self) -> bool:
        """Whether vertices go elsewhere in the room."""
        return self.expression is not None or self.swung is not None

    @property
    def shader_weights(self) -> F32 | None:
        """Of wrinkles that are drawn as relief."""
        return None if self.folds is None else self.folds.astype(np.float32)


class _Level:
    """One level of detail."""

    def __init__(
        self,
        avatar: Avatar,
        finest: Figure | None,
        wrinkles: LevelWrinkles | None = None,
        picture: Callable[[], U8] | None = None,
        coarsest: Avatar | None = None,
    ) -> None:
        self._wrinkles = wrinkles
        self.face: FaceSkin | None = None
        self.swung: SwungLevel | None = None
        # Coarser levels are for pictures in which they are small.
        patches = avatar.patches
        if finest is not None:
            open_below = _hang_round_legs(avatar)
            patches = tuple(p.evenly() if p.relief else p for k, p in enumerate(patches) if k in open_below or not p.relief)
        self.model = avatar_model(replace(avatar, patches=patches), wrinkles, picture, coarsest, small=finest is not None)
        self.figure = Figure(avatar, same_body=finest)
        self._planner: tuple[FigurePlanner, SkinShape] | None = None
        self._corners = [mesh.corner_vertex for mesh in (avatar.mesh, *avatar.eyeballs)]
        self._rows = np.empty((len(self.model.uv), 6), np.float32)

    def forget_layers(self) -> None:
        """Let the skin follow the joints alone from now on."""
        self.figure.layers, self._planner = None, None

    def pose(self, posture: Posture, ghosts: Sequence[GhostSource], moved: _Moved) -> PosedVertices:
        """The figure in `posture`, deformed by its own limbs and by `ghosts`, and what moves on it."""
        state = self.figure.pose(posture, ghosts, self._displacement(moved.folds))
        if self.swung is not None and moved.swung is not None:
            self.swung.lay(state.vertices, state.normals, moved.swung)
        if self.face is not None and moved.expression is not None:
            self.face.lay(state.vertices, state.normals, state.joints.rotation[_HEAD_JOINT], moved.expression)
        start = 0
        for corner, (vertices, normals) in zip(self._corners, ((state.vertices, state.normals), *state.eyeballs), strict=True):
            end = start + len(corner)
            lay_corners(vertices, normals, corner, self._rows[start:end])
            start = end
        return PosedVertices(self.model, Corners(self._rows), state.joints, state.posed, moved.shader_weights)

    def plan(self, posture: Posture, ghosts: Sequence[GhostSource], moved: _Moved) -> PosedVertices:
        """As `pose`, for the GPU to do."""
        if self._planner is None:
            planner = FigurePlanner(self.figure)
            self._planner = planner, SkinShape.of(planner)
        planner, shape = self._planner
        displacement, offsets = self._displacement(moved.folds), None
        if moved.moves and displacement is None:
            displacement = np.zeros(len(self.figure.avatar.mesh.vertices), np.float32)
        now = planner.plan(posture, ghosts, displacement)
        if moved.moves:
            offsets = self._room_offsets(now.joints, moved)[planner.planner.order]
        return PosedVertices(self.model, Planned(shape, now.plan, offsets), now.joints, now.posed, moved.shader_weights)

    def _room_offsets(self, joints: JointPose, moved: _Moved) -> F32:
        """(V, 3) what the face and what hangs do."""
        offsets = np.zeros((len(self.figure.avatar.mesh.vertices), 3), np.float32)
        if self.face is not None and moved.expression is not None:
            self.face.room_offsets(joints.rotation[_HEAD_JOINT], moved.expression, offsets)
        if self.swung is not None and moved.swung is not None:
            self.swung.add(moved.swung, offsets)
        return offsets

    def _displacement(self, folds: F64 | None) -> F32 | None:
        return None if folds is None or self._wrinkles is None else self._wrinkles.displacement(folds)


def casters(body: Body) -> tuple[I32, I32]:
    """Which primitives throw shadows, from end a of the first to end b of the second: a finger's as one limb."""
    first: dict[str, int] = {}
    last: dict[str, int] = {}
    for i, name in enumerate(body.names):
        bare, _, phalanx = name.rpartition("_")
        limb = bare if phalanx in _PHALANX else name
        first.setdefault(limb, i)
        last[limb] = i
    return np.array(list(first.values()), np.int32), np.array(list(last.values()), np.int32)


def limb_rows(posed: PosedBody, ends: tuple[I32, I32]) -> F32:
    """(L, 8) end a, radius, end b, radius of the limbs `casters` gave, for the shadow pass."""
    a, b = ends
    return np.column_stack((posed.a[a], CASTER * posed.radius_a[a], posed.b[b], CASTER * posed.radius_b[b])).astype(np.float32)


def below_head(body: Body, ends: tuple[I32, I32]) -> tuple[I32, I32]:
    """Those of the limbs `casters` gave that somebody may see of themselves."""
    seen = np.array([body.names[i] not in _HEAD for i in ends[0]])
    return ends[0][seen], ends[1][seen]
