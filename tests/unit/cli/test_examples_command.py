"""`vistel examples`: a folder in which the commands of the documentation find what they need."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel_cli.examples.made import EXAMPLES, SAID
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import BVH, CONFERENCE, CSV, GLTF, OBJ, PICTURE, SOUND, kind_of_file
from vistel_cli.main import app

KINDS = {
    "conference.toml": CONFERENCE,
    "me.toml": CONFERENCE,
    "mug.glb": GLTF,
    "scan.obj": OBJ,
    "character.vrm": GLTF,
    "face.png": PICTURE,
    "sleeve.jpg": PICTURE,
    "points.csv": CSV,
    "recordings/walk.bvh": BVH,
    "said.wav": SOUND,
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A new folder, and what the command showed."""
    folder = tmp_path_factory.mktemp("examples") / "mine"
    done = CliRunner().invoke(app, ["examples", str(folder), "--no-recording"])
    assert done.exit_code == 0, done.output
    return folder, done.output


@pytest.mark.slow
def test_every_file_is_of_the_kind_that_commands_take(made: tuple[Path, str]) -> None:
    folder, _ = made
    there = {name: kind for name, kind in KINDS.items() if (folder / name).exists()}
    assert there.keys() >= KINDS.keys() - {"said.wav"}  # needs espeak-ng
    assert {name: kind_of_file(folder / name) for name in there} == there
    assert Takes(CONFERENCE).fault(folder / "examples" / "conferences" / "voices.toml") is None
    assert not list(folder.rglob("__pycache__"))


def test_each_line_says_what_to_try_next(made: tuple[Path, str]) -> None:
    for example in EXAMPLES[:-1]:
        assert example.files[0] in made[1] and example.command in made[1]
        assert len(example.command) <= 59


def test_the_last_line_says_in_which_folder_the_commands_work(made: tuple[Path, str]) -> None:
    assert made[1].splitlines()[-1].endswith(f"cd {made[0]}")


def test_recorded_motion_plays(made: tuple[Path, str]) -> None:
    from vistel.conference.model import Conference, Participant, Site
    from vistel_sim.motion.open import open_motion

    walk, hand_over = (str(made[0] / "recordings" / name) for name in ("walk.bvh", "handover"))
    people = zip("abc", (walk, hand_over, hand_over), strict=True)
    sites = [Site(name=name, participants=[Participant(name=name, motion=motion)]) for name, motion in people]
    source = open_motion(Conference(sites=sites))
    assert set(source.participants) == {"a", "b", "c"}
    (at, _), (later, _) = (source.things(t)["baton"] for t in (0.5, 3.5))
    assert sum((at - later) ** 2) ** 0.5 > 0.5


def test_a_folder_that_holds_one_of_the_files_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "mug.glb").write_text("mine")
    done = CliRunner().invoke(app, ["examples", str(tmp_path), "--no-recording"])
    assert done.exit_code == 1
    assert "mug.glb: exists already" in done.stderr.replace("\n", "")
    assert [f.name for f in tmp_path.iterdir()] == ["mug.glb"]


@pytest.mark.skipif(shutil.which("espeak-ng") is None, reason="the spoken example needs espeak-ng")
def test_the_spoken_example_is_understood_and_the_recogniser_prints_nothing_of_its_own(
    made: tuple[Path, str], capfd: pytest.CaptureFixture[str]
) -> None:
    done = CliRunner().invoke(app, ["speech", "try", str(made[0] / "said.wav"), "--language", "en"])
    assert f"✓ {SAID}" in done.output
    assert "WARN" not in "".join(capfd.readouterr())
