"""`vistel log export --foxglove` and `--npz`: read back by others' readers, the same is where it was."""

from __future__ import annotations

import csv
import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as Event
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.reader import make_reader
from typer.testing import CliRunner, Result

import vistel.log
from vistel.arrays import F64
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, JOINTS
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.log.numbers import body_of, skeleton_of
from vistel_cli.main import app

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"
KINDS: dict[str, Any] = {"/scene": SceneUpdate, "/tf": FrameTransforms, "/events": Event}


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["log", "export", *map(str, arguments)], env={"COLUMNS": "160"})


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[float, Any]]]:
    """Messages by topic, with their times in the log [s], parsed by the schemas that stand in the file itself."""
    path = tmp_path_factory.mktemp("viewed") / "viewed.mcap"
    done = call(MEETING, "--foxglove", "-o", path)
    assert done.exit_code == 0, done.output
    out: dict[str, list[tuple[float, Any]]] = {}
    begin_ns = vistel.log.open(MEETING).begin_ns
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None and schema.name == KINDS[channel.topic].DESCRIPTOR.full_name
            pool = DescriptorPool()
            for described in FileDescriptorSet.FromString(schema.data).file:
                pool.Add(described)
            parsed = GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString(message.data)
            out.setdefault(channel.topic, []).append(((message.log_time - begin_ns) * 1e-9, parsed))
    return out


def test_every_frame_leads_to_one_root_and_every_entity_is_locked_to_a_frame(told: dict[str, list[tuple[float, Any]]]) -> None:
    entities = {e.id: e for _, update in told["/scene"] for e in update.entities}
    assert {"ben/left_hand", "aiko/head", "aiko/name", "thing/baton"} <= entities.keys()
    above: dict[str, str] = {}
    for _, message in told["/tf"]:
        above = {k.child_frame_id: k.parent_frame_id for k in message.transforms}
        roots = {root(above, frame) for frame in above}
        assert roots == {"world"}
        assert all(abs(np.linalg.norm([*quaternion(k.rotation)]) - 1.0) < 1e-6 for k in message.transforms)
    assert all(e.frame_locked and e.frame_id in above for e in entities.values() if e.frame_id.startswith(("ben", "aiko")))
    assert len([e for _, update in told["/scene"] for e in update.entities if e.id == "ben/left_hand"]) == 1, "sent once"


def root(above: dict[str, str], frame: str) -> str:
    for _ in range(10):
        if frame not in above:
            return frame
        frame = above[frame]
    raise AssertionError(f"{frame} is in a circle of frames")


def quaternion(q: Any) -> tuple[float, float, float, float]:
    return q.x, q.y, q.z, q.w


def test_limbs_are_where_the_figure_has_them(told: dict[str, list[tuple[float, Any]]]) -> None:
    log = vistel.log.open(MEETING)
    postures = dict(log.postures("ben"))
    skeleton, body = skeleton_of(log, "ben"), body_of(log, "ben").body
    entities = {e.id: e for _, update in told["/scene"] for e in update.entities}
    times = np.array(sorted(postures))
    for t, message in told["/tf"][30::60]:
        at = times[max(0, int(np.searchsorted(times, t, "right")) - 1)]
        pose = pose_joints(skeleton, postures[float(at)])
        frames = {k.child_frame_id: k for k in message.transforms}
        for limb in range(0, len(body), 7):
            joint = int(body.joint[limb])
            ball = entities[f"ben/{JOINTS[joint]}"].spheres
            assert any(np.allclose(point(s.pose.position), body.a[limb], atol=1e-6) for s in ball)
            there = pose.position[joint] + pose.rotation[joint] @ body.a[limb]
            k = frames[f"ben/{JOINTS[joint]}"]
            here = point(k.translation) + matrix_from_quaternion(np.array(quaternion(k.rotation))) @ body.a[limb]
            assert np.allclose(here, there, atol=1e-6)


def point(p: Any) -> F64:
    return np.array((p.x, p.y, p.z))


def test_a_head_is_above_feet_for_viewers_whose_z_is_up(told: dict[str, list[tuple[float, Any]]]) -> None:
    frames = {k.child_frame_id: k for k in told["/tf"][60][1].transforms}
    up = matrix_from_quaternion(np.array(quaternion(frames["room"].rotation)))
    head, foot = (up @ point(frames[f"ben/{joint}"].translation) for joint in ("head", "left_foot"))
    assert head[2] - foot[2] > 0.6


