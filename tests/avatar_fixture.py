"""What tests of avatars share: a person of one closed mesh, a small one of its own proportions, whose arms are long; and whether
two are the same."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from vistel.figure.avatar.avatar import Avatar, Mesh, scaled
from vistel.figure.body import Body
from vistel.figure.formats.avatar_file import load_avatar
from vistel.figure.skeleton import JOINT_INDEX, Skeleton

LONGER = 1.18
"""Arms beyond the shoulder joint."""
THICKER = 1.25


@lru_cache(maxsize=4)
def closed_person(height: float = 1.70) -> Avatar:
    """As files hold people: one closed mesh with clothes and a mouth, eyeballs, one texture, three levels of detail; no weights,
    no expressions. She was sculpted by an early version of VISTEL, 1.70 m tall. height in metres."""
    return scaled(load_avatar(Path(__file__).parent / "data" / "closed_person.npz"), height)


@lru_cache(maxsize=1)
def long_armed() -> Avatar:
    """1.75 m tall, one level of detail, hands and forearms thicker than average."""
    whole = closed_person(1.75)
    small = whole.coarser[-1]
    at = float(small.skeleton.rest[JOINT_INDEX["left_upper_arm"], 0])

    def stretched(p: np.ndarray) -> np.ndarray:
        out = np.array(p)
        x = np.abs(out[:, 0])
        out[:, 0] = np.sign(out[:, 0]) * np.where(x > at, at + LONGER * (x - at), x)
        return out

    rest = stretched(small.skeleton.rest)
    b = small.body
    old = small.skeleton.rest[b.joint]
    arm = np.array([any(w in n for w in ("forearm", "palm", "knuckles")) for n in b.names])
    thick = np.where(arm, THICKER, 1.0)
    body = Body(
        b.names,
        b.joint,
        stretched(old + b.a) - rest[b.joint],
        stretched(old + b.b) - rest[b.joint],
        b.radius_a * thick,
        b.radius_b * thick,
    )
    tip = stretched(small.skeleton.rest + small.skeleton.tip) - rest

    def grown(mesh: Mesh) -> Mesh:
        return replace(mesh, vertices=stretched(mesh.vertices).astype(np.float32), bone=None, weight=None)

    return replace(
        small,
        name="long",
        skeleton=Skeleton(rest, tip),
        body=body,
        mesh=grown(small.mesh),
        eyeballs=tuple(small.eyeballs),
        albedo=np.ascontiguousarray(whole.albedo[::16, ::16]),
        coarser=(),
    )


def same(one: Any, other: Any) -> None:
    """Asserts that two values, with all they are made of, are the same to the last bit."""
    if isinstance(one, np.ndarray):
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    elif isinstance(one, tuple):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            same(a, b)
    elif hasattr(one, "__dataclass_fields__"):
        for f in fields(one):
            same(getattr(one, f.name), getattr(other, f.name))
    else:
        assert one == other
