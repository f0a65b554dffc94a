"""What hangs loose: long hair, a skirt, the fronts of a jacket."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar, scaled
from vistel.figure.avatar.check import LONGEST_M, AvatarFileError, check_avatar, check_indices
from vistel.figure.body import pose_body
from vistel.figure.figure import Figure
from vistel.figure.formats.avatar_file import load_avatar, save_avatar
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.load import load_any
from vistel.figure.formats.usd import save_usd
from vistel.figure.posed import builtin
from vistel.figure.posture.by_joint import with_joints
from vistel.figure.posture.posture import Posture, Stance, pose_joints, standing
from vistel.figure.posture.standard import standard_postures
from vistel.figure.swing.hanging import MOST_OF_ALL, MOST_SAMPLES, Hanging, HungMesh, distances, groups
from vistel.figure.swing.swing import Swing, SwungLevel

Motion = Callable[[float], Posture]
PEOPLE = ("carla", "grace", "ben")
"""Long hair; a skirt under a jacket; a jacket."""
START_NS = 7_000_000_000_123


@cache
def person(name: str) -> Avatar:
    return builtin(name).avatar


@cache
def figure(name: str) -> Figure:
    return Figure(person(name))


@cache
def hanging(name: str) -> Hanging:
    found = Hanging.of(person(name))
    assert found is not None
    return found


class Moving:
    """One person's pendulums in motion."""

    def __init__(self, name: str) -> None:
        self.figure, self.hanging = figure(name), hanging(name)
        self.swing = Swing(self.hanging, person(name).body)

    def show(self, posture: Posture, at_ns: int | None) -> F64:
        joints = pose_joints(self.figure.avatar.skeleton, posture)
        return self.swing.step(joints, self.figure.skin.matrices(joints), at_ns)

    def film(self, motion: Motion, seconds: float, rate: float, begin: float = 0.0) -> dict[int, F64]:
        """By the time [ms]."""
        out: dict[int, F64] = {}
        for k in range(int((seconds - begin) * rate) + 1):
            t = begin + k / rate
            out[round(1e3 * t)] = self.show(motion(t), START_NS + round(1e9 * t))
        return out


def looking_about(t: float) -> Posture:
    """Turning by 35°, bowing, shaking the head."""
    turned = with_joints(standing(), {"head": (20.0 * math.sin(2.2 * t) ** 2, 30.0 * math.sin(3.0 * t), 0.0)})
    return replace(turned, stance=Stance(np.zeros(3), 0.6 * math.sin(2.5 * t)))


def far(swung: F64) -> float:
    return float(np.linalg.norm(swung, axis=1).max())


@pytest.mark.parametrize("name", PEOPLE)
def test_who_stands_still_is_still(name: str) -> None:
    moving = Moving(name)
    first = moving.show(standing(), START_NS)
    assert far(first) < 0.008
    for k in range(1, 60):
        assert far(moving.show(standing(), START_NS + k * 41_666_667) - first) < 2e-4


@pytest.mark.parametrize("name", PEOPLE)
def test_it_swings_and_comes_to_rest(name: str) -> None:
    moving = Moving(name)
    film = moving.film(lambda t: looking_about(min(t, 2.0)), 6.0, 30.0)
    still = Moving(name).show(looking_about(2.0), None)
    assert far(film[1000] - film[500]) > 0.002
    assert far(film[6000] - film[5000]) < 0.001
    assert far(film[6000] - still) < 0.01


@pytest.mark.parametrize("name", PEOPLE)
def test_pictures_at_24_and_at_60_a_second_show_the_same(name: str) -> None:
    slow, fast = (Moving(name).film(looking_about, 4.0, rate) for rate in (24.0, 60.0))
    both = sorted(slow.keys() & fast.keys())
    assert len(both) > 40
    assert max(far(slow[t] - fast[t]) for t in both) < 0.003


@pytest.mark.parametrize("name", PEOPLE)
def test_who_joins_later_soon_sees_the_same(name: str) -> None:
    early, late = Moving(name).film(looking_about, 5.0, 30.0), Moving(name).film(looking_about, 5.0, 30.0, begin=2.0)
    assert max(far(early[t] - late[t]) for t in late if t > 4000) < 0.003


@pytest.mark.parametrize("name", PEOPLE)
def test_nothing_goes_into_the_body(name: str) -> None:
    h, body = hanging(name), person(name).body
    bowing, sitting = standard_postures()["bow"], standard_postures()["sitting"]
    for posture in (standing(), bowing, sitting, standard_postures()["overhead"]):
        moving = Moving(name)
        moving.film(lambda t, posture=posture: looking_about(t) if t < 0.5 else posture, 1.0, 24.0)
        x = moving.swing.places
        posed = pose_body(body, pose_joints(person(name).skeleton, posture))
        assert (distances(x, posed, h.solid) - h.clear).min() > -0.002


def test_a_jacket_lies_still_on_the_lap_of_who_sits() -> None:
    moving = Moving("ben")
    sitting = standard_postures()["sitting"]
    swung = moving.film(lambda t: replace(sitting, stance=Stance(np.zeros(3), 0.5 * math.sin(4.0 * t))), 1.0, 24.0)
    assert far(swung[1000]) == 0.0


def test_hair_lies_on_clothes() -> None:
    moving = Moving("carla")
    moving.film(lambda t: with_joints(standing(), {"head": (0.0, 55.0 * min(1.0, t), 0.0)}), 2.0, 24.0)
    h, swing = moving.hanging, moving.swing
    joints = pose_joints(moving.figure.avatar.skeleton, with_joints(standing(), {"head": (0.0, 55.0, 0.0)}))
    place, normal = swing.skin(moving.figure.skin.matrices(joints))
    off = replace(h.skin, place=place, normal=normal).distances(swing.places)
    assert (off - h.off).min() > -0.002


