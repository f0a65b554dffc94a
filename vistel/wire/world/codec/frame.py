"""One frame: up to a few steps of everything that moves, and who touches whom, as changes to the frame before."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from vistel.wire.world.codec.bits import BitReader, BitWriter, FrameError
from vistel.wire.world.codec.poses import GridPose, Track
from vistel.wire.world.codec.touches import Pair, TouchCode, read_touches, write_touches

MOST_THINGS = 1 << 16
MOST_STEPS = 16
STILL_STEPS = 12
"""A thing that has not moved for so long is no longer named."""
MOST_ENCODED = 12
"""Things that move and are told of exactly in each step. When more do, those that are farthest from where readers predict them go
first, the others are left to foresight and cost nothing: what is said stays bounded, and who is left out comes next."""
STEP_BITS = 400
"""What is told of a step then."""
MOST_TOUCHES = 16
"""Pairs of bodies that a frame tells of."""
_NAME = 3


class ChangedLists(NamedTuple):
    """Which lists of the message are complete news; an empty one that is said means that there is none any more."""

    people: bool
    grasps: bool


@dataclass
class Book:
    """What both ends know after a frame: step, the track of each thing by its number, which of them move, who touches
    whom. touches_changed: by the last frame; crowded: more moved than it told of."""

    step: int = 0
    tracks: list[Track] = field(default_factory=list[Track])
    moving: tuple[int, ...] = ()
    touches: dict[Pair, TouchCode] = field(default_factory=dict[Pair, TouchCode])
    touches_changed: bool = True
    crowded: bool = False


class Moves(NamedTuple):
    """step; poses of what has moved in it and of all that moves in the book, by number of the thing."""

    step: int
    poses: Mapping[int, GridPose]


class RoomStep(NamedTuple):
    """step; poses of everything that moves, by number of the thing."""

    step: int
    poses: Mapping[int, GridPose]


def write_key(book: Book, step: int, poses: Sequence[GridPose], moving: Sequence[int], touches: Mapping[Pair, TouchCode]) -> bytes:
    """A frame that refers to nothing: everything at one step."""
    out = BitWriter()
    out.flag(True)
    _write_lists(out, ChangedLists(True, True))
    out.count(len(poses), 5)
    book.tracks = [Track() for _ in poses]
    chosen = frozenset(moving)
    for number, (track, pose) in enumerate(zip(book.tracks, poses, strict=True)):
        track.write_key(out, pose)
        out.flag(number in chosen)
    book.step, book.moving, book.touches, book.touches_changed = step, tuple(sorted(chosen)), {}, True
    book.crowded = False
    write_touches(out, book.touches, touches)
    return out.to_bytes()


def write_changes(book: Book, steps: Sequence[Moves], touches: Mapping[Pair, TouchCode], lists: ChangedLists) -> bytes:
    """A frame of one or more steps that refers to the frame before. When people are said, touches begin anew."""
    out = BitWriter()
    out.flag(False)
    _write_lists(out, lists)
    before = book.step
    moved = {number for now in steps for number, pose in now.poses.items() if pose != book.tracks[number].pose}
    moving = frozenset(moved) | {n for n in book.moving if book.tracks[n].still < STILL_STEPS}
    some = book.crowded = len(moving) > MOST_ENCODED
    out.count(len(steps) - 1 + (MOST_STEPS if some else 0))
    for now in steps:
        out.count(now.step - before - 1)
        before = now.step
    _write_toggles(out, book, moving)
    last: Mapping[int, GridPose] = {}
    for now in steps:
        if some:
            _write_some(out, book, now.poses, last)
            last = now.poses
            continue
        for n in book.moving:
            track = book.tracks[n]
            track.write(out, now.poses.get(n, track.pose))
    if lists.people:
        book.touches = {}
    changed = write_touches(out, book.touches, touches, MOST_TOUCHES)
    book.step, book.touches_changed = before, changed or lists.people
    return out.to_bytes()


def _write_some(out: BitWriter, book: Book, poses: Mapping[int, GridPose], last: Mapping[int, GridPose]) -> None:
    """A step in which more move than are told of: the numbers of those that are, where they are, and whether they have come to
    lie since `last`, the step before."""
    chosen: dict[int, str] = {}
    left = STEP_BITS
    for n in _most_wrong_first(book, poses):
        track, one = book.tracks[n], BitWriter()
        pose = poses.get(n, track.pose)
        track.write(one, pose)
        lies = n in last and pose == last[n]
        one.flag(lies)
        if lies:
            track.begin()
        chosen[n] = one.bits
        left -= len(chosen[n])
        if left <= 0:
            break
    out.count(len(chosen))
    at, order = -1, _gap_order(book, len(chosen))
    for place, n in enumerate(book.moving):
        if n in chosen:
            out.count(place - at - 1, order)
            out.coded(chosen[n])
            at = place
        else:
            book.tracks[n].go_on()


def _most_wrong_first(book: Book, poses: Mapping[int, GridPose]) -> list[int]:
    """The things that are not where they are predicted in a step."""
    wrong = {n: book.tracks[n].wrong(poses.get(n, book.tracks[n].pose)) for n in book.moving}
    return sorted((n for n in wrong if wrong[n]), key=lambda n: (-wrong[n], n))


def _gap_order(book: Book, chosen: int) -> int:
    """Order of the code for how many lie between two that are told of."""
    return max(0, (len(book.moving) // max(1, chosen)).bit_length() - 1)


def write_book(book: Book) -> bytes:
    """A frame that refers to nothing and changes nothing: all that both ends know, so that somebody else can go on from it."""
    out = BitWriter()
    out.flag(True)
    _write_lists(out, ChangedLists(False, True))
    out.count(len(book.tracks), 5)
    moving = frozenset(book.moving)
    for number, track in enumerate(book.tracks):
        track.write_all(out, number in moving)
    write_touches(out, {}, book.touches)
    return out.to_bytes()


def is_key(data: bytes) -> bool:
    """Whether a frame refers to nothing."""
    return bool(data) and data[0] >= 0x80


def read_key(data: bytes, step: int) -> tuple[Book, ChangedLists]:
    """A key frame of a step. Raises FrameError."""
    bits = BitReader(data)
    bits.flag()
    lists = _read_lists(bits)
    everything = not lists.people  # as write_book says it; a key frame always says people
    count = bits.count(5)
    if count > MOST_THINGS or count > bits.left:
        raise FrameError("a frame names more things than it holds")
    book = Book(step)
    moving: list[int] = []
    for number in range(count):
        track = Track()
        book.tracks.append(track)
        if everything:
            moves = track.read_all(bits)
        else:
            track.read_key(bits)
            moves = bits.flag()
        if moves:
            moving.append(number)
    book.moving = tuple(moving)
    read_touches(bits, book.touches)
    return book, ChangedLists(True, True)


def read_changes(data: bytes, book: Book, newest: int) -> tuple[list[RoomStep], ChangedLists]:
    """The steps, up to step `newest`, of a frame that goes on from `book`, which it changes. Raises FrameError: before any
    change where it goes on from another step, else with the book half changed."""
    bits = BitReader(data)
    bits.flag()
    lists = _read_lists(bits)
    some, gaps = _read_steps(bits)
    if newest - sum(gaps) != book.step:
        raise FrameError(f"a frame goes on from step {newest - sum(gaps)}, known is {book.step}")
    book.crowded = some
    _read_toggles(bits, book)
    steps: list[RoomStep] = []
    for gap in gaps:
        book.step += gap
        if some:
            _read_some(bits, book)
        else:
            for n in book.moving:
                book.tracks[n].read(bits)
        steps.append(RoomStep(book.step, {n: book.tracks[n].pose for n in book.moving}))
    if lists.people:
        book.touches = {}
    book.touches_changed = read_touches(bits, book.touches) or lists.people
    return steps, lists


def _read_some(bits: BitReader, book: Book) -> None:
    count = bits.count()
    if count > len(book.moving):
        raise FrameError("a frame tells of more than moves")
    at, order = -1, _gap_order(book, count)
    for _ in range(count):
        place = at + 1 + bits.count(order)
        if place >= len(book.moving):
            raise FrameError("a frame names a thing that does not move")
        for n in book.moving[at + 1 : place]:
            book.tracks[n].go_on()
        track = book.tracks[book.moving[place]]
        track.read(bits)
        if bits.flag():
            track.begin()
        at = place
    for n in book.moving[at + 1 :]:
        book.tracks[n].go_on()


def _read_steps(bits: BitReader) -> tuple[bool, list[int]]:
    """Whether only some of what moves is told of; from each step to the next."""
    count = bits.count()
    some = count >= MOST_STEPS
    count += 1 - (MOST_STEPS if some else 0)
    if count > MOST_STEPS:
        raise FrameError("a frame holds too many steps")
    return some, [bits.count() + 1 for _ in range(count)]


def _write_lists(out: BitWriter, lists: ChangedLists) -> None:
    out.flag(lists.people)
    out.flag(lists.grasps)


def _read_lists(bits: BitReader) -> ChangedLists:
    return ChangedLists(bits.flag(), bits.flag())


def _write_toggles(out: BitWriter, book: Book, moving: frozenset[int]) -> None:
    """Which things begin or cease to move."""
    toggled = sorted(moving ^ frozenset(book.moving))
    out.count(len(toggled))
    at = -1
    for n in toggled:
        out.count(n - at - 1, _NAME)
        at = n
    _toggle(book, toggled)


def _read_toggles(bits: BitReader, book: Book) -> None:
    toggled: list[int] = []
    at = -1
    for _ in range(bits.count()):
        at += 1 + bits.count(_NAME)
        if at >= len(book.tracks):
            raise FrameError("a frame names a thing that is not there")
        toggled.append(at)
    _toggle(book, toggled)


def _toggle(book: Book, toggled: Sequence[int]) -> None:
    if not toggled:
        return
    before = frozenset(book.moving)
    for n in toggled:
        if n not in before:
            book.tracks[n].begin()
    book.moving = tuple(sorted(before ^ frozenset(toggled)))
