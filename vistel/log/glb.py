"""A person of a log as glTF 2.0 (.glb) that moves: skin, joints and face, for programs that show or animate figures.

Skin that gives way where people touch is not in it, as in USD.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vistel.conference.avatar_files import kept_parcel
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.arkit import SHAPES, coefficients
from vistel.figure.face.countenance import Countenance
from vistel.figure.formats.gltf import gltf_bytes
from vistel.figure.formats.gltf_animation import Movement
from vistel.figure.posture.posture import Posture, local_joints, pose_joints
from vistel.figure.skeleton import Skeleton
from vistel.log.bvh import frames, postures_of
from vistel.render.figures.people import load_avatar_of
from vistel.render.stage.stage import ParticipantInfo, described
from vistel.whole_file import whole_file
from vistel.wire.parcels import Parcels

if TYPE_CHECKING:
    from vistel.log import Log


def write_glb(log: Log, participant: str, path: Path, begin: float = 0.0, end: float | None = None, fps: float = 30.0) -> int:
    """Write what a participant did from `begin`, which is the animation's second 0, to `end` [s], `fps` frames a second between
    their postures. Returns how many frames.

    Raises OSError; ValueError, one line, for an unknown participant, where there is no posture, and for an avatar that the log
    does not hold.
    """
    log.check_participant(participant)
    timed = postures_of(log, participant, begin, end)
    moved = list(frames(timed, fps))
    avatar = _avatar(log, participant)
    movement = movement_of(moved, avatar.skeleton, timed[0][0] - begin, fps)
    with whole_file(path) as stream:
        stream.write(gltf_bytes(avatar, movement=movement))
    return len(moved)


def movement_of(postures: list[Posture], skeleton: Skeleton, begin: float, fps: float) -> Movement:
    """How a figure with this skeleton moves through postures, `fps` a second from `begin` [s] on."""
    local = [local_joints(pose_joints(skeleton, posture)) for posture in postures]
    face = Countenance()
    shown = [coefficients(face.step(posture, round(n * 1e9 / fps)).expression) for n, posture in enumerate(postures)]
    return Movement(
        begin + np.arange(len(postures)) / fps,
        np.array([position for position, _ in local]),
        np.array([quaternion for _, quaternion in local]),
        dict(zip(SHAPES, np.array(shown).T, strict=True)),
    )


def _avatar(log: Log, participant: str) -> Avatar:
    about = ParticipantInfo(participant, participant)
    for record in log.messages("participant", participant=participant):
        if not record.message.left:
            about = described(record.message)

    def parcel(digest: str) -> bytes:
        if (kept := kept_parcel(digest)) is not None:
            return kept
        parcels = Parcels()
        for part in log.records("avatar_part", digest=digest):
            if (whole := parcels.take(part.names["site"], digest, part.names["part"], part.message)) is not None:
                return whole
        raise ValueError(f"{log.path}: the avatar of {participant} is not in the log")

    return load_avatar_of(about, parcel=parcel)
