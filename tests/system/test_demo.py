"""A whole three-site conference: devices' bytes in, pictures and a log out, with processes killed on the way."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np
import psutil
import pytest
from pxr import Usd, UsdSkel, UsdValidation

from vistel.v1.motion_pb2 import Motion
from vistel.wire.log import LogReader
from vistel.wire.world.decoder import RoomState
from vistel.wire.world.recorded import TOPICS, RecordedWorld

pytestmark = [pytest.mark.alone, pytest.mark.slow]

SITES = ("tokyo", "columbus", "zurich")
PEOPLE = ("aiko", "ben", "carla")
CATCH_UP_S = 3.0
"""Several times what a process takes that is forked with everything loaded, with both cores full
(docs/performance-history.md). Started from nothing a world takes 5 s."""
SETTLED_S = 8.0
"""What came back runs for as long before the next one is killed."""


@dataclass
class Run:
    """A finished conference and what happened to it."""

    out: Path
    text: str
    code: int
    killed_at_ns: dict[str, int]
    processes: list[psutil.Process]

    @property
    def report(self) -> dict:
        return json.loads((self.out / "report.json").read_text())


def _process(node: str, parent: psutil.Process) -> psutil.Process:
    for child in parent.children(recursive=True):
        if f"vistel: {node}" in child.cmdline():
            return child
    raise AssertionError(f"{node} is not running")


@pytest.fixture(scope="module")
def conference(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    """The demo until Ctrl-C; one renderer and the world are killed with SIGKILL on the way."""
    out = tmp_path_factory.mktemp("conference") / "out"
    command = [sys.executable, "-m", "vistel_cli.main", "up", "--seconds", "200", "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    parent = psutil.Process(process.pid)
    killed: dict[str, int] = {}
    processes: list[psutil.Process] = []
    deadline = time.monotonic() + 300
    while not all(_sees_all(out, site) for site in SITES) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.25)  # its videos and its log are looked at, as another process
    for node in ("zurich/renderer", "hub/world"):
        time.sleep(SETTLED_S)  # how long it has run is what counts
        if process.poll() is None:
            _process(node, parent).send_signal(signal.SIGKILL)
            killed[node] = time.time_ns()
    time.sleep(2 * CATCH_UP_S)  # what comes after the last kill is looked at, too
    while not _changed_hands(out) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.25)  # the world may have been killed while it did; it does so again in the meeting's next cycle
    if process.poll() is None:
        processes = parent.children(recursive=True)
    process.send_signal(signal.SIGINT)
    text, _ = process.communicate(timeout=600)
    yield Run(out, text, process.returncode, killed, processes)


def _sees_all(out: Path, site: str) -> bool:
    """Whether a picture of `site` has shown everybody as they are."""
    log = out / "logs" / f"{site}-renderer.log"
    return log.exists() and f"event=picture people={len(PEOPLE)} stand_ins=0" in log.read_text()


def _changed_hands(out: Path) -> bool:
    """Whether the world has seen the baton in the hands of two people."""
    return len(set(re.findall(r"thing=baton held_by=(?!nobody)(\w+)", (out / "logs" / "hub-world.log").read_text()))) >= 2


def test_the_command_ends_well_and_names_what_it_left(conference: Run) -> None:
    assert len(conference.killed_at_ns) == 2, conference.text
    assert conference.code == 0, conference.text
    for name in (*(f"{s}.mp4" for s in SITES), "conference.mcap", "report.json"):
        assert (conference.out / name).exists()
        assert name in conference.text


def test_every_site_has_a_video_that_shows_a_changing_scene(conference: Run) -> None:
    for site in SITES:
        frames: list[np.ndarray] = []
        for path in sorted(conference.out.glob(f"{site}*.mp4")):  # another one since its renderer was killed
            with av.open(str(path)) as video:
                frames += [f.to_ndarray(format="gray") for i, f in enumerate(video.decode(video=0)) if i < 10 or i % 5 == 0]
        killed = f"{site}/renderer" in conference.killed_at_ns  # a slow machine has drawn one picture before, and none since
        assert len(frames) >= (1 if killed else 2)
        assert all(f.shape == (360, 640) for f in frames)
        assert min(f.std() for f in frames) > 15
        assert killed or np.abs(frames[0].astype(int) - frames[-1]).mean() > 0.5


def test_every_device_streamed_at_its_rate(conference: Run) -> None:
    devices = conference.report["devices"]
    assert sorted(devices) == sorted(f"{p}-{d}" for p in PEOPLE for d in ("tracker", "glove-left", "glove-right"))
    for name, device in devices.items():
        assert device["state"] == "streaming", name
        assert device["frames"] > (400 if "glove" in name else 800), name
        assert device["bytes_skipped"] < 200, name


def _records(run: Run, topic: str) -> list:
    return list(LogReader(run.out / "conference.mcap").records(topics=(topic,)))


def _rooms(run: Run) -> list[RoomState]:
    """As the log has them, each once; where the world was there before the recorder, from the first whole room on."""
    world = RecordedWorld()
    records = LogReader(run.out / "conference.mcap").records(topics=TOPICS)
    rooms = [now for record in records for now in world.take(record)]
    assert world.differed == 0 and np.diff([room.t_ns for room in rooms]).all()
    return rooms


def test_motion_of_the_others_goes_on_while_processes_die(conference: Run) -> None:
    for person in PEOPLE:
        times = [r.message.header.t_ns for r in _records(conference, "motion") if r.names["participant"] == person]
        assert len(times) > 400
        for killed in conference.killed_at_ns.values():
            around = [t for t in sorted(times) if -1e9 < t - killed < CATCH_UP_S * 1e9]
            before = [t for t in sorted(times) if -SETTLED_S * 1e9 < t - killed < 0]
            longest = max(0.5e9, 2.0 * max(np.diff(before)))  # a busy machine holds it up while nobody dies, too
            assert around[-1] - killed > CATCH_UP_S * 1e9 - longest
            assert max(np.diff(around)) < longest


def test_a_killed_world_comes_back_and_goes_on_where_it_was(conference: Run) -> None:
    killed = conference.killed_at_ns["hub/world"]
    rooms = _rooms(conference)
    before = max((r for r in rooms if r.t_ns < killed), key=lambda r: r.t_ns)
    later = (r for r in rooms if r.t_ns > killed + 50_000_000 and set(r.participants) == set(PEOPLE))
    after = min(later, key=lambda r: r.t_ns)
    assert (after.t_ns - killed) * 1e-9 < CATCH_UP_S
    assert after.step >= before.step - 120
    assert before.things.keys() == after.things.keys() == rooms[-1].things.keys()


def test_a_killed_renderer_draws_everybody_again(conference: Run) -> None:
    killed = conference.killed_at_ns["zurich/renderer"]
    pictures = [r.message for r in _records(conference, "image_delay") if r.names["site"] == "zurich"]
    whole = [p.header.t_ns for p in pictures if len(p.streams) == len(PEOPLE) and p.stand_ins == 0]
    # It is forked with everything loaded. Its first picture then waits for whatever else the machine does.
    starts = re.findall(r"event=first_picture .*loading_s=([\d.]+)", (conference.out / "logs" / "zurich-renderer.log").read_text())
    assert len(starts) == 2
    assert float(starts[1]) < 1.0
    assert any(t > killed + 50_000_000 for t in whole)


def test_the_log_decodes_and_motion_frames_follow_each_other(conference: Run) -> None:
    for person in PEOPLE:
        motions: list[Motion] = [r.message for r in _records(conference, "motion") if r.names["participant"] == person]
        steps = np.diff([m.header.seq for m in motions])
        assert (steps > 0).all()
        assert np.mean(steps == 1) > 0.98


def test_a_thing_changed_hands(conference: Run) -> None:
    held = conference.report["world"]["things_held_by_in_turn"]
    assert any(len(set(holders)) >= 2 for holders in held.values()), held


def _film(run: Run, folder: Path, *more: str) -> str:
    command = [sys.executable, "-m", "vistel_cli.main", "replay", str(run.out / "conference.mcap"), "--render"]
    command += ["--site", "zurich", "--from", "12", "--to", "12.6", "--fps", "5", "--size", "320x180", "--out", str(folder)]
    return subprocess.run([*command, *more], capture_output=True, text=True, check=True).stdout


def test_the_log_is_drawn_as_a_film_to_the_same_picture_each_time(conference: Run, tmp_path: Path) -> None:
    pictures: list[list[bytes]] = []
    for name in ("one", "two"):
        assert "3 pictures at 5/s, 320x180" in _film(conference, tmp_path / name, "--png")
        pictures.append([f.read_bytes() for f in sorted((tmp_path / name / "zurich").iterdir())])
    assert pictures[0] == pictures[1]
    assert len(set(pictures[0])) == 3
    _film(conference, tmp_path, "--supersample", "2")
    with av.open(str(tmp_path / "zurich.mp4")) as video:
        frames = [f.to_ndarray(format="gray") for f in video.decode(video=0)]
    assert [f.shape for f in frames] == [(180, 320)] * 3
    assert min(f.std() for f in frames) > 15


def test_a_replay_from_devices_begins_with_people_and_things_as_they_were(conference: Run, tmp_path: Path) -> None:
    _film(conference, tmp_path / "recorded", "--png", "--light", "fast", "--size", "640x360", "--to", "16")
    recorded = [cv2.imread(str(f)).astype(int) for f in sorted((tmp_path / "recorded" / "zurich").iterdir())]
    command = [sys.executable, "-m", "vistel_cli.main", "replay", str(conference.out / "conference.mcap"), "--source", "devices"]
    command += ["--site", "zurich", "--from", "12", "--to", "14", "--speed", "0.25", "--out", str(tmp_path)]
    subprocess.run(command, capture_output=True, text=True, check=True)
    with av.open(str(tmp_path / "zurich.mp4")) as video:
        first = next(video.decode(video=0)).to_ndarray(format="bgr24")
    assert min(np.abs(first - picture).mean() for picture in recorded) < 15  # an empty table or other postures: more than 20
    begin_ns = LogReader(conference.out / "conference.mcap").begin_ns
    rooms = _rooms(conference)
    then = [room for room in rooms if 12.0 <= (room.t_ns - begin_ns) * 1e-9 <= 14.0]
    held = {",".join(room.holders("baton")) for room in then}
    replayed = re.findall(r"thing=baton held_by=(\S+)", (tmp_path / "logs" / "replay.log").read_text())
    # Who is about to take it, or has just given it away, may be said in one and not in the other.
    assert held & {*replayed} or "" in held


def test_the_log_is_written_as_usd_that_moves_as_the_conference_did(conference: Run, tmp_path: Path) -> None:
    file = tmp_path / "meeting.usda"
    command = [sys.executable, "-m", "vistel_cli.main", "log", "export", str(conference.out / "conference.mcap")]
    command += ["-o", str(file), "--from", "12", "--to", "13", "--fps", "10"]
    assert "10 frames at 10/s" in subprocess.run(command, capture_output=True, text=True, check=True).stdout
    stage = Usd.Stage.Open(str(file))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (1, 10, 10)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert [e.GetMessage() for e in UsdValidation.ValidationContext(validators).Validate(stage)] == []
    for person in PEOPLE:
        query = UsdSkel.Cache()
        query.Populate(UsdSkel.Root(stage.GetPrimAtPath(f"/Conference/People/{person}")), Usd.PrimDefaultPredicate)
        skeleton = query.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath(f"/Conference/People/{person}/Skeleton")))
        head = list(skeleton.GetJointOrder()).index(next(j for j in skeleton.GetJointOrder() if j.endswith("/head")))
        places = [np.array(skeleton.ComputeJointSkelTransforms(t)[head].ExtractTranslation()) for t in (1, 10)]
        assert all(1.0 < p[1] < 1.5 and 0.3 < np.hypot(p[0], p[2]) < 1.2 for p in places), places
        assert 0.0 < np.abs(places[1] - places[0]).max() < 0.3
    assert stage.GetPrimAtPath("/Conference/Room/Things/baton").GetAttribute("xformOp:translate").GetNumTimeSamples() == 10
    assert len(stage.GetPrimAtPath("/Conference/Cameras").GetChildren()) == len(SITES)


def test_no_process_of_the_conference_is_left(conference: Run) -> None:
    assert len(conference.processes) >= 9
    assert [p.pid for p in conference.processes if p.is_running()] == []
