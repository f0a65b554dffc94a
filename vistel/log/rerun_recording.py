"""A log for Rerun's viewer: people, things and what happens, as a recording (.rrd).

Rerun does not show Foxglove's scenes, so what `vistel.log.foxglove` says is told in Rerun's words. Paths are frames:
`world/room/ben/left_hand`, `world/room/thing/baton`; `events` are lines. The timeline `log` is seconds after the log's beginning.

Needs `pip install rerun-sdk` (Apache-2.0 or MIT), which is no part of VISTEL's installation.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vistel.log.foxglove import FPS, ROOM, WORLD, messages_of

if TYPE_CHECKING:
    from vistel.log import Log

TIMELINE = "log"
EVENTS = "events"


def write_rerun(log: Log, path: Path, begin: float = 0.0, end: float | None = None, fps: float = FPS) -> int:
    """Write what is between `begin` and `end` [s] of a log, `fps` transforms a second. Returns how many paths move. Raises OSError;
    ValueError, one line, where Rerun is not installed, and where there is nobody and nothing."""
    try:
        rr: Any = import_module("rerun")
    except ImportError as e:
        raise ValueError("--rerun: needs Rerun: pip install rerun-sdk; or take --foxglove") from e
    messages = messages_of(log, begin, end, fps)
    path.touch()  # Rerun says nothing where it cannot write
    recording = rr.RecordingStream("vistel", recording_id=log.path.stem)
    recording.save(path)
    recording.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    poses: defaultdict[str, list[tuple[float, Any]]] = defaultdict(list)
    for t, topic, message in messages:
        recording.set_time(TIMELINE, duration=t)
        if topic == "/tf":
            for transform in message.transforms:
                poses[_path(transform.child_frame_id)].append((t, transform))
        elif topic == "/scene":
            for gone in message.deletions:
                recording.log(_path(gone.id), rr.Clear(recursive=True))
            for entity in message.entities:
                for part, shape in _shapes(rr, entity):
                    recording.log(f"{_path(entity.frame_id)}/{part}", shape)
        else:
            recording.log(EVENTS, rr.TextLog(f"{message.name}: {message.message}", level="INFO"))
    for place, timed in poses.items():
        recording.send_columns(
            place,
            indexes=[rr.TimeColumn(TIMELINE, duration=[t for t, _ in timed])],
            columns=rr.Transform3D.columns(
                translation=[[f.translation.x, f.translation.y, f.translation.z] for _, f in timed],
                quaternion=[[f.rotation.x, f.rotation.y, f.rotation.z, f.rotation.w] for _, f in timed],
            ),
        )
    recording.flush()
    recording.disconnect()
    return len(poses)


def _path(frame: str) -> str:
    return f"{WORLD}/{ROOM}" if frame == ROOM else f"{WORLD}/{ROOM}/{frame}"


def _shapes(rr: Any, entity: Any) -> Iterator[tuple[str, Any]]:
    """What is drawn of an entity, each with the name of its part."""
    if entity.spheres:
        sizes = [0.5 * ball.size.x for ball in entity.spheres]
        yield (
            "joints",
            rr.Ellipsoids3D(
                centers=[_xyz(ball.pose.position) for ball in entity.spheres],
                half_sizes=[[r, r, r] for r in sizes],
                colors=[_rgb(ball.color) for ball in entity.spheres],
                fill_mode=rr.components.FillMode.Solid,
            ),
        )
    if entity.cylinders:
        yield (
            "bones",
            rr.Cylinders3D(  # which do not taper: as wide as the cone is in its middle
                centers=[_xyz(c.pose.position) for c in entity.cylinders],
                quaternions=[[*_xyz(c.pose.orientation), c.pose.orientation.w] for c in entity.cylinders],
                lengths=[c.size.z for c in entity.cylinders],
                radii=[0.25 * c.size.x * (c.bottom_scale + c.top_scale) for c in entity.cylinders],
                colors=[_rgb(c.color) for c in entity.cylinders],
                fill_mode=rr.components.FillMode.Solid,
            ),
        )
    for number, mesh in enumerate(entity.triangles):
        yield (
            f"piece-{number}",
            rr.Mesh3D(
                vertex_positions=[_xyz(p) for p in mesh.points],
                triangle_indices=np.array(mesh.indices, np.uint32).reshape(-1, 3),
                albedo_factor=_rgb(mesh.color),
            ),
        )
    for sign in entity.texts:
        yield "name", rr.Points3D([_xyz(sign.pose.position)], radii=[0.0], labels=[sign.text])


def _xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


def _rgb(colour: Any) -> list[int]:
    return [round(255 * c) for c in (colour.r, colour.g, colour.b)]
