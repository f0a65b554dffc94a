"""Wrinkle shapes and their files: what is in the taxonomy, what is refused and how that is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.shape import Branch, Point, normalised
from vistel.wrinkle.shape_file import FOLDER, builtin_shapes, load_shape, save_shape, shape_of, shape_text
from vistel.wrinkle.sheet import load_sheet

TAXONOMY = {
    "sleeve_bend", "elbow_star", "armpit_pull", "shirt_front_sitting", "collar", "knee", "forehead_lines", "crows_feet",
    "nose_root", "smile_fold", "knuckles", "neck",
}  # fmt: skip

PLAIN = """
name = "mine"
[[branches]]
points = [{ at = [-0.5, 0.0] }, { at = [0.5, 0.1], intensity = 0.5 }]
"""


def _file(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_the_taxonomy_has_the_characteristic_shapes() -> None:
    assert set(builtin_shapes()) >= TAXONOMY
    assert all(path.stem == load_shape(path).name for path in FOLDER.glob("*.toml"))


@pytest.mark.parametrize("name", sorted(TAXONOMY))
def test_a_shape_written_and_read_again_is_the_same(name: str, tmp_path: Path) -> None:
    shape = builtin_shapes()[name]
    save_shape(shape, tmp_path / "again.toml")
    assert load_shape(tmp_path / "again.toml") == shape


def test_a_shape_of_ones_own_is_found_beside_the_file_that_names_it(tmp_path: Path) -> None:
    _file(tmp_path, PLAIN)
    assert shape_of("mine.toml", tmp_path).branches[0].points[1].intensity == 0.5


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLAIN + "\nthick = 3", "branches[0].thick: unknown key; expected one of points, start, end, cap"),
        (PLAIN.replace("intensity", "depth"), "branches[0].points[1].depth: unknown key; expected one of at, intensity, thickness"),
        (PLAIN.replace("0.5, 0.1", "1.5, 0.1"), "branches[0].points[1].at[0]: is 1.5, expected at most 1"),
        (PLAIN.replace("0.5, 0.1", "nan, 0.1"), "branches[0].points[1].at[0]: is nan"),
        (PLAIN.replace("0.5, 0.1", "-0.5, 0.0"), "branches[0]: control points 0 and 1 are in one place"),
        (PLAIN.replace(", { at = [0.5, 0.1], intensity = 0.5 }", ""), "branches[0].points"),
        ('name = "mine"', "branches: is missing"),
        (
            PLAIN + "[[branches]]\npoints = [{ at = [0.0, -0.5] }, { at = [0.0, 0.5] }]",
            "branches[0] and branches[1] cross at (0.00, 0.05); let one begin there",
        ),
        (
            'name = "loop"\n[[branches]]\npoints = [{at=[-0.9,0.0]},{at=[0.6,0.1]},{at=[0.5,0.7]},{at=[0.0,-0.8]}]',
            "branches[0]: crosses itself at",
        ),
        (
            PLAIN + 'start = "round"\n[[profile]]\nlean = 0.3',
            "branches[0]: an end that is round needs a profile without offset and lean; use taper",
        ),
        ("name = [", "not valid TOML"),
    ],
)
def test_a_shape_that_cannot_be_used_is_reported_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    path = _file(tmp_path, text)
    with pytest.raises(WrinkleError) as fault:
        load_shape(path)
    assert said in str(fault.value)
    assert str(fault.value).startswith(str(path))
    assert len(str(fault.value).splitlines()) == 1


def test_a_branch_may_begin_on_another(tmp_path: Path) -> None:
    text = PLAIN + "[[branches]]\npoints = [{ at = [0.0, 0.05] }, { at = [0.2, 0.6] }]"
    assert len(load_shape(_file(tmp_path, text)).branches) == 2


def test_a_shape_is_normalised() -> None:
    points = [Point(at=(0.1, 0.2), intensity=0.2, thickness=0.1), Point(at=(0.5, 0.4), intensity=-0.4, thickness=0.2)]
    shape = normalised([Branch(points=points)], "small")
    places = shape.branches[0].places
    assert np.allclose(places, [(-1.0, -0.5), (1.0, 0.5)])
    assert [p.intensity for p in shape.branches[0].points] == [0.5, -1.0]
    assert [p.thickness for p in shape.branches[0].points] == [0.5, 1.0]


SHEET = """
size = [0.4, 0.5]
[[wrinkles]]
shape = "knee"
at = [0.5, 0.5]
size = 0.1
thickness = 0.01
intensity = 0.005
"""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SHEET.replace("0.5, 0.5]\nsize", "0.9, 0.5]\nsize"), "wrinkles[0]: leaves the texture at"),
        (SHEET.replace("knee", "kneee"), "wrinkles[0].shape: no wrinkle shape 'kneee'; there are armpit_pull,"),
        (SHEET.replace("thickness = 0.01", "thickness = 0"), "wrinkles[0].thickness: is 0, expected more than 0"),
        (SHEET + "colour = 3", "wrinkles[0].colour: unknown key; expected one of shape, at, size"),
    ],
)
def test_a_sheet_that_cannot_be_used_is_reported_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    path = _file(tmp_path, text)
    with pytest.raises(WrinkleError) as fault:
        load_sheet(path)
    assert said in str(fault.value)
    assert len(str(fault.value).splitlines()) == 1


def test_a_wrinkle_may_cross_the_edge_where_the_plane_wraps(tmp_path: Path) -> None:
    text = SHEET.replace("0.5, 0.5]\nsize", "0.9, 0.5]\nsize").replace("size = [0.4", "wraps = true\nsize = [0.4")
    assert len(load_sheet(_file(tmp_path, text))[1]) == 1


def test_the_text_of_a_shape_can_be_read_by_people() -> None:
    assert shape_text(builtin_shapes()["knuckles"]).count("\n  { at = [") == 12
