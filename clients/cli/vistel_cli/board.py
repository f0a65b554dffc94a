"""`vistel board`: a board in the room is put up, written on, wiped and saved as a file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.space.actions import Action, Draw, PutUpBoard, Rub, Wipe
from vistel.space.arguments import Which
from vistel.space.commands.names import COLOURS
from vistel.wire.bus import Bus
from vistel.wire.clock import SystemClock, sleep
from vistel_cli.ask import answered
from vistel_cli.conference_choice import Hub, as_participant, on_bus, participants
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE, LOG
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import USAGE, fail

if TYPE_CHECKING:
    from vistel.session.room_view import RoomView

_LOOK_S = 0.05
"""From one look whether the room is known to the next [s]."""
_ROOM_S = 15.0
"""How long `--save` waits for the room [s]."""
_POINT = re.compile(r"(\d+(?:\.\d*)?|\.\d+),(\d+(?:\.\d*)?|\.\d+)")


def board(
    new: Annotated[bool, typer.Option("--new", help="Put up a board.")] = False,
    draw: Annotated[str, typer.Option(metavar="POINTS", help="A stroke: X,Y of each point in metres, from the lower left.")] = "",
    rub: Annotated[str, typer.Option(metavar="POINTS", help="Rub out each stroke that a way through these points touches.")] = "",
    wipe: Annotated[bool, typer.Option("--wipe", help="Rub out all that is on the board.")] = False,
    save: Annotated[Path | None, out_file("Save what is written, as an SVG or PDF file.", "--save")] = None,
    colour: Annotated[str, typer.Option(help=f"Of the stroke: {', '.join(COLOURS)}, or #RRGGBB.")] = "black",
    width: Annotated[float, typer.Option(help="Of the stroke, or of what rubs, in millimetres.")] = 0.0,
    which: Annotated[str, typer.Option("--board", help="Which board, by its name or id; default: the newest.")] = "",
    title: Annotated[str, typer.Option(help="What a new board is called.")] = "",
    who: Annotated[str | None, typer.Option("--as", help="Participant who writes; default: the first of the file.")] = None,
    log: Annotated[Path | None, Takes(LOG), typer.Option(help="Save from this log, not from the conference that runs.")] = None,
    at: Annotated[float | None, typer.Option(min=0.0, help="Second of the log; default: its end.")] = None,
    conference_file: Annotated[
        Path | None, Takes(CONFERENCE), typer.Option("--conference", help="Conference file; default: the one that runs here.")
    ] = None,
    hub: Hub = None,
    force: Force = False,
) -> None:
    """Put up a board in the room of a running conference, write on it, wipe it, or save it.

    Everybody sees the board. It is a thing like others: `vistel ask delete board` takes it away, and `vistel ask undo` takes a
    stroke back.

    [bold]Examples[/bold]

      vistel board --new --as aiko

      vistel board --draw "0.2,0.3 0.5,0.9 0.8,0.3" --colour red --as aiko

      vistel board --wipe --as aiko

      vistel board --save board.svg

      vistel board --save board.pdf

      vistel board --save earlier.svg --log out/latest/conference.mcap
    """
    from vistel.space.boards.stroke import UNIT

    wide = round(1e-3 * width / UNIT) or None
    meant = Which(name=which.lower())
    asked: list[Action] = []
    asked += [PutUpBoard(title)] if new else []
    asked += [Draw(_way(draw), meant, _colour(colour), wide)] if draw else []
    asked += [Rub(_way(rub), meant, wide)] if rub else []
    asked += [Wipe(meant)] if wipe else []
    if (save is not None) + len(asked) != 1:
        if conference_file is not None:
            participants(conference_file, hub)  # what is wrong with a file is told before what is wrong with the words
        fail("expected one of --new, --draw POINTS, --rub POINTS, --wipe, --save FILE.svg, --save FILE.pdf", USAGE)
    if save is not None:
        if save.suffix.lower() not in (".svg", ".pdf"):
            fail(f"--save {save}: expected a name that ends in .svg or .pdf", USAGE)
        if log is None:
            _save(save, which, _now(conference_file, hub), "in the room; `vistel board --new` puts one up")
        else:
            _save(save, which, _of_log(log, at), f"in {log} at {'its end' if at is None else f'{at:g} s'}")
        return
    answer = answered(conference_file, hub, who, lambda _, __, asker: asker.ask(asked[0]))
    typer.echo(f"done: {', '.join(answer.things)}")


def _way(text: str) -> tuple[int, ...]:
    """Points in metres as numbers of the grid."""
    from vistel.space.boards.stroke import ACROSS, UNIT, UPWARDS

    out: list[int] = []
    for word in text.split():
        if (found := _POINT.fullmatch(word)) is None:
            fail(f'expected points X,Y in metres with spaces between, as in "0.2,0.3 0.5,0.9", got {word!r}', USAGE)
        x, y = (round(min(float(number), 1e3) / UNIT) for number in found.groups())
        if x > ACROSS or y > UPWARDS:
            fail(f"the point {word} is not on the board, which is {ACROSS * UNIT:g} m wide and {UPWARDS * UNIT:g} m high", USAGE)
        out += [x, y]
    return tuple(out)


def _colour(text: str) -> int:
    if text in COLOURS:
        return COLOURS[text]
    if re.fullmatch("#[0-9a-fA-F]{6}", text):
        return int(text[1:] + "ff", 16)
    fail(f"there is no colour {text!r}; there are {', '.join(COLOURS)}, and #RRGGBB", USAGE)


def _save(file: Path, which: str, room: RoomView, where: str) -> None:
    from vistel.space.boards.board import SHAPE
    from vistel.space.boards.pdf import MissingError, pdf
    from vistel.space.boards.svg import svg

    words = which.lower().split()
    boards = [t for t in room.things.values() if t.shape == SHAPE and all(w in f"{t.id} {t.name}".lower().split() for w in words)]
    if not boards:
        fail(f"there is no board {which}".rstrip() + f" {where}")
    chosen = boards[-1]
    strokes = room.written.get(chosen.id, ())
    try:
        file.write_bytes(pdf(strokes) if file.suffix.lower() == ".pdf" else svg(strokes).encode())
    except MissingError as fault:
        fail(str(fault))
    except OSError as fault:
        fail(f"{file} cannot be written: {fault.strerror}; name another file after --save")
    typer.echo(f"{file}: {chosen.name}, {len(strokes)} {'stroke' if len(strokes) == 1 else 'strokes'}")


def _now(conference_file: Path | None, hub: str | None) -> RoomView:
    """The room of a running conference."""
    from vistel.session.room_view import view_of
    from vistel.wire.world.listener import WorldListener

    conference, people, router = participants(conference_file, hub)
    _, site = as_participant(people, None)

    async def look(bus: Bus) -> RoomView | None:
        clock = SystemClock()
        world, until_ns = WorldListener(bus, clock), clock.now_ns() + round(_ROOM_S * 1e9)
        try:
            while clock.now_ns() < until_ns:
                if steps := world.take():
                    return view_of(steps[-1][0])
                await sleep(clock, _LOOK_S)
            return None
        finally:
            world.close()

    room = on_bus(conference, site, router, look, f"the world of {conference.name} at {router}")
    if room is None:
        fail(
            f"the world of {conference.name} has not told its room in {_ROOM_S:g} s; `vistel world where` says whether there is one"
        )
    return room


def _of_log(file: Path, at: float | None) -> RoomView:
    """The room of a log at a second of it, or at its end."""
    import vistel.log
    from vistel.wire.log import LogReader
    from vistel_cli.log.piece import check_within

    try:
        if at is not None:
            check_within(LogReader(file), "--at", at)
        with vistel.log.open(file) as log:
            room = None
            for _, now in log.rooms(0.0 if at is None else max(0.0, at - vistel.log.WHOLE_S), at):
                room = now
    except vistel.log.LogError as fault:
        fail(str(fault))
    if room is None:
        fail(f"{file}: no room was recorded until then; `vistel log info {file}` says what it has")
    return room
