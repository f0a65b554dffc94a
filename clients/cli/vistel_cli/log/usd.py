"""`vistel log export`: a conference as USD with time samples."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from vistel.conference.avatar_files import kept_parcel
from vistel.conference.model import Conference
from vistel.render import Instant
from vistel.render.figures.people import files_of, load_avatar_of
from vistel.render.film.film import count_of, instants, records_of
from vistel.render.film.usd import write_usd
from vistel.wire.log import LogReader
from vistel_cli.log.avatars import with_recorded_avatars
from vistel_cli.log.piece import piece_of
from vistel_cli.terminal import FAILED, fail, out
from vistel_cli.waiting import progress

ENDINGS = (".usda", ".usdc", ".usd")


def export_usd(reader: LogReader, log: Path, output: Path, begin_s: float, end_s: float | None, rate: float) -> None:
    """Write `output`. Ends the command with one line when that fails."""
    from vistel.conference.rooms import RoomFileError, interior_of

    if output.suffix.lower() not in ENDINGS:
        fail(f"{output}: expected a name that ends in {', '.join(ENDINGS)}")
    if reader.conference is None:
        fail(f"{log}: holds no conference file; VISTEL did not write it")
    begin_s, end_s = piece_of(reader, begin_s, end_s)
    conference = with_recorded_avatars(Conference.model_validate(reader.conference), reader)
    begin_ns = reader.begin_ns + round(begin_s * 1e9)
    end_ns = reader.begin_ns + round(end_s * 1e9)
    try:
        with progress(f"writing {output.name}") as tell:
            count = write_usd(
                output,
                _told(_shown(reader, conference, begin_ns, end_ns, rate), count_of(begin_ns, end_ns, rate), tell),
                rate,
                interior_of(conference.room),
                partial(load_avatar_of, files=files_of(conference), parcel=_parcel),
                [(site.name, site.participants[0].name) for site in conference.sites],
            )
    except (ValueError, RoomFileError) as e:
        fail(str(e), FAILED)
    except OSError as e:
        fail(f"{output}: cannot be written: {e.strerror or e}", FAILED)
    out.print(f"{output}: {count} frames at {rate:g}/s; its parts are in {output.stem}_parts", soft_wrap=True)


def _shown(reader: LogReader, conference: Conference, begin_ns: int, end_ns: int, rate: float) -> Iterator[Instant]:
    return instants(conference.playout.recorded_s, records_of(reader, begin_ns, end_ns), begin_ns, end_ns, rate)


def _told(shown: Iterator[Instant], count: int, tell: Callable[[float], None]) -> Iterator[Instant]:
    for number, instant in enumerate(shown):
        tell(number / count)
        yield instant


def _parcel(digest: str) -> bytes:
    data = kept_parcel(digest)
    if data is None:
        raise ValueError(f"avatar: parcel {digest} is not in the log")
    return data
