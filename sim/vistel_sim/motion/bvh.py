"""Reads Biovision hierarchy (BVH) files: forward kinematics, and the joints of a `Recording` by their usual names."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel_sim.motion.recording import INDEX, RECORDED, SIDES, Recording
from vistel_sim.motion.source import MotionError

_AXES = {"X": 0, "Y": 1, "Z": 2}
MOST_FRAMES = 200_000
"""A longer file is refused: half an hour at 120 Hz."""
MOST_JOINTS = 1_000
"""A file with more joints is refused; a body has about 60."""

# Names of one joint in the dialects seen: CMU's own (ASF), the 3ds Max friendly conversion, MotionBuilder's.
_NAMES: dict[str, tuple[str, ...]] = {
    "hips": ("hip", "Hips", "hips", "Hip", "pelvis", "Pelvis", "root"),
    "chest": ("thorax", "Chest2", "Spine1", "Spine2", "Chest", "chest", "spine2"),
    "neck": ("lowerneck", "Neck", "neck"),
    "head": ("head", "Head"),
} | {
    f"{side}_{part}": tuple(name.format(s=short, S=side.capitalize()) for name in names)
    for side, short in (("left", "l"), ("right", "r"))
    for part, names in (
        ("shoulder", ("{s}clavicle", "{S}Collar", "{S}Shoulder")),
        ("upper_arm", ("{s}humerus", "{S}Arm", "{S}Shoulder", "{S}UpArm")),
        ("lower_arm", ("{s}radius", "{S}ForeArm", "{S}Elbow", "{S}LowArm")),
        ("hand", ("{s}hand", "{S}Hand", "{S}Wrist")),
    )
}
# Metres per unit, by how tall the figure is in units: metres, CMU's unit, centimetres, millimetres.
_UNITS = ((0.8, 3.0, 1.0), (15.0, 45.0, 0.0254 / 0.45), (80.0, 300.0, 0.01), (800.0, 3000.0, 0.001))


@dataclass(frozen=True)
class Bvh:
    """names, parents (-1 for the root), offsets (J, 3); channels of each joint; frames (n, channels); frame_s."""

    names: list[str]
    parents: list[int]
    offsets: F64
    channels: list[list[str]]
    frames: F64
    frame_s: float

    def pose(self) -> tuple[F64, F64]:
        """Forward kinematics: positions (n, J, 3) in file units, rotations (n, J, 3, 3)."""
        n, joints = len(self.frames), len(self.names)
        position, rotation = np.empty((n, joints, 3)), np.empty((n, joints, 3, 3))
        column = 0
        for j, names in enumerate(self.channels):
            local = np.tile(np.eye(3), (n, 1, 1))
            shift = np.tile(self.offsets[j], (n, 1))
            for name in names:
                values = self.frames[:, column]
                column += 1
                if name.endswith("position"):
                    # Channel positions replace the offset.
                    shift[:, _AXES[name[0]]] = values
                else:
                    local = local @ _rotations(_AXES[name[0]], np.radians(values))
            parent = self.parents[j]
            if parent < 0:
                rotation[:, j], position[:, j] = local, shift
            else:
                rotation[:, j] = rotation[:, parent] @ local
                position[:, j] = position[:, parent] + np.einsum("nij,nj->ni", rotation[:, parent], shift)
        return position, rotation


def load_bvh(path: Path) -> Recording:
    """Read a file and pick out what is needed. Raises MotionError with one line when it cannot be used."""
    bvh = parse_bvh(path)
    at = {name: _find(bvh, name, path) for name in RECORDED if not name.endswith("_shoulder")}
    for side in SIDES:
        # Dialects that call the upper arm "LeftShoulder" have a collar of another name, or none.
        arm = at[f"{side}_upper_arm"]
        at[f"{side}_shoulder"] = bvh.parents[arm] if bvh.parents[arm] >= 0 else arm
    position, rotation = bvh.pose()
    unit = _unit(position, bvh, path)
    picked = [at[name] for name in RECORDED]
    p, r = position[:, picked] * unit, rotation[:, picked].copy()
    rest = _rest(bvh)
    for name in RECORDED:
        if name.endswith(("upper_arm", "lower_arm", "hand")):
            along = {"upper_arm": "lower_arm", "lower_arm": "hand", "hand": "hand"}[name.split("_", 1)[1]]
            child = at[f"{name.split('_')[0]}_{along}"]
            # The hand's own rest direction is the forearm's.
            start = at[f"{name.split('_')[0]}_lower_arm"] if name.endswith("hand") else at[name]
            side = 1.0 if name.startswith("left") else -1.0
            turn = _shortest(np.array([side, 0.0, 0.0]), rest[child] - rest[start])
            r[:, INDEX[name]] = r[:, INDEX[name]] @ turn
    collars = p[:, [INDEX["left_shoulder"], INDEX["right_shoulder"]]]
    p[:, INDEX["chest"]] = collars.mean(axis=1)
    floor = float(position[..., 1].min()) * unit
    p[..., 1] -= floor
    return Recording(path.name, 1.0 / bvh.frame_s, p, r)


def parse_bvh(path: Path) -> Bvh:
    """Read a BVH file. Raises MotionError with one line: file, line, what was expected."""
    try:
        lines = path.read_text("utf-8", errors="strict").splitlines()
    except (OSError, UnicodeDecodeError) as e:
        raise MotionError(f"{path}: cannot be read as text: {e}") from e
    return _Parser(path, lines).read()


class _Parser:
    def __init__(self, path: Path, lines: list[str]) -> None:
        self._path = path
        self._lines = [(k, words) for k, line in enumerate(lines, start=1) if (words := line.split())]
        self._at = 0

    def read(self) -> Bvh:
        names: list[str] = []
        parents: list[int] = []
        offsets: list[list[float]] = []
        channels: list[list[str]] = []
        self._expect("HIERARCHY")
        stack: list[int] = []
        while True:
            k, words = self._next()
            match words[0].upper():
                case "ROOT" | "JOINT" if len(words) >= 2 and (words[0].upper() == "ROOT") == (not names):
                    self._expect("{")
                    parents.append(stack[-1] if stack else -1)
                    names.append(words[1].split(":")[-1])
                    offsets.append(self._numbers("OFFSET", 3))
                    channels.append(self._channels())
                    stack.append(len(names) - 1)
                    if len(names) > MOST_JOINTS:
                        self._fail(k, f"more than {MOST_JOINTS} joints")
                case "END":
                    self._expect("{")
                    self._numbers("OFFSET", 3)
                    self._expect("}")
                case "}" if stack:
                    stack.pop()
                case "MOTION" if names and not stack:
                    break
                case _:
                    self._fail(k, f"expected ROOT, JOINT, End Site or a closing brace, got {' '.join(words)[:40]!r}")
        frames, frame_s = self._motion(sum(len(c) for c in channels))
        return Bvh(names, parents, np.array(offsets), channels, frames, frame_s)

    def _motion(self, width: int) -> tuple[F64, float]:
        k, words = self._next()
        if words[0] != "Frames:" or len(words) != 2 or not words[1].isdigit():
            self._fail(k, "expected 'Frames: N'")
        count = int(words[1])
        if not 2 <= count <= MOST_FRAMES:
            self._fail(k, f"expected 2 to {MOST_FRAMES} frames, got {count}")
        k, words = self._next()
        frame_s = self._float(k, words[-1])
        if words[:2] != ["Frame", "Time:"] or not 0.0005 <= frame_s <= 1.0:
            self._fail(k, "expected 'Frame Time: SECONDS' between 0.0005 and 1")
        frames = np.empty((count, width))
        for i in range(count):
            if self._at >= len(self._lines):
                raise MotionError(f"{self._path}: ends after frame {i} of {count}")
            k, words = self._next()
            if len(words) != width:
                self._fail(k, f"expected {width} numbers, got {len(words)}")
            frames[i] = [self._float(k, w) for w in words]
        return frames, frame_s

    def _channels(self) -> list[str]:
        k, words = self._next()
        names = words[2:]
        good = len(words) >= 2 and words[0] == "CHANNELS" and words[1] == str(len(names))
        if not good or not all(n[:1] in _AXES and n[1:] in ("position", "rotation") for n in names):
            self._fail(k, "expected 'CHANNELS N' and the names of N channels")
        return names

    def _numbers(self, word: str, count: int) -> list[float]:
        k, words = self._next()
        if words[0] != word or len(words) != count + 1:
            self._fail(k, f"expected {word} and {count} numbers")
        return [self._float(k, w) for w in words[1:]]

    def _float(self, k: int, word: str) -> float:
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not abs(value) < 1e7:
            self._fail(k, f"expected a number, got {word[:20]!r}")
        return value

    def _expect(self, word: str) -> None:
        k, words = self._next()
        if words[0].upper() != word:
            self._fail(k, f"expected {word}, got {words[0][:20]!r}")

    def _next(self) -> tuple[int, list[str]]:
        if self._at >= len(self._lines):
            raise MotionError(f"{self._path}: ends too early; is the file whole?")
        self._at += 1
        return self._lines[self._at - 1]

    def _fail(self, k: int, what: str) -> None:
        raise MotionError(f"{self._path}: line {k}: {what}")


def _find(bvh: Bvh, joint: str, path: Path) -> int:
    for name in _NAMES[joint]:
        if name in bvh.names:
            return bvh.names.index(name)
    raise MotionError(f"{path}: no joint for {joint.replace('_', ' ')}; expected one of {', '.join(_NAMES[joint])}")


def _rest(bvh: Bvh) -> F64:
    rest = np.zeros((len(bvh.names), 3))
    for j, parent in enumerate(bvh.parents):
        if parent >= 0:
            rest[j] = rest[parent] + bvh.offsets[j]
    return rest


def _unit(position: F64, bvh: Bvh, path: Path) -> float:
    rest = _rest(bvh)
    tall = float(np.ptp(rest[:, 1]))
    for low, high, metres in _UNITS:
        if low <= tall <= high:
            return metres
    units = "metres, centimetres, millimetres or CMU units"
    raise MotionError(f"{path}: the figure is {tall:.3g} units tall; expected {units}")


def _rotations(axis: int, angle: F64) -> F64:
    """(n, 3, 3) about one axis."""
    out = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[:, axis, axis] = 1.0
    out[:, i, i] = out[:, j, j] = np.cos(angle)
    out[:, i, j], out[:, j, i] = -np.sin(angle), np.sin(angle)
    return out


def _shortest(a: F64, b: F64) -> F64:
    """(3, 3) the smallest rotation that takes direction `a` to `b`."""
    u, v = a / np.linalg.norm(a), b / np.linalg.norm(b)
    axis, c = np.cross(u, v), float(u @ v)
    if c < -0.999999:
        return np.diag([-1.0, 1.0, -1.0])
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + k + k @ k / (1.0 + c)
