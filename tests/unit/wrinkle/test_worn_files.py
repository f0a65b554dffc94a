"""Wrinkles kept in avatars' files and worn by avatars that are not built in."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.formats.avatar_file import load_avatar, save_avatar
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.load import load_any
from vistel.figure.formats.parcel import pack, unpack
from vistel.figure.formats.usd import save_usd
from vistel.wrinkle.dressing import dressed
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.sets_text import sets_text
from vistel.wrinkle.worn import Worn
from vistel.wrinkle.wrinkle_sets import load_sets, sets_in, wrinkle_sets

TEXT = sets_text(wrinkle_sets(["face"]))


@pytest.fixture(scope="module")
def eva() -> Avatar:
    whole = closed_person()
    coarse = whole.coarser[-1]
    return replace(coarse, wrinkles=TEXT, coarser=())


@pytest.mark.parametrize("ending", [".usda", ".usdz", ".glb", ".vrm", ".npz", ".parcel"])
def test_every_kind_of_avatar_file_keeps_what_is_worn(ending: str, eva: Avatar, tmp_path: Path) -> None:
    path = tmp_path / f"eva{ending}"
    if ending == ".npz":
        save_avatar(eva, path)
    elif ending == ".parcel":
        path.write_bytes(pack(eva))
    else:
        (save_usd if ending.startswith(".usd") else save_gltf)(eva, path)
    assert load_any(path).wrinkles == TEXT


def test_a_file_without_wrinkles_says_none(eva: Avatar, tmp_path: Path) -> None:
    save_avatar(replace(eva, wrinkles=""), tmp_path / "eva.npz")
    assert load_avatar(tmp_path / "eva.npz").wrinkles == ""


def test_a_parcel_with_endless_wrinkles_is_refused(eva: Avatar) -> None:
    with pytest.raises(AvatarFileError, match="wrinkles of 300000 letters"):
        pack(replace(eva, wrinkles="#" * 300_000))
    assert unpack(pack(eva), "parcel").wrinkles == TEXT


def test_the_text_of_sets_read_again_is_the_same_with_shapes_of_ones_own(tmp_path: Path) -> None:
    points = "points = [{ at = [-1, 0] }, { at = [1, 0], intensity = 0.5 }]"
    (tmp_path / "mine.toml").write_text(f'name = "mine"\n[[branches]]\n{points}\n')
    (tmp_path / "sets.toml").write_text(
        '[[sets]]\nname = "one"\nregion = "trunk"\nmemory = 0.25\n'
        'drive = { joint = "lower_arm", axis = [0, 0, 1], curve = { knots = [[1, 0], [90, 1]], form = "linear" } }\n'
        "pull = [[0.0, 0.01], [0.5, 0.0]]\n"
        '[[sets.wrinkles]]\nshape = "mine.toml"\nat = [0.5, 0.5]\nsize = [0.05, 0.1]\n'
        "thickness = 0.01\nintensity = -0.005\nmirrored = true\n"
    )
    sets = [*load_sets(tmp_path / "sets.toml"), *wrinkle_sets()]
    again = sets_in(sets_text(sets), "text")
    assert again[0].shape("mine") == sets[0].shape("mine.toml")
    assert again[0].entry.wrinkles[0] == sets[0].entry.wrinkles[0].model_copy(update={"shape": "mine"})
    assert again[0].entry.drive == sets[0].entry.drive
    assert [s.entry for s in again[1:]] == [s.entry for s in sets[1:]]
    assert sets_text(again) == sets_text(sets)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (TEXT.replace('"forehead_lines"', '"../x.toml"'), "wrinkles[0].shape: is '../x.toml': no files here"),
        (TEXT.replace('"forehead_lines"', '"kilt"'), "no wrinkle shape 'kilt'"),
        (TEXT.replace('"face"', '"tail"'), "sets[0].region: is 'tail', expected one of"),
        (TEXT[:200], "not valid TOML"),
        ("[" * 5000, "not valid TOML"),
        ("sets = 3", "sets: is 3"),
        ("", "sets: is missing"),
        (TEXT.replace("at = [0.5, 0.775]", "at = [0.5, 1.775]"), "leaves the texture"),
    ],
)
def test_a_text_that_cannot_be_worn_is_reported_in_one_line(text: str, said: str) -> None:
    with pytest.raises(WrinkleError) as fault:
        sets_in(text, "avatar 'eva': wrinkles")
    first = str(fault.value).splitlines()[0]
    assert first.startswith("avatar 'eva': wrinkles: ")
    assert said in first


def _everywhere(mesh: Mesh, uv: np.ndarray) -> Mesh:
    return replace(mesh, uv=uv.astype(np.float32))


def test_a_region_without_texture_coordinates_stays_without_wrinkles_and_others_do_not(
    eva: Avatar, caplog: pytest.LogCaptureFixture
) -> None:
    head = np.array([n in ("skull", "face") for n in eva.body.names])[eva.mesh.limb[eva.mesh.corner_vertex]]
    bare = replace(eva, mesh=_everywhere(eva.mesh, np.where(head[:, None], 0.5, eva.mesh.uv)))
    made = dressed(bare)
    worn = Worn(made.avatar, wrinkle_sets(["shirt", "trousers", "face"]), made.charts)
    assert set(worn.left_out) == {"face"}
    assert "has no texture coordinates" in worn.left_out["face"]
    assert caplog.text.count("event=wrinkles_left_out") == 1
    names = {s.name for s in worn.sets}
    assert "left_sleeve_deep" in names and "front_sitting" in names
    assert "forehead" not in names


def test_a_figure_in_plain_colours_wears_what_has_a_chart_of_its_own(eva: Avatar) -> None:
    plain = replace(eva, mesh=_everywhere(eva.mesh, np.full_like(eva.mesh.uv, 0.5)))
    made = dressed(plain)
    worn = Worn(made.avatar, wrinkle_sets(["shirt", "trousers", "face"]), made.charts)
    assert {s.what.region.name for s in worn.sets} == {"sleeve", "trouser_leg"}
    assert all(len(s.texel) for s in worn.sets)


def test_a_texture_that_both_halves_share_is_refused(eva: Avatar) -> None:
    halves = eva.mesh.uv.copy()
    left = eva.mesh.vertices[eva.mesh.corner_vertex, 0] > 0.0
    halves[left] = halves[~left][np.arange(int(left.sum())) % int((~left).sum())]
    worn = Worn(replace(eva, mesh=_everywhere(eva.mesh, halves)), wrinkle_sets(["face"]))
    assert "shown elsewhere too" in worn.left_out["face"]
    assert worn.sets == ()
