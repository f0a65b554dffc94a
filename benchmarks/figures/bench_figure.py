"""Figures: the time to pose one, how well its skin holds in recorded postures, and how well avatars fit bodies.

Time is processor time of the one thread, medians, alternating with a Numba kernel of linear blend skinning of the same
mesh (four weights, float32, positions only). A sweep moves the same mesh by the same bones and weights in three ways,
through 200 postures of the recordings under ../shared/data/body; another one moves the built-in people in their clothes.
"""

import time
from collections.abc import Iterator
from dataclasses import fields, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

from benchmarks.figures.clothes_sweep import DEEP, ClothesSweep, clothes_sweep
from benchmarks.figures.figure_peers import linear_blend
from benchmarks.figures.figure_postures import recorded_postures
from benchmarks.figures.figure_sweep import DUAL, LINEAR, sweep
from benchmarks.row import NONE_AT_ALL, Row, Target, at_most, ratio_at_most
from benchmarks.timing import microseconds
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.body_model.builtin_people import PEOPLE
from vistel.figure.body_model.person import make
from vistel.figure.figure import Figure
from vistel.figure.layers.skin import SkinLayers
from vistel.figure.making.files.read import Extras, read_source
from vistel.figure.making.make import make_avatar, refit
from vistel.figure.making.source import SourceMaterial, SourceMesh
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.people.measured import measured
from vistel.figure.posture.hands import RELAXED
from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, pose_joints

_MAKEHUMAN = Path(__file__).resolve().parents[3] / "shared/data/human/makehuman"
_MALE = _MAKEHUMAN / "targets/caucasian-male-young.target.gz"
_WITHIN_S, _MOVED_MM = at_most(20), at_most(10)
_CLOSE_MM = {23: at_most(8), 60: at_most(4)}
"""By number of primitives."""
_ROUNDS, _POSTURES = 100, 200
_LAYERS, _SLOWER = ratio_at_most(1.1), ratio_at_most(1.2)
_SHARE, _VOLUME, _CROSSING = at_most(25), at_most(5), at_most(0.1)


def run() -> Iterator[Row]:
    """One row per figure; some four minutes, most of it the sweeps."""
    person = builtin_avatar("builtin:person=carla", name="bench", height=1.75)
    yield from _times(person)
    yield from _layers(person)
    postures = recorded_postures(_POSTURES)
    if postures:
        bare = _bare(1.75)
        yield from _sweeps(f"built-in person without clothes, {len(bare.mesh.vertices)} vertices", bare, postures)
        yield from _clothes(postures)
    for case, source in _sources():
        if postures and case.startswith("MakeHuman"):
            body = make_avatar(_makehuman(f"{_MALE}=1"), name="body", height=1.75).avatar
            yield from _sweeps(f"MakeHuman male, {len(body.mesh.vertices)} vertices", body, postures)
        yield from _fits(case, source)


def _layers(avatar: Avatar) -> Iterator[Row]:
    """Processor time of a figure that moves, with muscles and bones under its skin and without."""
    bare, layered = Figure(avatar), Figure(avatar)
    layered.layers = SkinLayers(layered)
    postures = (recorded_postures(_POSTURES) or [_bent(), Posture()])[::5]

    def through(figure: Figure) -> None:
        for posture in postures:
            figure.pose(posture)

    took = microseconds({"bare": lambda: through(bare), "layered": lambda: through(layered)}, 40)
    each = {k: v / len(postures) for k, v in took.items()}
    yield Row(
        "figure",
        f"posed figure with muscles and bones, {len(postures)} postures",
        "time",
        "us",
        round(each["layered"], 1),
        "the same figure without them",
        round(each["bare"], 1),
        target=_LAYERS,
    )


def _times(avatar: Avatar) -> Iterator[Row]:
    """Processor time of a posed figure, joints and all, beside linear blend skinning."""
    figures = [Figure(avatar) for _ in range(3)]
    figure, mesh = figures[0], avatar.mesh
    follows, out = figure.skin.influences, np.empty_like(mesh.vertices)
    name = f"Numba {version('numba')} linear blend skinning, {len(mesh.vertices)} vertices"
    for case, posture in (("joints straight", Posture()), ("elbows and fingers bent", _bent())):
        matrices = figure.skin.matrices(pose_joints(avatar.skeleton, posture)).copy()
        took = microseconds(
            {
                "lbs": lambda m=matrices: linear_blend(mesh.vertices, follows.bone, follows.weight, m, out),
                "ours": lambda p=posture: figure.pose(p),
            },
            _ROUNDS,
        )
        yield Row(
            "figure",
            f"posed figure, no contact, {case}",
            "time",
            "us",
            round(took["ours"], 1),
            name,
            round(took["lbs"], 1),
            target=_SLOWER,
        )
    postures = recorded_postures(_POSTURES) or [_bent()]

    def frames() -> None:
        for k in range(60):
            for number, f in enumerate(figures):
                f.pose(postures[(k + 67 * number) % len(postures)])

    share = 1e-4 * microseconds({"second": frames}, 3)["second"]
    yield _row("three figures at 60 Hz", "share of one core", "%", share, _SHARE)


