"""What participants show live, decoded for whoever draws it: each in a thread of its own, so that no picture of the room waits.

What a stream may cost is bounded: pictures wait for the decoder up to a number, have at most `MOST_PIXELS`, and only the newest is
kept. What cannot be decoded is left out until the next key picture; a stream that goes on so is decoded no more.
"""

import logging
from collections.abc import Collection, Mapping
from importlib import import_module
from queue import Queue
from threading import Thread
from typing import Any, NamedTuple

import numpy as np

from vistel.arrays import U8
from vistel.protocol.pages.screen_parts import CODECS, MOST_PIXELS, JoinedScreen, ScreenPicture
from vistel.v1.motion_pb2 import ScreenPart

log = logging.getLogger("vistel.renderer")

MOST_WAITING = 40
"""Pictures that wait for the decoder: two key pictures and all between."""
MOST_FAULTS = 10
"""Pictures of a stream that cannot be decoded, without one between that can; then it is given up."""
SILENT_NS = 6_000_000_000
"""Who sends nothing for so long, three key pictures, shows nothing any more."""


class Shown(NamedTuple):
    """A picture; number: another one has another; rgb: (height, width, 3), first row at the top."""

    number: int
    rgb: U8


class DecodedScreens:
    """Of all who show something. `shown` may be called on another thread while nothing is received."""

    def __init__(self) -> None:
        self._decoding: dict[str, _Decoding] = {}

    def receive(self, name: str, message: ScreenPart, received_ns: int) -> None:
        """A part of what a participant shows. Never waits."""
        if name not in self._decoding:
            self._decoding[name] = _Decoding(name)
        self._decoding[name].receive(message, received_ns)

    def keep_only(self, names: Collection[str]) -> None:
        """Nobody else shows anything any more."""
        for name in self._decoding.keys() - names:
            self._decoding.pop(name).end()

    def shown(self, now_ns: int) -> Mapping[str, Shown]:
        """The newest picture of each participant who shows something at `now_ns`."""
        there = {name: d.shown for name, d in self._decoding.items() if now_ns - d.received_ns < SILENT_NS}
        return {name: shown for name, shown in there.items() if shown is not None}

    def settle(self) -> None:
        """Wait until all that was received is decoded: a film is the same however fast it is made."""
        for decoding in self._decoding.values():
            decoding.waiting.join()


class _Decoding:
    """Of one participant."""

    def __init__(self, name: str) -> None:
        self._name = name
        self.waiting: Queue[ScreenPicture | None] = Queue()
        self.shown: Shown | None = None
        self.received_ns = 0
        self._joined, self._skips = JoinedScreen(), False
        self._decoder = _Decoder(name)
        Thread(target=self._run, name=f"screen of {name}", daemon=True).start()

    def receive(self, message: ScreenPart, received_ns: int) -> None:
        picture = self._joined.take(message)
        if picture is None:
            return
        self.received_ns = received_ns
        if self.waiting.qsize() >= MOST_WAITING:
            self._skips = True  # those that wait are decoded; what follows them comes too late
        elif picture.key:
            self._skips = False
        if not self._skips:
            self.waiting.put(picture)

    def end(self) -> None:
        self.waiting.put(None)

    def _run(self) -> None:
        while (picture := self.waiting.get()) is not None:
            rgb = self._decoder.decoded(picture)
            if rgb is not None:
                self.shown = Shown(self.shown.number + 1 if self.shown else 1, rgb)
            self.waiting.task_done()
        self.waiting.task_done()


class _Decoder:
    """In a thread of its own."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._context: Any = None
        self._stream, self._faults = 0, 0

    def decoded(self, picture: ScreenPicture) -> U8 | None:
        """(height, width, 3), first row at the top; None where nothing can be seen."""
        if picture.stream != self._stream:
            self._stream, self._context, self._faults = picture.stream, None, 0
        if self._faults >= MOST_FAULTS or (self._context is None and not picture.key):
            return None
        try:
            if self._context is None:
                self._context = _opened(CODECS[picture.codec])
            frames: list[Any] = self._context.decode(import_module("av").Packet(picture.data))
            self._faults = 0 if frames else self._faults
            return np.asarray(frames[-1].to_ndarray(format="rgb24"), np.uint8) if frames else None
        except Exception as fault:  # whatever others send, only their panel suffers
            self._context = None
            self._faults += 1
            if self._faults in {1, MOST_FAULTS}:
                action = "given_up" if self._faults == MOST_FAULTS else "left_out_until_key_picture"
                log.warning("event=screen_not_decoded participant=%s reason=%r action=%s", self._name, str(fault), action)
            return None


def _opened(codec: str) -> Any:
    context: Any = import_module("av").CodecContext.create(codec, "r")  # only who draws what others show needs it
    context.options = {"max_pixels": str(MOST_PIXELS)}
    context.thread_count = 1
    context.flags |= 0x80000  # AV_CODEC_FLAG_LOW_DELAY: a picture is given as soon as it is there
    return context