@pytest.mark.parametrize("name", PEOPLE)
def test_it_never_runs_away(name: str) -> None:
    rng, moving = np.random.default_rng(3), Moving(name)
    at_ns = START_NS
    for k in range(200):
        posture = looking_about(0.1 * k)
        if k % 7 == 0:
            posture = replace(posture, stance=Stance(rng.normal(0.0, 3.0, 3), float(rng.normal(0.0, 3.0))))
        if k % 31 == 5:
            posture = Posture(np.full_like(posture.dofs, np.nan))
        at_ns += int(rng.choice((-5_000_000_000, 0, 1, 20_000_000, 33_333_333, 10**12)))
        assert far(moving.show(posture, at_ns)) <= 2.5 * moving.hanging.length.max()
    for k in range(100):
        swung = moving.show(standing(), at_ns + (k + 1) * 33_333_333)
    # A hem may stay on the other side of a hand; who was out of sight is combed.
    assert far(swung) < 0.05
    assert far(moving.show(standing(), at_ns + 10**10)) < 0.008


def test_the_work_of_a_picture_is_bounded() -> None:
    moving = Moving("carla")
    moving.show(standing(), START_NS)
    # Who was not seen for an hour is not followed through it.
    moving.show(standing(), START_NS + 3_600_000_000_000)
    assert moving.swing.steps < 200


def test_all_levels_swing_alike() -> None:
    avatar, h = person("carla"), hanging("carla")
    swung = Moving("carla").film(looking_about, 1.0, 30.0)[1000]
    moved: list[tuple[F64, F64]] = []
    for level in (avatar, *avatar.coarser):
        mesh = level.mesh
        assert mesh.hangs is not None
        offsets = np.zeros((len(mesh.vertices), 3), np.float32)
        SwungLevel(HungMesh(level, h), h).add(swung, offsets)
        assert np.abs(offsets[mesh.hangs <= 0.0]).max() == 0.0
        free = mesh.hangs > 0.05
        moved.append((mesh.vertices[free].astype(np.float64), offsets[free].astype(np.float64)))
    (fine, by), *coarser = moved
    assert far(by) > 0.01
    for places, offsets in coarser:
        near = np.asarray(KDTree(fine).query(places)[1])
        assert np.median(np.linalg.norm(by[near] - offsets, axis=1)) < 0.001


def test_what_hangs_is_in_every_file(tmp_path: Path) -> None:
    avatar = replace(person("carla"), coarser=person("carla").coarser[:1])
    save_avatar(avatar, tmp_path / "carla.npz")
    save_usd(avatar, tmp_path / "carla.usdz")
    save_gltf(avatar, tmp_path / "carla.glb")
    for read in (load_avatar(tmp_path / "carla.npz"), *(load_any(tmp_path / f"carla{end}") for end in (".usdz", ".glb"))):
        assert read.mesh.hangs is not None and avatar.mesh.hangs is not None
        assert (read.mesh.hangs == avatar.mesh.hangs).all()
        assert read.coarser[0].mesh.hangs is not None


def test_what_hangs_grows_with_the_person() -> None:
    tall = person("carla")
    small = scaled(tall, 0.5 * tall.skeleton.height)
    assert small.mesh.hangs is not None and tall.mesh.hangs is not None
    assert np.allclose(small.mesh.hangs, 0.5 * tall.mesh.hangs)


def test_a_file_whose_vertices_hang_upwards_is_refused(tmp_path: Path) -> None:
    mesh = person("carla").mesh
    assert mesh.hangs is not None
    for hangs in (-mesh.hangs, mesh.hangs[:-1], np.full_like(mesh.hangs, np.nan)):
        with pytest.raises(AvatarFileError, match="hangs"):
            check_indices(replace(mesh, hangs=hangs), person("carla").body, tmp_path)


def test_who_has_nothing_loose_has_no_pendulums() -> None:
    avatar = person("carla")
    assert Hanging.of(replace(avatar, mesh=replace(avatar.mesh, hangs=None))) is None


def test_somebody_all_of_whom_hangs_has_no_more_pendulums_than_there_may_be() -> None:
    """As a site may send one."""

    def all_hung(level: Avatar) -> Avatar:
        hangs = np.full(len(level.mesh.vertices), LONGEST_M, np.float32)
        hangs[np.unique(groups(level), return_index=True)[1]] = 0.0
        return replace(level, mesh=replace(level.mesh, hangs=hangs))

    wild = replace(all_hung(person("grace")), coarser=tuple(all_hung(level) for level in person("grace").coarser))
    check_avatar(wild, "theirs")
    hung = Hanging.of(wild)
    assert hung is not None
    assert len(hung) <= MOST_OF_ALL
    assert len(hung.skin.place) <= MOST_SAMPLES
    swing, bones = Swing(hung, wild.body), Figure(wild)
    for k in range(8):
        joints = pose_joints(wild.skeleton, looking_about(k / 24.0))
        swung = swing.step(joints, bones.skin.matrices(joints), START_NS + k * 41_666_667)
    assert far(swung) < 2.0 * LONGEST_M
    for level in (wild, *wild.coarser):
        out = np.zeros((len(level.mesh.vertices), 3), np.float32)
        SwungLevel(HungMesh(level, hung), hung).add(swung, out)
        assert np.isfinite(out).all()
