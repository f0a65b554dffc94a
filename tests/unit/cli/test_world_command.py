"""`vistel world`: show, edit, export; what each says of bad input."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from vistel.space import actions as ask
from vistel.space.arguments import Which
from vistel.space.files import Interior, load_room, save_usd
from vistel.space.inputs import CommandInput, ParticipantBody, StepInputs
from vistel.space.room import Room, meeting_room
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire.log import LogWriter
from vistel.wire.topics import BY_NAME
from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[3]
DEN = ROOT / "examples/rooms/den.usdz"
CONFERENCE = ROOT / "examples/conferences/den.toml"
START_NS = 1_700_000_000_000_000_000
NEWER = '#usda 1.0\n(\n    defaultPrim = "Room"\n)\ndef Xform "Room"\n{\n    bool vistel:shell = 1\n    int vistel:format = 9\n}\n'
SOLO = '[[sites]]\nname = "tokyo"\n[[sites.participants]]\nname = "ann"\n'


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """The built-in room's things as a file."""
    path = tmp_path / "room.usda"
    save_usd(Interior(meeting_room(3)), path)
    return path


def _run(*words: object, code: int = 0) -> str:
    done = CliRunner().invoke(app, ["world", *map(str, words)], env={"COLUMNS": "200"})
    assert done.exit_code == code, (done.output, done.exception)
    return done.output


def _refused(*words: object, says: str, code: int = 1) -> None:
    said = _run(*words, code=code)
    (line,) = [line for line in said.splitlines() if line.startswith("error:")]
    assert says in line, said
    assert "Traceback" not in said


# -- show --------------------------------------------------------------------------------------------------------


def test_show_lists_things_seats_and_what_they_weigh() -> None:
    said = _run("show", DEN)
    assert "2 seats" in said and "kg" in said
    facts = json.loads(_run("show", DEN, "--json"))
    assert len(facts["seats"]) == 2 and not facts["built_in_walls"]
    rug = next(t for t in facts["things"] if t["id"] == "rug")
    assert rug["fixed"] and rug["pictures"] == 1 and rug["triangles"] == 2


def test_show_takes_a_conference_for_its_room() -> None:
    ids = {t["id"] for t in json.loads(_run("show", CONFERENCE, "--json"))["things"]}
    assert {t.id for t in load_room(DEN).room.things} <= ids


@pytest.mark.gl
def test_show_draws_it_in_the_size_asked_for(tmp_path: Path) -> None:
    _run("show", DEN, "--picture", tmp_path / "den.png", "--size", "160x90")
    picture = np.asarray(Image.open(tmp_path / "den.png"))
    assert picture.shape == (90, 160, 3) and picture.std() > 10


# -- edit --------------------------------------------------------------------------------------------------------


def test_edit_changes_the_file_and_says_what(room: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.usda"
    said = _run("edit", room, "set", "baton", "mass=0.2", "rigidity=0.25", "then", "remove", "cone", "-o", other)
    assert "mass 0.2" in said and "removed cone" in said
    changed = load_room(other).room
    assert changed.thing("baton").mass == 0.2 and changed.thing("baton").compliance == 0.75
    assert "cone" not in changed.by_id and "cone" in load_room(room).room.by_id
    _run("edit", room, "move", "ball", "to=0,1,0", "then", "seat", "new", "at=0,1.2", "heading=180")
    again = load_room(room).room
    assert again.thing("ball").position.tolist() == [0.0, 1.0, 0.0] and len(again.seats) == 4


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (("set", "baton", "mass=heavy"), "expected a number"),
        (("set", "nothing", "mass=1"), "no such thing"),
        (("paint", "baton", "red"), "expected set, move, add, remove, seat"),
        (("set", "baton", "mass=nan"), "expected a number"),
        (("set", "baton", "mass=1e9"), "expected a number from 0 to 50"),
        (("set", "baton", "colour=red"), "such as #c23b32"),
        (("add", "Mug!", "shape=ball"), "small letters"),
        (("seat", "9", "remove"), "one of 0 to 2"),
        (("set",), "what it is about"),
        (("set", "baton", "mass=0.3", "then", "remove", "gone"), "no such thing"),
        (("add", "ball"), "two things have this id"),
        (("add", "mug", "file=gone.glb"), "no such file"),
    ],
)
def test_edit_that_cannot_be_done_leaves_the_file_as_it_was(room: Path, changes: tuple[str, ...], says: str) -> None:
    before = room.read_bytes()
    _refused("edit", room, *changes, says=says, code=2)
    assert room.read_bytes() == before