def test_what_happens_is_told_as_events(told: dict[str, list[tuple[float, Any]]]) -> None:
    events = [(e.name, e.message) for _, e in told["/events"]]
    assert any("holds baton" in text for _, text in events)
    assert any(text.startswith("refused") for who, text in events if who == "aiko")


def test_arrays_are_the_numbers_of_the_log(tmp_path: Path) -> None:
    path = tmp_path / "ben.npz"
    done = call(MEETING, "--npz", "ben", "--npz", "participant.ben.motion.left_wrist", "--from", "1", "--to", "3", "-o", path)
    assert done.exit_code == 0, done.output
    log = vistel.log.open(MEETING)
    postures = list(log.postures("ben", 1.0, 3.0))
    with np.load(path, allow_pickle=False) as arrays:
        assert arrays["ben.t"].tolist() == [t for t, _ in postures]
        assert np.array_equal(arrays["ben.dofs"], [p.dofs for _, p in postures])
        wrist = arrays["ben.position"][:, JOINT_INDEX["left_hand"]]
        assert np.allclose(wrist[:, 0], arrays["participant.ben.motion.left_wrist.x"])
        assert arrays["ben.joints"].tolist() == list(JOINTS)
    again = tmp_path / "again.npz"
    call(MEETING, "--npz", "ben", "--npz", "participant.ben.motion.left_wrist", "--from", "1", "--to", "3", "-o", again)
    assert again.read_bytes() == path.read_bytes()


def test_a_table_for_programs_that_read_parquet_is_that_of_csv_or_says_what_it_needs(tmp_path: Path) -> None:
    name, path = "participant.ben.motion.left_wrist", tmp_path / "wrist.parquet"
    done = call(MEETING, "--parquet", name, "-o", path)
    if importlib.util.find_spec("pyarrow") is None:
        assert done.exit_code == 2 and "pip install pyarrow" in done.stderr and not path.exists()
        return
    from pyarrow import parquet  # type: ignore[import-not-found]

    assert call(MEETING, "--csv", name, "-o", tmp_path / "wrist.csv").exit_code == 0
    with (tmp_path / "wrist.csv").open() as file:
        rows = list(csv.DictReader(file))
    table = parquet.read_table(path).to_pydict()
    assert list(table) == list(rows[0])
    for column, values in table.items():
        assert np.allclose(values[1:], [float(row[column]) for row in rows[1:]], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--npz", "bem", "-o", "x.npz"], "no participant is called 'bem'"),
        (["--npz", "thing.batn.x", "-o", "x.npz"], "did you mean baton?"),
        (["--npz", "ben", "--from", "100", "-o", "x.npz"], "no posture of ben"),
        (["--npz", "ben", "--foxglove", "-o", "x.npz"], "give one of them"),
        (["--foxglove", "--from", "100", "-o", "x.mcap"], "nobody"),
        *(([*way, "-o", MEETING, "--force"], "is the log itself") for way in (["--foxglove"], ["--rerun"], ["--npz", "ben"], [])),
    ],
)
def test_what_cannot_be_exported_gets_one_line_and_nothing_is_written(
    arguments: list[str | Path], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = MEETING.read_bytes()
    done = call(MEETING, *arguments)
    assert done.exit_code in (1, 2) and said in done.stderr, done.output
    assert "Traceback" not in done.output and MEETING.read_bytes() == before and not list(tmp_path.iterdir())


def test_without_rerun_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    done = call(MEETING, "--rerun", "-o", tmp_path / "viewed.rrd")
    assert done.exit_code == 2 and "pip install rerun-sdk" in done.output and not (tmp_path / "viewed.rrd").exists()


def test_reruns_own_program_finds_people_and_things_in_what_was_written_for_it(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="rerun is not installed")
    path = tmp_path / "viewed.rrd"
    done = call(MEETING, "--rerun", "-o", path)
    assert done.exit_code == 0, done.output
    read = [sys.executable, "-m", "rerun_cli", "rrd"]
    assert subprocess.run([*read, "verify", str(path)], stdin=subprocess.DEVNULL, check=False).returncode == 0
    shown = subprocess.run([*read, "print", str(path)], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True).stdout
    for entity in ("world/room/ben/left_hand/bones", "world/room/aiko/head/name", "world/room/thing/baton/piece-0", "events"):
        assert entity in shown
