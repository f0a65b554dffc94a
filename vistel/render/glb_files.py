"""Figures, things and the room as GLB files, known by the digest of their content, and kept on disk where it takes long to make."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vistel.conference.kept import make_room, read_kept, write_whole
from vistel.conference.model import Conference
from vistel.conference.rooms import interior_of
from vistel.figure.avatar.cache_folder import default_cache
from vistel.figure.formats.gltf import gltf_bytes
from vistel.figure.people.builtin import builtin_file
from vistel.figure.skeleton import Skeleton
from vistel.render.figures.people import files_of, load_avatar_of
from vistel.render.pressed_skin import PressedFigure
from vistel.render.room_gltf import room_glb
from vistel.render.stage.stage import ParticipantInfo
from vistel.render.things.soft import SoftThing, is_soft
from vistel.space.files.faults import RoomFileError
from vistel.space.files.gltf_write import glb_bytes
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.space.files.surfaces import SurfacePiece, pieces_of
from vistel.space.room import meeting_room
from vistel.space.things.things import Thing
from vistel.wire.parcels import digest_of

log = logging.getLogger("vistel.console")

VERSION = 1
"""Of how files are made; a change of it makes kept ones void."""
MOST_BYTES = 64 << 20
"""Of one file."""
MOST_KEPT = 256 << 20
"""Of all files in the cache folder."""


@dataclass(frozen=True, eq=False)
class Figure:
    """digest: of its file; skeleton: the joints that the file's are at rest."""

    digest: str
    skeleton: Skeleton


@dataclass(frozen=True, eq=False)
class ThingFile:
    """digest: of its file; soft: of a thing that is drawn deformed, whose corners are those of the file."""

    digest: str
    soft: SoftThing | None = None


class GlbFiles:
    """Makes files; each may take seconds. Figures may be made in one thread, things and the room in another. `bytes` has them by
    digest."""

    def __init__(self, conference: Conference, parcel: Callable[[str], bytes], models: Mapping[str, Polymesh]) -> None:
        """parcel: the bytes of an avatar of another site by digest; raises ValueError where they are not here. models: polymeshes
        of things that have arrived, by digest; more may come."""
        self._conference, self._parcel, self._files = conference, parcel, files_of(conference)
        self.bytes: dict[str, bytes] = {}
        self._interior: Interior | None = None
        self._models = models

    @property
    def models_here(self) -> frozenset[str]:
        """Digests of the polymeshes that this machine's files hold."""
        return frozenset(self._interior.models) if self._interior is not None else frozenset()

    def figure(self, about: ParticipantInfo) -> Figure:
        """Somebody's figure. Raises ValueError or OSError where it cannot be made."""
        avatar = load_avatar_of(about, self._files, self._parcel)
        key = about.parcel
        if about.avatar.startswith("builtin"):
            key = builtin_file(about.avatar, name=about.name, height=about.height).stem
        made = self._kept(f"{key} {about.height:.4f}", lambda: gltf_bytes(avatar)) if key else self._keep(gltf_bytes(avatar))
        return Figure(made, avatar.skeleton)

    def pressed(self, about: ParticipantInfo) -> PressedFigure:
        """Somebody's figure, to know where their skin gives way. Raises as `figure`."""
        return PressedFigure(load_avatar_of(about, self._files, self._parcel))

    def thing(self, thing: Thing) -> ThingFile:
        """A thing's file, with the thing at its origin."""
        here = replace(thing, position=np.zeros(3), rotation=np.array((0.0, 0.0, 0.0, 1.0)))
        interior = self._inside()
        models = {**interior.models, **self._models}
        soft = SoftThing(thing, models) if is_soft(thing) and not thing.hidden else None
        room = replace(interior.room, things=(here,), seats=())

        def pieces(thing: Thing, models: Mapping[str, Polymesh]) -> Sequence[SurfacePiece]:
            return soft.skin.pieces if soft is not None else pieces_of(thing, models)

        return ThingFile(self._keep(glb_bytes(replace(interior, room=room, models=models), pieces)), soft)

    def room(self) -> ThingFile:
        """The file of what does not move."""
        room = self._inside().room
        if room.source:
            return ThingFile(self._keep(room_glb(room)))
        return ThingFile(self._kept(f"room {len(room.seats)}", lambda: room_glb(room)))

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
        name = hashlib.sha256(f"{VERSION} {key}".encode()).hexdigest()[:24]
        path: Path = default_cache() / f"console-{name}.glb"
        data = read_kept(path, MOST_BYTES)
        if data is None or data[:4] != b"glTF" or int.from_bytes(data[8:12], "little") != len(data):
            data = make()
            try:
                write_whole(path, data)
                make_room(path.parent, "console-*.glb", MOST_KEPT)
            except OSError as fault:
                log.warning("event=asset_not_kept path=%s reason=%r", path, fault.strerror or str(fault))
        return self._keep(data)

    def _keep(self, data: bytes) -> str:
        digest = digest_of(data)
        self.bytes[digest] = data
        return digest
