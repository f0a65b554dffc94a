"""What participants show live, on its way to pages that watch a room: each picture once, as it was encoded.

A message to a page holds one picture, little-endian:

| bytes | what |
|---|---|
| 1 | its format, `FORMAT` |
| 1 | 1 for a key picture |
| 1 | of the participant's name |
| 1 | of the codec's name |
| 2, 2 | width and height [pixels] |
| 8 | its stream |
| 8 | when it was encoded, of the stream's own clock [us] |
| | participant, codec (as WebCodecs names it), the picture |
"""

from __future__ import annotations

import struct
from collections import defaultdict, deque
from collections.abc import Iterable
from typing import NamedTuple

from vistel.protocol.pages.screen_parts import JoinedScreen, ScreenPicture
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME

FORMAT = 3
"""Those of a room's frame and of voices are 1 and 2."""
_HEAD = struct.Struct("<BBBBHHQQ")
MOST_WAITING = 64
"""Pictures that wait for one page: six seconds of one stream."""


class ForwardedPicture(NamedTuple):
    """A picture for pages: whose, whether it is a key picture, and the message."""

    participant: str
    key: bool
    message: bytes


def message_of(participant: str, picture: ScreenPicture) -> bytes:
    """See the module."""
    name, codec = participant.encode(), picture.codec.encode()
    size = picture.width, picture.height
    head = _HEAD.pack(FORMAT, picture.key, len(name), len(codec), *size, picture.stream, picture.t_us)
    return head + name + codec + picture.data


def picture_of(message: bytes) -> tuple[str, ScreenPicture]:
    """Whose a message's picture is, and the picture, without its number. Raises ValueError for what is none."""
    if len(message) <= _HEAD.size or message[0] != FORMAT:
        raise ValueError("no picture of what somebody shows live")
    _, key, named, codecs, width, height, stream, t_us = _HEAD.unpack_from(message)
    at = _HEAD.size + named
    name, codec = message[_HEAD.size : at].decode(), message[at : at + codecs].decode()
    return name, ScreenPicture(stream, 0, bool(key), codec, width, height, t_us, message[at + codecs :])


class ForwardedScreens:
    """Lives on the event loop."""

    def __init__(self, bus: Bus) -> None:
        self._parts = bus.subscribe(BY_NAME["screen"], queue_all=True, polled=True)
        self._joined = defaultdict[str, JoinedScreen](JoinedScreen)

    def take(self) -> list[ForwardedPicture]:
        """Pictures that have come whole since the last call, of each stream from the newest key picture among them on: after a leap
        in a log seconds of them come at once, more than a page would decode."""
        out: dict[str, list[ForwardedPicture]] = {}
        for sample in self._parts.take():
            name = sample.names["participant"]
            picture = self._joined[name].take(sample.message)
            if picture is None:
                continue
            if picture.key:
                out[name] = []
            out.setdefault(name, []).append(ForwardedPicture(name, picture.key, message_of(name, picture)))
        return [picture for pictures in out.values() for picture in pictures]

    def begin_again(self) -> None:
        """Time has leapt: nothing that came before counts."""
        self._parts.take()
        self._joined.clear()

    def close(self) -> None:
        """Receive no more."""
        self._parts.close()


class WaitingPictures:
    """Those that one page still gets. Who is slow gets none of a stream until its next key picture."""

    def __init__(self) -> None:
        self._waiting: deque[ForwardedPicture] = deque()
        self._left_out: set[str] = set()

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def put(self, pictures: Iterable[ForwardedPicture]) -> bool:
        """More of them; whether any wait."""
        for picture in pictures:
            if len(self._waiting) >= MOST_WAITING:
                self._left_out |= {waiting.participant for waiting in self._waiting} | {picture.participant}
                self._waiting.clear()
            if picture.key:
                self._left_out.discard(picture.participant)
            if picture.participant not in self._left_out:
                self._waiting.append(picture)
        return bool(self._waiting)

    def next(self) -> bytes:
        """The one that has waited longest."""
        return self._waiting.popleft().message