# -- export ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["usda", "usdc", "usdz", "glb"])
def test_export_writes_a_conference_as_it_begins(tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"room.{ending}"
    said = _run("export", CONFERENCE, "-o", out)
    assert "as it begins" in said and out.stat().st_size > 1000
    if ending != "glb":
        assert {t.id for t in load_room(out).room.things} >= {t.id for t in load_room(DEN).room.things}


def test_export_writes_a_log_at_a_time(tmp_path: Path) -> None:
    world = World(meeting_room(1))
    world.step(StepInputs(1, START_NS, (ParticipantBody("ann"),)))
    early = world.snapshot()
    world.step(StepInputs(2, START_NS + 1, commands=(CommandInput("c", "ann", ask.Delete(Which("ball"))),)))
    log = tmp_path / "conference.mcap"
    with LogWriter(log, SOLO) as writer:
        for k, state in enumerate((early, early, world.snapshot())):
            message = WorldInputs(step=k, private_state=state)
            message.header.version, message.header.t_ns = 1, START_NS + k * 1_000_000_000
            topic = BY_NAME["world_inputs"]
            writer.write(topic, topic.format(conference="demo"), message, message.header.t_ns)
    assert "2.0 s after it began" in _run("export", log, "-o", tmp_path / "end.usda")
    _run("export", log, "--at", "1.5", "-o", tmp_path / "then.usda")
    assert "ball" not in load_room(tmp_path / "end.usda").room.by_id
    assert "ball" in load_room(tmp_path / "then.usda").room.by_id


def test_export_of_a_log_that_is_none_or_holds_no_world(tmp_path: Path) -> None:
    broken, empty = tmp_path / "broken.mcap", tmp_path / "empty.mcap"
    broken.write_bytes(b"not a log")
    with LogWriter(empty, SOLO):
        pass
    _refused("export", broken, "-o", tmp_path / "a.usda", says="broken.mcap")
    _refused("export", empty, "-o", tmp_path / "a.usda", says="no state of the world")
    _refused("export", tmp_path / "gone.mcap", "-o", tmp_path / "a.usda", says="gone.mcap")


def test_export_where_it_makes_no_sense(room: Path, tmp_path: Path) -> None:
    _refused("export", room, "-o", tmp_path / "a.usda", "--at", "1", says="only of a log", code=2)


def test_a_time_after_the_end_of_a_log_is_refused(room: Path, tmp_path: Path) -> None:
    with LogWriter(tmp_path / "short.mcap") as writer:
        for n in range(2):
            message = WorldInputs()
            message.header.version = 1
            writer.write(BY_NAME["world_inputs"], "vistel/demo/world/inputs", message, n * 5_000_000_000)
    for words in (("world", "export", "--at", "12.5", "-o", "a.usda"), ("log", "cut", "--from", "12.5", "-o", "a.mcap")):
        result = CliRunner().invoke(app, [*words[:2], str(tmp_path / "short.mcap"), *words[2:-1], str(tmp_path / words[-1])])
        assert result.exit_code != 0 and f"{words[2]} 12.5: the log ends at 5.0 s" in result.output
    _refused("export", room, "-o", tmp_path / "a.usda", "--hub", "tcp/127.0.0.1:1", says="need a conference file", code=2)
    _refused("export", room, "-o", tmp_path / "a.obj", says="expected a name that ends in")
    _refused("export", room, "-o", tmp_path / "gone" / "a.usda", says="there is no folder")


# -- files that cannot be used -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("newer.usda", NEWER, "written by another version"),
        ("broken.usda", "#usda 1.0\ndef Xform {", "not a whole USD file"),
        ("broken.usdz", "PK\x03\x04 no", "this is an archive"),
        ("empty.usdc", "", "this is an empty file"),
        ("broken.glb", "glTF no", "broken.glb"),
        ("empty.obj", "", "empty.obj"),
        ("room.txt", "wall", "this is a text of no kind"),
        ("broken.toml", "[room", "not valid TOML"),
        ("lacking.toml", SOLO + '[room]\nfile = "gone.usda"\n', "no such file"),
        ("odd.toml", SOLO + "[room]\nchairs = 3\n", "room.chairs"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(tmp_path: Path, name: str, content: str, says: str) -> None:
    file = tmp_path / name
    file.write_text(content, "latin-1")
    _refused("show", file, says=says)
    _refused("export", file, "-o", tmp_path / "out.usda", says=says)
    assert not (tmp_path / "out.usda").exists()


def test_a_file_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    gone = tmp_path / "gone.usda"
    for words in (("show", gone), ("edit", gone, "remove", "ball"), ("export", gone, "-o", tmp_path / "a.usda")):
        _refused(*words, says="no such file")


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="this user may write everywhere")
def test_a_folder_that_refuses_is_one_line(room: Path, tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir()
    closed.chmod(0o500)
    _refused("export", room, "-o", closed / "a.usda", says="cannot be written")


def test_what_is_in_the_way_is_one_line(room: Path, tmp_path: Path) -> None:
    for ending in ("usda", "usdz", "glb"):
        (tmp_path / f"taken.{ending}").mkdir()
        _refused("export", room, "-o", tmp_path / f"taken.{ending}", "--force", says="cannot be written")
    _refused("show", room, "--picture", tmp_path / "gone" / "a.png", says="there is no folder")
    _refused("show", room, "--picture", tmp_path / "a.png", "--size", "wide", says="size", code=2)


def test_a_room_with_nothing_in_it_is_a_room(tmp_path: Path) -> None:
    empty = tmp_path / "empty.usda"
    save_usd(Interior(Room((), ())), empty)
    assert "0 things" in _run("show", empty)
    _run("export", empty, "-o", tmp_path / "again.usdz")
    assert load_room(tmp_path / "again.usdz").room.things == ()


# -- serve -------------------------------------------------------------------------------------------------------


def test_serve_says_what_is_missing(tmp_path: Path) -> None:
    solo = tmp_path / "solo.toml"
    solo.write_text(SOLO)
    _refused("serve", tmp_path / "gone.toml", says="gone.toml")
    _refused("serve", solo, says="does not run on this machine")
    _refused("serve", solo, "--hub", "tls/192.0.2.7:7447", says="needs certificates")
    _refused("serve", solo, solo, "--hub", "tcp/127.0.0.1:1", says="each needs a name of its own")


def test_serve_says_at_once_that_no_router_answers_yet(tmp_path: Path) -> None:
    solo = tmp_path / "solo.toml"
    solo.write_text(SOLO)
    script = "from vistel_cli.main import app; app()"
    words = ["world", "serve", str(solo), "--hub", "tcp/127.0.0.1:1", "--keep", str(tmp_path), "--seconds", "0.1"]
    done = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert "no router answers at tcp/127.0.0.1:1 yet; it is tried again" in done.stderr, done.stderr
    assert done.returncode == 0
