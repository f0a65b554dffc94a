"""What a world keeps on disk: nothing that was told is lost when it is killed, and a disk that fails costs nothing else."""

from __future__ import annotations

import logging
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from world_site import START_NS, WorldSite, scenario

from vistel.figure.posture.posture import Posture, Stance
from vistel.persistence import journal
from vistel.persistence.store import Found, Store
from vistel.space import ledger
from vistel.space.inputs import MotionInput, StepInputs
from vistel.space.room import meeting_room
from vistel.space.snapshot import VERSION
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire.topics import BY_NAME

KILLS = 6


def load(folder: Path, now_ns: int) -> Found | None:
    return Store(folder).load(meeting_room(3), now_ns)


def test_a_world_killed_at_any_moment_has_done_whatever_it_had_confirmed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ledger, "REMEMBERED", 4096)  # as in the world that is killed
    rng = random.Random(8)
    victim = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("world_victim.py")), str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert victim.stdin is not None and victim.stdout is not None
    try:
        for life in range(KILLS):
            victim.stdin.write("again\n")
            victim.stdin.flush()
            pid = int(victim.stdout.readline().split()[1])
            told: list[tuple[str, str, int]] = []
            killing: threading.Timer | None = None
            for line in victim.stdout:
                if "dead" in line:  # on a line of its own, or behind one that the kill cut off
                    break
                outcome, name, step = line.split()
                told.append((outcome, name, int(step)))
                if killing is None and len(told) > 10:
                    killing = threading.Timer(rng.uniform(0.0, 0.3), os.kill, (pid, signal.SIGKILL))
                    killing.start()
            found = load(tmp_path / "run" / "room", START_NS + (life + 1) * 20_000_000_000)
            assert found is not None
            answers = {a.id: a.done for a in found.world._state.ledger.answers}
            assert len(told) > 10
            assert {name: outcome == "done" for outcome, name, _ in told[-100:]}.items() <= answers.items()
            assert found.world.step_number >= told[-1][2]
    finally:
        victim.kill()
        victim.communicate()


def test_what_comes_back_is_the_same_to_the_last_bit_between_two_snapshots(tmp_path: Path) -> None:
    folder = tmp_path / "run" / "room"
    states: list[bytes] = []

    async def play(site: WorldSite) -> None:
        await site.play(3.3, from_s=2.4)
        found = load(folder, site.clock.now_ns())
        assert found is not None
        states.append(found.world.snapshot())
        reply = await site.asking.query(BY_NAME["world_save"])  # type: ignore[union-attr]
        states.append(reply.private_state)

    scenario(tmp_path, play)
    assert states[0] == states[1]


