"""Registration of a photographed texture on an avatar: the unregistered islands, and registrations from pins."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.figure.avatar.avatar import Avatar, Registration
from vistel.figure.avatar.texture import island_of, islands, registered, unregistered, with_picture
from vistel.figure.making.pictures import decode
from vistel.figure.making.source import MakingError
from vistel_cli.studio.requests import RequestError

MOST_ISLANDS = 40
"""Most islands that are offered, largest first."""


class PictureError(RequestError):
    """A photograph or a registration that cannot be used; one line."""


def plain(avatar: Avatar) -> Avatar:
    """The avatar with its texture at the mesh's own coordinates."""
    for each in avatar.registration:
        avatar = unregistered(avatar, each.island)
    return avatar


def laid_out(avatar: Avatar) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Islands, registrations and the size of the texture; uv (R, 2) of the drawn vertices of skin and eyes without
    registrations, and island (R,) of each."""
    bare = plain(avatar)
    found = islands(bare)[:MOST_ISLANDS]
    head = {
        "islands": [{"number": i.number, "part": i.part, "box": i.box} for i in found],
        "texture": texture_of(avatar),
        "size": [avatar.albedo.shape[1], avatar.albedo.shape[0]],
    }
    uv = np.concatenate([mesh.uv for mesh in (bare.mesh, *bare.eyeballs)]).astype(np.float32)
    return head, {"uv": uv, "island": np.concatenate(island_of(bare)).astype(np.uint32)}


def texture_of(avatar: Avatar) -> list[dict[str, Any]]:
    """An avatar's registrations as the page holds them."""
    return [{"island": r.island, "move": list(r.move), "turn": r.turn, "scale": r.scale} for r in avatar.registration]


def lying(avatar: Avatar, texture: Sequence[Any]) -> Avatar:
    """The avatar with its texture registered as on the page. Raises PictureError."""
    out = plain(avatar)
    for said in texture:
        try:
            (u, v), island = said["move"], int(said["island"])
            out = registered(out, Registration(island, (float(u), float(v)), float(said["turn"]), float(said["scale"])))
        except (KeyError, TypeError, ValueError) as fault:
            raise PictureError(f"pins: {fault}") from fault
    return out


def photographed(avatar: Avatar, island: int, data: bytes) -> tuple[Avatar, list[str]]:
    """The avatar with a photograph that covers an island at first, and notes on the picture. Raises PictureError."""
    notes: list[str] = []
    try:
        return with_picture(avatar, island, decode(data, notes=notes, name="photograph")), notes
    except MakingError as fault:
        raise PictureError(f"photograph: {fault}") from fault
    except ValueError as fault:
        raise PictureError(str(fault)) from fault
