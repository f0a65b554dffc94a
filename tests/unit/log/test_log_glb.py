"""A person of a log as a glTF file: its animation puts the joints where the postures had them, and the face with them."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vistel.log
from vistel.arrays import F64
from vistel.figure.face.arkit import SHAPES
from vistel.figure.face.marks import REST
from vistel.figure.face.rules import builtin_rules
from vistel.figure.formats.gltf import gltf_bytes
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINTS, Skeleton
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.log.bvh import frames, postures_of
from vistel.log.glb import movement_of, write_glb

MEETING = Path(__file__).parents[2] / "replay" / "meeting.mcap"
BEGIN, END, FPS = 0.2, 1.0, 20.0
TYPES = {5126: np.float32, 5121: np.uint8, 5123: np.uint16, 5125: np.uint32}
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Glb:
    """What another program reads of a file."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.tree: dict[str, Any] = json.loads(data[20 : 20 + length])
        self._binary = data[28 + length :]

    def accessor(self, number: int) -> F64:
        a = self.tree["accessors"][number]
        begin = self.tree["bufferViews"][a["bufferView"]]["byteOffset"]
        flat = np.frombuffer(self._binary, TYPES[a["componentType"]], a["count"] * WIDTH[a["type"]], begin)
        return flat.reshape(a["count"], -1).astype(np.float64)

    def channels(self) -> dict[tuple[int, str], tuple[F64, F64]]:
        """Times and values of each node and path that moves."""
        moving = self.tree["animations"][0]
        samplers = [(self.accessor(s["input"])[:, 0], self.accessor(s["output"])) for s in moving["samplers"]]
        return {(c["target"]["node"], c["target"]["path"]): samplers[c["sampler"]] for c in moving["channels"]}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Glb:
    path = tmp_path_factory.mktemp("glb") / "ben.glb"
    assert write_glb(vistel.log.open(MEETING), "ben", path, BEGIN, END, FPS) > 5
    return Glb(path)


def test_joints_of_the_animation_are_where_the_postures_have_them(written: Glb) -> None:
    nodes, channels = written.tree["nodes"], written.channels()
    skeleton = _skeleton(written)
    for n, posture in enumerate(frames(postures_of(vistel.log.open(MEETING), "ben", BEGIN, END), FPS)):
        wanted = pose_joints(skeleton, posture).position
        np.testing.assert_allclose(_placed(nodes, channels, n), wanted, atol=1e-4)


def test_times_are_those_of_the_postures_and_bounded_as_gltf_wants_it(written: Glb) -> None:
    sampler = written.tree["animations"][0]["samplers"][0]
    times = written.accessor(sampler["input"])[:, 0]
    first = postures_of(vistel.log.open(MEETING), "ben", BEGIN, END)[0][0]
    np.testing.assert_allclose(times, first - BEGIN + np.arange(len(times)) / FPS, atol=1e-6)
    told = written.tree["accessors"][sampler["input"]]
    assert (told["min"], told["max"]) == ([float(np.float32(times[0]))], [float(np.float32(times[-1]))])


def test_the_face_moves_with_the_shapes_that_the_figure_has(tmp_path: Path) -> None:
    smile = sum(u.pattern for u in builtin_rules().units if u.name.endswith("AU12"))
    posture = postures_of(vistel.log.open(MEETING), "ben", BEGIN, END)[0][1]
    smiling = [replace(posture, face=REST + share * smile) for share in np.linspace(0.0, 1.0, 20)]
    avatar = builtin_avatar("builtin", name="ben", height=1.8)
    (tmp_path / "x.glb").write_bytes(gltf_bytes(avatar, movement=movement_of(smiling, avatar.skeleton, 0.0, FPS)))
    glb = Glb(tmp_path / "x.glb")
    skin = next(n for n, node in enumerate(glb.tree["nodes"]) if node["name"] == "skin")
    names = glb.tree["meshes"][glb.tree["nodes"][skin]["mesh"]]["extras"]["targetNames"]
    times, values = glb.channels()[skin, "weights"]
    shares = values.reshape(len(times), len(names))
    for side in ("mouthSmileLeft", "mouthSmileRight"):
        shown = shares[:, names.index(side)]
        assert shown[0] == 0.0
        assert 0.5 < shown[-1] <= 1.0
        assert (np.diff(shown) >= 0.0).all()
    assert not np.delete(shares, [names.index(shape) for shape in SHAPES if shape in names], axis=1).any()


@pytest.mark.parametrize(
    ("who", "begin", "said"), [("bem", 0.0, "no participant is called 'bem'"), ("ben", 1e6, "no posture of ben in that time")]
)
def test_who_or_what_is_not_there_leaves_no_file(tmp_path: Path, who: str, begin: float, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        write_glb(vistel.log.open(MEETING), who, tmp_path / "x.glb", begin)
    assert not list(tmp_path.iterdir())


def _skeleton(glb: Glb) -> Skeleton:
    kept = glb.tree["extensions"]["VISTEL_avatar"]
    return Skeleton(np.array(kept["rest"]), np.array(kept["tip"]))


def _placed(nodes: list[dict[str, Any]], channels: dict[tuple[int, str], tuple[F64, F64]], n: int) -> F64:
    """Joints (J, 3) in the room at frame `n`."""
    place = np.zeros((len(JOINTS), 3))

    def walk(j: int, above: F64, origin: F64) -> None:
        moved = channels.get((j, "translation"))
        place[j] = origin + above @ (moved[1][n] if moved else np.array(nodes[j]["translation"]))
        turned = above @ matrix_from_quaternion(channels[j, "rotation"][1][n])
        for child in nodes[j].get("children", ()):
            walk(child, turned, place[j])

    walk(0, np.eye(3), np.zeros(3))
    return place
