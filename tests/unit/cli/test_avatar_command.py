"""The commands of docs/how-to/make-an-avatar.md, one after the other; wrong usage ends in one line and code 2."""

from __future__ import annotations

import json
import re
import runpy
import shlex
from pathlib import Path

import pytest
from avatar_fixture import closed_person
from typer.testing import CliRunner

from vistel.conference.files import load, public_avatar
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.load import load_any
from vistel.figure.formats.obj import export_obj
from vistel.figure.formats.usd import save_usd
from vistel.figure.making.report import verdict
from vistel.render.figures.people import files_of, load_avatar_of
from vistel.render.gl.context import NoOpenGlError, open_surface
from vistel.render.stage.stage import ParticipantInfo
from vistel_cli.main import app

PAGE = Path(__file__).resolve().parents[3] / "docs/how-to/make-an-avatar.md"


def _run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(words))
    return result.exit_code, result.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a new user has put a scan."""
    out = tmp_path_factory.mktemp("avatar")
    export_obj(closed_person(), out / "scan.obj")
    return out


def _of_others(avatar: Avatar, path: Path) -> None:
    """The avatar as a program that knows nothing of VISTEL would write it."""
    save_gltf(avatar, path)
    path.write_bytes(path.read_bytes().replace(b'"VISTEL_avatar"', b'"OTHERS_avatar"'))


def _in_parts(avatar: Avatar, folder: Path) -> None:
    """A person in two parts, cut at an elbow as the example cuts all joints."""
    scans = runpy.run_path(str(PAGE.parents[2] / "examples/avatars/scan_parts.py"))
    planes = scans["cuts"](avatar)["left_forearm"]
    point, normal = planes[0][1], planes[0][2]
    scans["make"](avatar, {"torso": [("left_forearm", point + scans["GAP"] * normal, -normal)], "left_forearm": planes}, folder)


def _has_gl() -> bool:
    try:
        open_surface().close()
    except NoOpenGlError:
        return False
    return True


@pytest.mark.slow
def test_the_commands_of_the_page_work_in_its_order(folder: Path, monkeypatch: pytest.MonkeyPatch, shared_data: Path) -> None:
    monkeypatch.chdir(folder)
    for name in ("base.obj", "rig.game_engine.json", "weights.game_engine.json.gz"):
        (folder / name).symlink_to(shared_data / "human/makehuman" / name)
    (folder / "skin.png").symlink_to(folder / "scan.png")
    (folder / "face.png").symlink_to(folder / "scan.png")
    small = closed_person().coarser[0]
    _of_others(small, folder / "character.vrm")
    save_gltf(small, folder / "character.glb")
    save_usd(small, folder / "character.usdz")
    target = "caucasian-male-young.target.gz"
    (folder / target).symlink_to(shared_data / "human/makehuman/targets" / target)
    _in_parts(small, folder / "parts")
    commands = re.findall(r"^    (vistel avatar .*)$", PAGE.read_text("utf-8"), re.MULTILINE)
    assert len(commands) == 18
    for command in dict.fromkeys(commands):
        if "--sheet" in command and not _has_gl():
            continue
        words = shlex.split(command)[1:]
        more = ["--force"] if {"-o", "--sheet"} & {*words} else []  # the page shows several ways to the same file
        code, said = _run(*words, *more)
        assert code == 0, f"{command}: {said}"
    assert (folder / "me.usdz").stat().st_size > 100_000
    assert load_any(folder / "me.vrm").skeleton.height == pytest.approx(1.75, abs=0.02)
    assert load_any(folder / "me.usda").registration == ()


def test_import_reports_what_it_found(folder: Path) -> None:
    code, said = _run("avatar", "import", str(folder / "scan.obj"), "-o", str(folder / "a.usdc"), "--json")
    assert code == 0, said
    facts = json.loads(said)
    assert facts["joints_from"] == "shape of the mesh"
    assert facts["eyeballs"] == 2
    assert facts["height_m"] == pytest.approx(1.70, abs=0.02)
    assert facts["mean_distance_mm"] < 8


def test_inspect_gives_a_verdict_in_three_lines_and_every_figure_when_asked(folder: Path) -> None:
    save_usd(closed_person(), folder / "closed.usda")
    code, said = _run("avatar", "inspect", str(folder / "closed.usda"))
    assert code == 0, said
    who, mesh, fit = said.splitlines()
    assert who.startswith("eva: 1.7 m tall")
    assert mesh.split() == ["mesh", "good:", "one", "large", "piece,", "no", "holes"]
    assert fit.split()[:2] == ["fit", "good:"]
    code, more = _run("avatar", "inspect", str(folder / "closed.usda"), "--verbose")
    assert code == 0 and more.startswith(said)
    assert "left_palm" in more and "mean distance mm" in more and "fits badly" not in more


def test_hair_and_clothes_are_told_apart_from_the_body_which_is_judged() -> None:
    code, said = _run("avatar", "inspect", "builtin:person=ben", "--json")
    assert code == 0, said
    facts = json.loads(said)
    assert facts["hair_vertices"] > 1000 and facts["clothes_vertices"] > 2000
    assert facts["open_edges"] == 0 and facts["pieces"] == 3
    assert facts["vertices"] <= 10_000


def test_the_verdict_names_what_is_poor() -> None:
    facts = {"name": "me", "height_m": 1.7, "vertices": 10, "primitives": 23, "texture": "8 x 8", "open_edges": 12}
    facts |= {"not_manifold_edges": 3, "pieces": 2, "mean_distance_mm": 9.0, "primitives_that_fit_badly": ["a", "b", "c", "d"]}
    _, mesh, fit = verdict(facts)
    assert (
        mesh == "  mesh  usable, 2 large pieces, but 12 edges at holes that nothing covers and 3 edges of more than two triangles"
    )
    assert fit.startswith("  fit   poor at 4 of 23 primitives (a, b, c and others)")


def test_a_participant_is_drawn_with_the_file_beside_the_conference_file(folder: Path) -> None:
    assert _run("avatar", "generate", "-o", str(folder / "eva.usda"), "--look", "person=carla", "--force")[0] == 0
    (folder / "c.toml").write_text(
        '[[sites]]\nname = "tokyo"\n[[sites.participants]]\nname = "ben"\nheight = 1.9\navatar = "eva.usda"\n'
    )
    conference = load(folder / "c.toml")
    wanted = conference.sites[0].participants[0].avatar
    assert public_avatar(wanted) == "eva.usda"
    about = ParticipantInfo("ben", "Ben", public_avatar(wanted), 1.9)
    assert load_avatar_of(about, files_of(conference)).skeleton.height == pytest.approx(1.9)
    with pytest.raises(ValueError, match=r"gone\.usda"):
        load_avatar_of(ParticipantInfo("ben", "Ben", "gone.usda", 1.9))
    with pytest.raises(ValueError, match="expected the name"):
        load_avatar_of(ParticipantInfo("eve", "Eve", str(folder / "eva.usda"), 1.9), files_of(conference))


@pytest.mark.parametrize(
    "words",
    [
        ("import", "{f}/gone.obj", "-o", "{f}/x.usda"),
        ("import", "{f}/scan.obj", "-o", "{f}/x.blend"),
        ("import", "{f}/scan.mtl", "-o", "{f}/x.usda"),
        ("import", "{f}/scan.obj", "-o", "{f}/no/x.usda"),
        ("import", "{f}/scan.obj", "-o", "{f}/x.usda", "--up", "X"),
        ("inspect", "{f}/gone.usda"),
        ("inspect", "{f}/scan.obj"),
        ("import", "{f}/scan.obj", "-o", "{f}/x.usda", "--weights", "{f}/w"),
        ("inspect", "builtin:seed=x"),
        ("import", "{f}/scan.obj", "-o", "{f}/x.usda", "--primitives", "30"),
        ("generate", "-o", "{f}/x.usda", "--look", "age=300"),
        ("export", "{f}/gone.usda", "-o", "{f}/x.usdz"),
        ("islands", "{f}/gone.usda"),
        ("register", "{f}/gone.usda", "--island", "0"),
        ("import", "{f}/gone.vrm", "-o", "{f}/x.usda"),
        ("register", "{f}/eva.usda", "--island", "0", "--move", "up"),
        ("register", "{f}/eva.usda", "--island", "9999"),
        ("register", "{f}/eva.usda", "--island", "0", "--texture", "{f}/scan.obj"),
        ("export", "builtin", "-o", "{f}/x.stl"),
    ],
)
def test_wrong_usage_ends_in_one_line(folder: Path, words: tuple[str, ...]) -> None:
    code, said = _run("avatar", *(w.format(f=folder) for w in words))
    assert code in (1, 2), said
    assert said.startswith("error: ")
    assert len(said.strip().splitlines()) == 1