def test_a_journal_that_was_cut_off_is_read_as_far_as_it_is_whole(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    posture = Posture(
        rng.normal(size=25),
        rng.normal(size=(2, 20)),
        Stance(rng.normal(size=3), 0.3),
        rng.normal(size=2),
        {"jaw": rng.normal(size=3)},
    )
    given = [StepInputs(n, n * 7, motions=(MotionInput("aiko", posture, n, n * 5),), left=("bruno",)) for n in (1, 2, 3)]
    path = tmp_path / "a.journal"
    writing = journal.Journal(path)
    for inputs in given:
        message = WorldInputs(step=inputs.step)
        message.header.t_ns = inputs.t_ns
        message.motions.add(participant="bruno", left=True)
        writing.append(journal.record(message, inputs))
    writing.sync()
    writing.close()
    whole = path.read_bytes()
    back = [journal.inputs_of(step) for step in journal.read(path)]
    assert [(b.step, b.t_ns, b.left) for b in back] == [(g.step, g.t_ns, g.left) for g in given]
    same = back[2].motions[0].posture
    assert same.dofs.tobytes() == posture.dofs.tobytes() and same.hands.tobytes() == posture.hands.tobytes()
    assert same.joints["jaw"].tobytes() == posture.joints["jaw"].tobytes()
    for end in range(0, len(whole), 7):
        path.write_bytes(whole[:end])
        assert len(list(journal.read(path))) == end * 3 // len(whole)


def test_a_snapshot_of_a_newer_version_is_kept_reported_in_one_line_and_never_written_over(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "run" / "room"
    newer = folder / "000000-00000000000090.snapshot"
    newer.parent.mkdir(parents=True)
    content = b'{"version":%d,"what":"this world cannot know"}' % (VERSION + 1)
    newer.write_bytes(content)
    site = scenario(tmp_path, lambda s: s.play(5.2))
    told = [r.getMessage() for r in caplog.records if "newer version" in r.getMessage()]
    assert len(told) == 2 and str(newer) in told[0] and f"version {VERSION + 1}" in told[0] and "\n" not in told[0]
    assert sum(topic == "world_inputs" for topic, *_ in site.log) > 300
    (aside,) = (p for p in folder.iterdir() if p.is_dir())
    assert str(aside) in told[1] and (aside / newer.name).read_bytes() == content
    own = [p.name for p in folder.iterdir() if p.is_file() and p.name != "lock"]
    assert own and all(name.startswith("000001-") for name in own)
    assert load(folder, site.clock.now_ns()) is not None


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A real file system with room for hardly anything."""
    place = tmp_path / "small"
    place.mkdir()
    mount = shutil.which("mount")
    command = [mount or "mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(place)]
    done = mount and subprocess.run(command, capture_output=True, check=False)
    if not done or done.returncode:
        pytest.skip("mounting a file system is not allowed here")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=False)


def test_a_full_disk_is_reported_once_costs_no_step_and_is_used_again_when_there_is_room(
    small_disk: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    ballast = small_disk / "ballast"
    folder = small_disk / "run" / "room"

    async def play(site: WorldSite) -> None:
        await site.play(0.5)
        _fill(ballast)
        await site.play(4.5)
        full = load(folder, site.clock.now_ns())
        assert full is not None, "what had been written is gone"
        assert site.rooms()[-1].step - full.world.step_number > 120
        ballast.unlink()
        await site.play(2.5)
        again = load(folder, site.clock.now_ns())
        assert again is not None
        assert again.world.step_number == site.rooms()[-1].step

    site = scenario(small_disk, play)
    steps = [m.step for topic, _, m, _ in site.log if topic == "world_inputs"]
    assert steps == list(range(steps[0], steps[0] + len(steps)))
    told = [r.getMessage() for r in caplog.records if "No space left" in r.getMessage()]
    assert len(told) == 1 and str(folder) in told[0]
    assert any("written again" in r.getMessage() for r in caplog.records)


def _fill(path: Path) -> None:
    with path.open("wb", buffering=0) as out:
        for size in (65536, 4096, 1):
            try:
                while True:
                    out.write(bytes(size))
            except OSError:
                continue


def test_what_is_older_than_two_snapshots_goes(tmp_path: Path) -> None:
    store = Store(tmp_path)
    world = World(meeting_room(3))
    store.begin(world, 0)
    kept: list[list[str]] = []
    for n in range(1, 6):
        inputs = StepInputs(n * 10, n)
        world.step(inputs)
        store.append(journal.record(WorldInputs(step=n * 10), inputs))
        data = store.rotate(world)
        assert data is not None
        store.save(data, world.step_number)
        kept.append(sorted(p.name for p in tmp_path.iterdir() if p.suffix))
    assert kept[-1] == [f"000000-{step:014d}.{kind}" for step in (40, 50) for kind in ("journal", "snapshot")]


WRITES = """
import sys
from pathlib import Path
from vistel.whole_file import whole_file
with whole_file(Path(sys.argv[1])) as stream:
    stream.write(b"half of a snapshot")
    stream.flush()
    print("writing", flush=True)
    sys.stdin.read()
"""


def test_what_a_world_killed_while_it_wrote_left_behind_is_removed_by_the_next_one(tmp_path: Path) -> None:
    path = tmp_path / "000000-00000000000060.snapshot"
    writer = subprocess.Popen([sys.executable, "-c", WRITES, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None and writer.stdout.readline() == "writing\n"
    writer.kill()
    writer.communicate()
    assert not path.exists() and [p.suffix for p in tmp_path.iterdir()] == [".part"]
    store, world = Store(tmp_path), World(meeting_room(3))
    store.begin(world, store.newest_term + 1)
    store.end(world)
    assert {p.suffix for p in tmp_path.iterdir()} == {".snapshot", ".journal", ""}
    assert load(tmp_path, world.t_ns) is not None


def test_a_damaged_snapshot_costs_nothing_the_one_before_and_its_journal_lead_to_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "run" / "room"
    found: list[bytes] = []

    async def play(site: WorldSite) -> None:
        await site.play(5.0)
        for damage in (False, True):
            if damage:
                sorted(folder.glob("*.snapshot"))[-1].write_bytes(b"{")
            world = load(folder, site.clock.now_ns())
            assert world is not None
            found.append(world.world.snapshot())

    scenario(tmp_path, play)
    assert found[0] == found[1]
