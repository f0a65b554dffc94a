"""Draws a log picture by picture, however long each takes, with the stage and the renderer of live pictures and the log's time.

What is drawn depends on the log, the view and the rate alone, so that the same film comes out on every machine with the same
OpenGL.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from vistel.arrays import U8
from vistel.conference.avatar_files import kept_parcel
from vistel.render.config import RenderConfig
from vistel.render.figures.people import load_figure
from vistel.render.film.pages import RecordedPages
from vistel.render.film.sound import FilmSound
from vistel.render.preparation import decor_of
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.stage import Instant, Stage, looks_before
from vistel.space.files.interior import Interior
from vistel.wire.log import LogReader, LogRecord
from vistel.wire.world.recorded import TOPICS as WORLD_TOPICS
from vistel.wire.world.recorded import RecordedWorld

SAID_ONCE = ("participant", "picture_part")
"""What is true from then on: it is read from the log's beginning."""
TOPICS = (*SAID_ONCE, "motion", *WORLD_TOPICS, "voice", "screen")
"""What of a log a film is made of."""
PREROLL_NS = 5_000_000_000
"""Before the asked time: key frames of motion and the world come every 2 s, and once a panel stands that follows somebody's screen,
a key picture of that comes as often."""


@dataclass(frozen=True)
class FilmPicture:
    """rgba: (height, width, 4), first row at the bottom; t_ns: conference time at which it is shown. sounds: what is heard
    from it to the next one, as `VideoWriter.put_sound` takes it."""

    t_ns: int
    rgba: U8
    sounds: Sequence[tuple[int, bytes]] = ()


def film(
    config: RenderConfig,
    records: Iterable[LogRecord],
    begin_ns: int,
    end_ns: int,
    rate: float,
    finer: int = 1,
    voices: FilmSound | None = None,
) -> Iterator[FilmPicture]:
    """`rate` pictures a second from `begin_ns` to `end_ns`, in order. records: of TOPICS, from some time before `begin_ns` on,
    in the order of their arrival. finer: every pixel is the mean of so many by so many. voices: collects the sound.
    There is time: where the view leaves the light open, it is fine.

    Raises NoOpenGlError; RoomFileError for a room whose files are not here; ValueError for a finer wall of screens.
    """
    view = config.view
    if finer > 1 and view.screens:
        raise ValueError("film: a wall of screens is drawn in its own pixels")
    light = "fine" if view.light == "auto" else view.light
    large = replace(view, width=finer * view.width, height=finer * view.height, light=light)
    decor: Interior | None = decor_of(config.room) if config.room is not None else None
    pages = RecordedPages(decor.models if decor is not None else {})
    renderer = SceneRenderer(large, config.seats, lambda about: load_figure(about, files=config.avatars), decor, pages)
    renderer.painter.saves_shadows = False
    try:
        # One instant ahead of what is drawn: what is heard until then belongs to the picture.
        ahead = instants(config.delay_s, records, begin_ns, end_ns + math.ceil(1e9 / rate), rate, voices, pages)
        for instant, following in pairwise(ahead):
            picture = renderer.render_complete(instant)
            if finer > 1:
                picture = np.asarray(cv2.resize(picture, (view.width, view.height), interpolation=cv2.INTER_AREA), np.uint8)
            yield FilmPicture(instant.now_ns, picture, voices.until(following) if voices is not None else ())
    finally:
        renderer.close()


def records_of(reader: LogReader, begin_ns: int, end_ns: int) -> Iterator[LogRecord]:
    """Records for a film: participants and pages from the log's beginning on, all others from a little before it begins."""
    first_ns = max(reader.begin_ns, begin_ns - PREROLL_NS)
    yield from reader.records(topics=SAID_ONCE, end_ns=first_ns)
    yield from reader.records(topics=TOPICS, begin_ns=first_ns, end_ns=end_ns + 1)


def count_of(begin_ns: int, end_ns: int, rate: float) -> int:
    """How many pictures lie between two times."""
    return max(0, int((end_ns - begin_ns) * 1e-9 * rate + 1e-9))


def instants(
    delay_s: float,
    records: Iterable[LogRecord],
    begin_ns: int,
    end_ns: int,
    rate: float,
    voices: FilmSound | None = None,
    pages: RecordedPages | None = None,
) -> Iterator[Instant]:
    """What is shown, `rate` times a second from `begin_ns` to `end_ns`, of `records` (see `film`); `voices` collects the
    sound, `pages` what panels show."""
    stage = Stage(round(delay_s * 1e9))
    playback = _LogPlayback(stage, iter(records), voices, pages)
    for now_ns in looks_before(begin_ns):
        playback.until(now_ns)
        stage.instant(now_ns)
    for n in range(count_of(begin_ns, end_ns, rate)):
        now_ns = begin_ns + round(n * 1e9 / rate)
        playback.until(now_ns)
        yield stage.instant(now_ns)


class _LogPlayback:
    """Hands the records of a log to the stage, to the film's sound and to its pages, up to a time."""

    def __init__(self, stage: Stage, records: Iterator[LogRecord], voices: FilmSound | None, pages: RecordedPages | None) -> None:
        self._stage, self._records, self._voices, self._pages = stage, records, voices, pages
        self._next = next(records, None)
        self._world = RecordedWorld()

    def until(self, t_ns: int) -> None:
        while self._next is not None and self._next.log_ns <= t_ns:
            self._take(self._next)
            self._next = next(self._records, None)

    def _take(self, record: LogRecord) -> None:
        message = record.message
        if record.topic.name == "participant":
            self._stage.receive_participant(message)
            for digest in self._stage.awaited:
                if kept_parcel(digest) is not None:
                    self._stage.avatar_arrived(digest)
        elif record.topic.name == "motion":
            self._stage.receive_motion(record.names["participant"], message, record.log_ns)
        elif record.topic.name == "screen":
            self._stage.receive_screen(record.names["participant"], message, record.log_ns)
            self._stage.screens.settle()
        elif record.topic.name == "picture_part":
            if self._pages is not None:
                self._pages.receive(record)
        elif record.topic.name == "voice":
            self._stage.receive_voice(record.names["participant"], message)
            if self._voices is not None:
                self._voices.receive(record.names["participant"], message)
        else:
            for now in self._world.take(record):
                # The steps of one message as if each had come as soon as it was about.
                self._stage.receive_world(now, record.log_ns - (message.header.t_ns - now.t_ns))
