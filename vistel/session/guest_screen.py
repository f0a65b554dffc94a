"""What a guest shows live: the pictures that their page sends, checked, and passed on in parts. The first wrong one ends it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from vistel.protocol.pages.screen import HEAD_BYTES, part_record, screen_of
from vistel.protocol.pages.screen_parts import MOST_PICTURE_BYTES, ScreenPicture, parts_of

MOST_RECORD_BYTES = HEAD_BYTES + MOST_PICTURE_BYTES
"""Of one message of a page."""
MOST_BYTES_S = 250_000
"""Of a stream, over longer times: 2 Mbit/s. A page keeps to 1.5 [bytes/s]."""
MOST_BYTES_AT_ONCE = 1_500_000
"""So much may come at once, after a page was held up."""
MOST_PICTURES_S = 15
"""Over longer times. A page sends 10."""
MOST_PICTURES_AT_ONCE = 60
"""The same at once."""
PART_S = 0.004
"""From one part to the next, on its way to the guest's site: more at once would not fit in what the system keeps for it [s]."""


class ScreenError(ValueError):
    """Why a stream ends: one line for the guest."""


class GuestScreen:
    """One stream. Time is an argument."""

    def __init__(self, said: Mapping[str, object], stream: int) -> None:
        """said: what the page says of it first, with codec, width and height; stream: a number drawn for it. Raises ScreenError."""
        self._codec, self._stream = str(said.get("codec", "")), stream
        width, height = said.get("width"), said.get("height")
        if type(width) is not int or type(height) is not int:
            raise ScreenError("a page says width and height of what it shows in whole pixels")
        self._width, self._height = width, height
        self._number, self._t_us = 0, -1
        self._at_ns: int | None = None
        self._bytes, self._pictures = float(MOST_BYTES_AT_ONCE), float(MOST_PICTURES_AT_ONCE)
        if fault := ScreenPicture(stream, 0, True, self._codec, width, height, 0, b"").objection_to_stream:
            raise ScreenError(f"cannot show {fault}")

    def records(self, record: Any, now_ns: int) -> Iterator[bytes]:
        """For the guest's site, the parts of the picture that a page has sent. Raises ScreenError."""
        found = screen_of(record) if isinstance(record, bytes) else None
        if found is None:
            raise ScreenError("this page sent what is no picture")
        key, t_us, data = found
        self._spend(len(data), now_ns)
        picture = ScreenPicture(self._stream, self._number, key, self._codec, self._width, self._height, t_us, data)
        if fault := picture.objection:
            raise ScreenError(f"this page sent {fault}")
        if t_us <= self._t_us or (self._number == 0 and not key):
            raise ScreenError("this page sent pictures in a wrong order")
        self._number, self._t_us = self._number + 1, t_us
        return map(part_record, parts_of(picture))

    def _spend(self, size: int, now_ns: int) -> None:
        passed_s = 0.0 if self._at_ns is None else max(0, now_ns - self._at_ns) * 1e-9
        self._at_ns = now_ns
        self._bytes = min(float(MOST_BYTES_AT_ONCE), self._bytes + passed_s * MOST_BYTES_S) - size
        self._pictures = min(float(MOST_PICTURES_AT_ONCE), self._pictures + passed_s * MOST_PICTURES_S) - 1.0
        if self._bytes < 0.0:
            raise ScreenError(f"this page sent more than {MOST_BYTES_S * 8e-6:g} Mbit/s")
        if self._pictures < 0.0:
            raise ScreenError(f"this page sent more than {MOST_PICTURES_S} pictures a second")
