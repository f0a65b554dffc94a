"""Avatars in USD: nothing is lost, others' tools find nothing wrong, damaged files are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from avatar_fixture import same
from making_fixture import person
from pxr import Usd, UsdSkel, UsdValidation

from vistel.figure.avatar.avatar import Avatar, scaled
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.formats.load import load_any
from vistel.figure.formats.usd import load_usd, save_usd
from vistel.figure.making.make import refit
from vistel.figure.rigid.weights import influences, joints_only
from vistel.figure.skeleton import JOINTS


def _weighted() -> Avatar:
    """With weights of its own, as imported people have."""
    a = person()
    bone, weight = influences(a.skeleton, a.mesh.vertices, a.mesh.triangles, a.body.joint[a.mesh.limb])
    return replace(a, mesh=replace(a.mesh, bone=bone, weight=weight))


def _faults(path: Path) -> list[str]:
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    return [e.GetMessage() for e in context.Validate(Usd.Stage.Open(str(path)))]


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".usdz"])
@pytest.mark.parametrize("make", [person, _weighted])
def test_a_round_trip_loses_nothing(tmp_path: Path, ending: str, make: Any) -> None:
    path = tmp_path / f"eva{ending}"
    save_usd(make(), path)
    same(make(), load_any(path))


@pytest.mark.parametrize("ending", [".usda", ".usdz"])
def test_the_checkers_of_usd_find_nothing(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"eva{ending}"
    save_usd(_weighted(), path)
    assert _faults(path) == []


def test_the_checkers_would_find_a_fault(tmp_path: Path) -> None:
    path = tmp_path / "eva.usda"
    save_usd(person(), path)
    path.write_text(path.read_text().replace("metersPerUnit = 1", "").replace('defaultPrim = "Avatar"', ""))
    assert _faults(path)


def test_usd_skins_it_as_a_character(tmp_path: Path) -> None:
    path = tmp_path / "eva.usdc"
    avatar = _weighted()
    save_usd(avatar, path)
    stage = Usd.Stage.Open(str(path))
    cache = UsdSkel.Cache()
    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache.Populate(root, Usd.PrimDefaultPredicate)
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/Avatar/Skeleton"))
    query = cache.GetSkelQuery(skeleton)
    assert len(query.GetJointOrder()) == len(JOINTS)
    skin = cache.GetSkinningQuery(stage.GetPrimAtPath("/Avatar/Skin"))
    transforms = query.ComputeSkinningTransforms(Usd.TimeCode.Default())
    points = stage.GetPrimAtPath("/Avatar/Skin").GetAttribute("points").Get()
    assert skin.ComputeSkinnedPoints(transforms, points, Usd.TimeCode.Default())
    np.testing.assert_allclose(np.array(points), avatar.mesh.vertices, atol=1e-5)


def test_joints_take_the_shares_of_their_twist_bones() -> None:
    avatar = _weighted()
    assert avatar.mesh.bone is not None
    assert avatar.mesh.weight is not None
    joint, share = joints_only(avatar.mesh.bone, avatar.mesh.weight)
    assert joint.max() < len(JOINTS)
    np.testing.assert_allclose(share.sum(axis=1), 1.0, atol=1e-5)
    assert (np.diff(share, axis=1) <= 0.0).all()


def test_another_set_of_primitives_is_kept_too(tmp_path: Path) -> None:
    fitted, _ = refit(person(), 60)
    save_usd(fitted, tmp_path / "eva.usda")
    same(fitted, load_usd(tmp_path / "eva.usda"))


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    for ending in (".usda", ".usdc", ".usdz"):
        path = tmp_path / f"eva{ending}"
        save_usd(person(), path)
        whole = path.read_bytes()
        rng = np.random.default_rng(3)
        for data in (b"", b"garbage", whole[: len(whole) // 3], whole[:200], rng.bytes(3000)):
            path.write_bytes(data)
            with pytest.raises(AvatarFileError) as refused:
                load_usd(path)
            assert "\n" not in str(refused.value)


def test_usd_that_is_no_avatar_of_ours_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    path.write_text('#usda 1.0\n(\n    defaultPrim = "A"\n)\ndef Xform "A"\n{\n}\n')
    with pytest.raises(AvatarFileError, match="vistel avatar import"):
        load_usd(path)


def test_numbers_that_lead_nowhere_are_refused(tmp_path: Path) -> None:
    a = _weighted()
    for broken in (
        replace(a, mesh=replace(a.mesh, limb=a.mesh.limb + 1000), coarser=()),
        replace(a, body=replace(a.body, joint=a.body.joint + 1000), coarser=()),
        replace(a, body=replace(a.body, radius_a=a.body.radius_a * np.nan), coarser=()),
    ):
        path = tmp_path / "a.usdc"
        save_usd(broken, path)
        with pytest.raises(AvatarFileError):
            load_usd(path)


def test_a_texture_gone_is_refused_with_its_name(tmp_path: Path) -> None:
    save_usd(person(), tmp_path / "eva.usda")
    (tmp_path / "eva_texture.png").unlink()
    with pytest.raises(AvatarFileError, match=r"eva_texture\.png"):
        load_usd(tmp_path / "eva.usda")


def test_what_is_no_avatar_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AvatarFileError, match="expected"):
        load_any(tmp_path / "a.blend")
    with pytest.raises(FileNotFoundError):
        load_any(tmp_path / "gone.usda")


def test_a_scaled_person_is_as_tall_as_said() -> None:
    tall = scaled(person(), 1.90)
    assert tall.skeleton.height == pytest.approx(1.90)
    assert tall.mesh.vertices[:, 1].max() / person().mesh.vertices[:, 1].max() == pytest.approx(1.90 / 1.70, rel=1e-5)
    assert len(tall.coarser) == len(person().coarser)
