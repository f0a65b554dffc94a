"""Figures, things and the room as GLB files, made once and known by the digest of their content."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor

from vistel.conference.model import Conference
from vistel.render.glb_files import Figure, GlbFiles, ThingFile
from vistel.render.pressed_skin import PressedFigure
from vistel.render.stage.stage import ParticipantInfo
from vistel.session.made_in_thread import MadeInThread
from vistel.space.files.model import Polymesh
from vistel.space.things.things import Thing

_ROOM = "room"


class Assets:
    """Lives on the event loop; files are made in two threads, so that no thing waits for a figure, which takes seconds. `changed`
    is called when one is there."""

    def __init__(
        self, conference: Conference, parcel: Callable[[str], bytes], models: Mapping[str, Polymesh], changed: Callable[[], None]
    ) -> None:
        """parcel, models: as of `GlbFiles`."""
        self._files, self._models = GlbFiles(conference, parcel, models), models
        self._makers = [ThreadPoolExecutor(1, thread_name_prefix=name) for name in ("figures", "things")]
        self._figures = MadeInThread[Figure](self._makers[0], changed)
        self._others = MadeInThread[ThingFile](self._makers[1], changed)
        self._pressed = MadeInThread[PressedFigure](self._makers[0], lambda: None)

    def figure(self, about: ParticipantInfo) -> Figure | None:
        """Somebody's figure; None while it is being made, and where there is none."""
        if not about.here:
            return None
        return self._figures.get(_key(about), lambda: self._files.figure(about))

    def pressed(self, about: ParticipantInfo) -> PressedFigure | None:
        """Somebody's figure, to know where their skin gives way; None as above."""
        return self._pressed.get(_key(about), lambda: self._files.pressed(about)) if about.here else None

    def thing(self, thing: Thing) -> ThingFile | None:
        """A thing's file; None as above, and while a polymesh of it is on its way."""
        if {k.model for k in thing.looks} - self._models.keys() - self.models_here:
            return None
        return self._others.get(thing, lambda: self._files.thing(thing))

    @property
    def models_here(self) -> frozenset[str]:
        """Digests of the polymeshes that this machine's files hold."""
        return self._files.models_here

    def forget_but(self, people: Iterable[ParticipantInfo], things: Mapping[str, Thing]) -> None:
        """Keep files of these things only, beside the room's and figures', and what presses on these people."""
        self._pressed.forget_but({_key(about) for about in people})
        gone = self._others.forget_but({*things.values(), _ROOM})
        for file in gone:
            self._files.bytes.pop(file.digest, None)

    def room(self) -> ThingFile | None:
        """The file of what does not move; None as above."""
        return self._others.get(_ROOM, self._files.room)

    def file(self, digest: str) -> bytes | None:
        """A file's bytes."""
        return self._files.bytes.get(digest)

    def close(self) -> None:
        """Make no more."""
        for maker in self._makers:
            maker.shutdown(wait=False, cancel_futures=True)


def _key(about: ParticipantInfo) -> str:
    return f"{about.avatar} {about.name} {about.height:.4f} {about.parcel}"
