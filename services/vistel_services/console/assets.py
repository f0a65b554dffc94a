"""Figures, things and the room as GLB files, made once and known by the digest of their content."""

from __future__ import annotations

import asyncio
import hashlib
import logging
from collections.abc import Callable, Container, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from vistel.conference.kept import make_room, read_kept, write_whole
from vistel.conference.model import Conference
from vistel.conference.rooms import interior_of
from vistel.figure.avatar.cache_folder import default_cache
from vistel.figure.formats.gltf import gltf_bytes
from vistel.figure.people.builtin import builtin_file
from vistel.figure.skeleton import Skeleton
from vistel.render.figures.people import files_of, load_avatar_of
from vistel.render.room_gltf import room_glb
from vistel.render.stage.stage import ParticipantInfo
from vistel.space.files.faults import RoomFileError
from vistel.space.files.gltf_write import glb_bytes
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.space.room import meeting_room
from vistel.space.things.things import Thing
from vistel.wire import background
from vistel.wire.parcels import digest_of

log = logging.getLogger("vistel.console")
T = TypeVar("T")

_ROOM = "room"
_VERSION = 1
"""Of how files are made; a change of it makes kept ones void."""
_MOST_BYTES = 64 << 20
"""Of one file."""
_MOST_KEPT = 256 << 20
"""Of all files in the cache folder."""


@dataclass(frozen=True, eq=False)
class Figure:
    """digest: of its file; skeleton: the joints that the file's are at rest."""

    digest: str
    skeleton: Skeleton


class Assets:
    """Lives on the event loop; files are made one after the other in a thread. `changed` is called when one is there."""

    def __init__(
        self, conference: Conference, parcel: Callable[[str], bytes], models: Mapping[str, Polymesh], changed: Callable[[], None]
    ) -> None:
        """parcel: the bytes of an avatar of another site by digest; raises ValueError where they are not here. models: polymeshes
        of things that have arrived, by digest; more may come."""
        self._conference, self._parcel, self._files = conference, parcel, files_of(conference)
        self._bytes: dict[str, bytes] = {}
        self._interior: Interior | None = None
        self._models = models
        self._maker = ThreadPoolExecutor(1, thread_name_prefix="assets")
        self._figures = _Made[Figure](self._maker, changed)
        self._others = _Made[str](self._maker, changed)

    def figure(self, about: ParticipantInfo) -> Figure | None:
        """Somebody's figure; None while it is being made, and where there is none."""
        if not about.here:
            return None
        key = f"{about.avatar} {about.name} {about.height:.4f} {about.parcel}"
        return self._figures.get(key, lambda: self._figure(about))

    def thing(self, thing: Thing) -> str | None:
        """The digest of a thing's file; None as above, and while a polymesh of it is on its way."""
        looks = {k.model for k in thing.looks}
        if looks - self._models.keys() - self.models_here:
            return None
        return self._others.get(thing, lambda: self._thing(thing))

    @property
    def models_here(self) -> frozenset[str]:
        """Digests of the polymeshes that this machine's files hold."""
        return frozenset(self._interior.models) if self._interior is not None else frozenset()

    def forget_but(self, things: Mapping[str, Thing]) -> None:
        """Keep files of these things only, beside the room's and figures'."""
        gone = self._others.forget_but({*things.values(), _ROOM})
        for digest in gone:
            self._bytes.pop(digest, None)

    def room(self) -> str | None:
        """The digest of the file of what does not move; None as above."""
        return self._others.get(_ROOM, self._room)

    def file(self, digest: str) -> bytes | None:
        """A file's bytes."""
        return self._bytes.get(digest)

    def close(self) -> None:
        """Make no more."""
        self._maker.shutdown(wait=False, cancel_futures=True)

    def _figure(self, about: ParticipantInfo) -> Figure:
        avatar = load_avatar_of(about, self._files, self._parcel)
        key = about.parcel
        if about.avatar.startswith("builtin"):
            key = builtin_file(about.avatar, name=about.name, height=about.height).stem
        made = self._kept(f"{key} {about.height:.4f}", lambda: gltf_bytes(avatar)) if key else self._keep(gltf_bytes(avatar))
        return Figure(made, avatar.skeleton)

    def _thing(self, thing: Thing) -> str:
        here = replace(thing, position=np.zeros(3), rotation=np.array((0.0, 0.0, 0.0, 1.0)))
        interior = self._inside()
        room = replace(interior.room, things=(here,), seats=())
        return self._keep(glb_bytes(replace(interior, room=room, models={**interior.models, **self._models})))

    def _room(self) -> str:
        room = self._inside().room
        return self._kept(f"room {len(room.seats)}", lambda: room_glb(room)) if not room.source else self._keep(room_glb(room))

    def _inside(self) -> Interior:
        """The room with the polymeshes that this machine's files hold; the built-in one where they cannot be used."""
        if self._interior is None:
            keys = self._conference.room
            try:
                self._interior = interior_of(keys)
            except RoomFileError as fault:
                log.error("event=room_file_not_used reason=%r shown=built-in", str(fault))
                self._interior = Interior(meeting_room(keys.seats))
        return self._interior

    def _kept(self, key: str, make: Callable[[], bytes]) -> str:
        """The digest of a file that the cache folder keeps."""
        name = hashlib.sha256(f"{_VERSION} {key}".encode()).hexdigest()[:24]
        path: Path = default_cache() / f"console-{name}.glb"
        data = read_kept(path, _MOST_BYTES)
        if data is None or data[:4] != b"glTF" or int.from_bytes(data[8:12], "little") != len(data):
            data = make()
            try:
                write_whole(path, data)
                make_room(path.parent, "console-*.glb", _MOST_KEPT)
            except OSError as fault:
                log.warning("event=asset_not_kept path=%s reason=%r", path, fault.strerror or str(fault))
        return self._keep(data)

    def _keep(self, data: bytes) -> str:
        digest = digest_of(data)
        self._bytes[digest] = data
        return digest


class _Made(Generic[T]):
    """What is made in a thread, by key. What cannot be made is logged once and stays None."""

    def __init__(self, maker: ThreadPoolExecutor, changed: Callable[[], None]) -> None:
        self._maker, self._changed = maker, changed
        self._made: dict[Hashable, T | None] = {}

    def forget_but(self, keys: Container[Hashable]) -> list[T]:
        """What was made for other keys."""
        gone = [key for key in self._made if key not in keys]
        return [made for key in gone if (made := self._made.pop(key)) is not None]

    def get(self, key: Hashable, make: Callable[[], T]) -> T | None:
        if key not in self._made:
            self._made[key] = None
            background.start(self._make(key, make), "asset")
        return self._made[key]

    async def _make(self, key: Hashable, make: Callable[[], T]) -> None:
        try:
            made = await asyncio.get_running_loop().run_in_executor(self._maker, make)
        except (ValueError, OSError) as fault:
            log.error("event=asset_not_made what=%s reason=%r", getattr(key, "id", key), str(fault))
            return
        if key in self._made:
            self._made[key] = made
        self._changed()
