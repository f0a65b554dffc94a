"""No command writes over a file that was there before it, unless it is told to."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from vistel_cli.lazy import every_command
from vistel_cli.main import app
from vistel_cli.overwriting import written_whole

SCENE = Path(__file__).resolve().parents[3] / "examples" / "scenes" / "blobs.toml"
EVERY = dict(every_command(typer.main.get_command(app), "vistel"))


@pytest.mark.parametrize(
    "words",
    [
        ("trace", str(SCENE), "-o", "there.png"),
        ("polygonise", str(SCENE), "-o", "new.obj"),
        ("avatar", "generate", "-o", "new.usda"),
        ("avatar", "export", "builtin:person=carla", "--out", "new.obj"),
        ("avatar", "inspect", "builtin:person=carla", "--sheet", "there.png"),
        ("world", "export", "room.toml", "-o", "new.usda"),
        ("calibrate", "glove", "demo", "aiko", "left", "-o", "there.png"),
        ("board", "--save", "there.png"),
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_a_file_that_exists_stays_as_it_was(words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from vistel.conference.files import DEMO_FILE

    monkeypatch.chdir(tmp_path)
    for name in ("there.png", "new.png", "new_texture.png"):
        Path(name).write_text("mine")
    Path("new_textures").mkdir()
    done = CliRunner().invoke(app, [str(DEMO_FILE) if w == "demo" else w for w in words])
    assert done.exit_code == 1
    assert "exists already" in done.stderr and "--force" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert {f.name for f in tmp_path.iterdir()} == {"there.png", "new.png", "new_texture.png", "new_textures"}


@pytest.mark.parametrize(
    ("place", "why"),
    [("missing/new.png", "there is no folder missing; make it first"), ("there", "it is a folder; name a file in it")],
)
def test_a_place_without_a_folder_is_refused_before_the_work(
    place: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("there").mkdir()
    for words in (("trace", str(SCENE)), ("log", "import", str(SCENE)), ("wall", str(SCENE))):
        done = CliRunner().invoke(app, [*words, "-o", place, "--force"])
        assert done.exit_code == 1
        assert f"{place}: cannot be written: {why}" in done.stderr
        assert len(done.stderr.splitlines()) == 1
    assert [f.name for f in tmp_path.iterdir()] == ["there"]


@pytest.mark.parametrize("before", [None, "mine"])
def test_of_what_is_not_written_to_its_end_nothing_is_left(before: str | None, tmp_path: Path) -> None:
    output = tmp_path / "x.mcap"
    if before is not None:
        output.write_text(before)
    with pytest.raises(KeyboardInterrupt), written_whole(output) as made:
        made.write_text("half")
        raise KeyboardInterrupt
    assert {f.name: f.read_text() for f in tmp_path.iterdir()} == ({} if before is None else {"x.mcap": before})
    with written_whole(output) as made:
        made.write_text("whole")
    assert {f.name: f.read_text() for f in tmp_path.iterdir()} == {"x.mcap": "whole"}


def test_with_force_it_is_written_over(tmp_path: Path) -> None:
    from vistel_cli.overwriting import keep_existing

    (tmp_path / "there.png").write_text("mine")
    keep_existing(tmp_path / "there.png", force=True)
    keep_existing(tmp_path / "new.png", force=False)


def test_every_command_that_writes_a_file_keeps_those_that_exist() -> None:
    """What has --out has --force, but for commands that only add to a folder."""
    adding = {"vistel record", "vistel site join", "vistel site world"}
    for path, command in EVERY.items():
        options = {o for p in command.params for o in getattr(p, "opts", ())}
        if options & {"--out", "-o", "--sheet", "--picture", "--save"} and path not in adding:
            assert "--force" in options, path
        assert "--output" not in options, f"{path}: one spelling of an option"