def _bent() -> Posture:
    dofs = Posture().dofs.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[SHOULDER[side]], dofs[ELBOW[side]] = (0.0, 0.0, -0.5 * sign), 0.8
    return Posture(dofs, np.tile(RELAXED, (2, 1)))


def _sweeps(case: str, avatar: Avatar, postures: list[Posture]) -> Iterator[Row]:
    found = sweep(avatar, postures)
    ours = found.pop("")
    case = f"{case}, {len(postures)} recorded postures"
    for peer in (LINEAR, DUAL):
        other = found[peer]
        for metric, mine, theirs, target in (
            ("volume change of a limb segment, largest", abs(ours.segments).max(), abs(other.segments).max(), _VOLUME),
            ("the same, mean", abs(ours.segments).mean(), abs(other.segments).mean(), None),
            ("volume change of elbow or knee, largest", abs(ours.regions).max(), abs(other.regions).max(), None),
            ("self-intersecting triangles, mean", ours.crossing.mean(), other.crossing.mean(), _CROSSING),
            ("self-intersecting triangles, median", np.median(ours.crossing), np.median(other.crossing), None),
            ("self-intersecting triangles, largest", ours.crossing.max(), other.crossing.max(), None),
        ):
            value, beside = 100.0 * float(mine), 100.0 * float(theirs)
            yield Row("figure", case, metric, "%", round(value, 3), peer, round(beside, 3), target=target)


def _clothes(postures: list[Posture]) -> Iterator[Row]:
    swept = [
        clothes_sweep(builtin_avatar(f"builtin:person={n}", name=n, height=p.height or 1.7), postures) for n, p in PEOPLE.items()
    ]
    case = f"{len(swept)} built-in people, dressed, hair left out, {len(postures)} recorded postures"
    crossing, deep, skin, cloth = (np.array([getattr(s, f.name) for s in swept]) for f in fields(ClothesSweep))
    yield _row(case, "self-intersecting triangles, mean", "%", 100.0 * float(crossing.mean()), _CROSSING)
    yield _row(case, f"the same by {1e3 * DEEP:g} mm or more, mean", "%", 100.0 * float(deep.mean()))
    yield _row(case, "skin that comes through clothes, mean", "cm2", 1e4 * float(skin.mean()), NONE_AT_ALL)
    yield _row(case, "the same, postures with any", "%", 100.0 * float((skin > 0.0).mean()))
    yield _row(case, "the same, largest", "cm2", 1e4 * float(skin.max()))
    yield _row(case, "cloth that comes through cloth over it, mean", "cm2", 1e4 * float(cloth.mean()))


def _bare(height: float) -> Avatar:
    """The skin alone of a built-in person [height in metres]: hair and clothes are no limbs whose volume could be kept."""
    return make(replace(measured("builtin:person=carla", "bare", height), dressed=False, hair="shaved"), "bare")


def _fits(case: str, source: SourceMesh) -> Iterator[Row]:
    """MakeHuman's base mesh where ../shared/data has it, and a built-in person as a mesh without rig."""
    make_avatar(source, name="warm", primitives=60)  # compiles
    began = time.perf_counter()
    made = make_avatar(source, name="body", primitives=60)
    took = time.perf_counter() - began
    yield _row(case, "fit, all steps", "s", took, _WITHIN_S)
    for count, limit in _CLOSE_MM.items():
        mean = 1e3 * refit(made.avatar, count)[1].mean_distance
        yield _row(case, f"mean distance, {count} primitives", "mm", mean, limit)
    moved = 1e3 * _moved_at_rest(made.avatar)
    yield _row(case, "furthest vertex moved at rest", "mm", moved, _MOVED_MM)


def _sources() -> Iterator[tuple[str, SourceMesh]]:
    if (_MAKEHUMAN / "base.obj").is_file():
        yield "MakeHuman body, 13380 vertices, rig and weights", _makehuman()
    mesh = _bare(1.7).mesh
    none = np.zeros(len(mesh.triangles), np.int32)
    yield (
        f"built-in person without clothes, {len(mesh.vertices)} vertices, no rig",
        SourceMesh(
            "body",
            mesh.vertices.astype(np.float64),
            mesh.triangles,
            np.zeros((0, 2)),
            np.full(mesh.triangles.shape, -1, np.int32),
            none,
            ("",),
            none,
            (SourceMaterial(""),),
        ),
    )


def _makehuman(*targets: str) -> SourceMesh:
    rig, weights = _MAKEHUMAN / "rig.game_engine.json", _MAKEHUMAN / "weights.game_engine.json.gz"
    return read_source(_MAKEHUMAN / "base.obj", Extras(rig=rig, weights=weights, targets=targets))


def _moved_at_rest(avatar: Avatar) -> float:
    figure = Figure(avatar)
    rigid, normals = np.empty_like(avatar.mesh.vertices), np.empty_like(avatar.mesh.vertices)
    figure.skin.pose(pose_joints(avatar.skeleton, Posture()), rigid, normals)
    return float(np.linalg.norm(figure.pose(Posture()).vertices - rigid, axis=1).max())


def _row(case: str, metric: str, unit: str, value: float, target: Target | None = None) -> Row:
    return Row("figure", case, metric, unit, round(value, 3), target=target)
