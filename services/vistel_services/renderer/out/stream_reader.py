"""What one reader of a stream still gets: a short queue, from which pictures fall where it does not keep up."""

from __future__ import annotations

import asyncio
from collections import deque

from vistel.render.film.stream_encoder import StreamPicture

MOST_PICTURES = 6
"""That wait for a reader; more are late, and it goes on with the next that stands for itself."""
MOST_SOUNDS = 25
MOST_WORDS = 8


class Reader:
    """Lives on the event loop. Whatever a reader does, no more waits for it than the constants above say."""

    def __init__(self, form: str) -> None:
        """form: "h264" or "jpeg", what its pictures are."""
        self.form = form
        self.left_out = 0
        self._pictures: deque[StreamPicture] = deque()
        self._sounds: deque[bytes] = deque(maxlen=MOST_SOUNDS)
        self._words: deque[str] = deque(maxlen=MOST_WORDS)
        self._lost = True
        self._something = asyncio.Event()

    @property
    def wants_key(self) -> bool:
        """It reads, and the pictures that come are of no use to it."""
        return self._lost and not self._pictures

    def show(self, picture: StreamPicture) -> None:
        """The next picture."""
        if self._lost and not picture.key:
            self.left_out += 1
            return
        if len(self._pictures) >= MOST_PICTURES:
            self.left_out += len(self._pictures)
            self._pictures.clear()
            self._lost = not picture.key
            if self._lost:
                self.left_out += 1
                return
        self._lost = False
        self._pictures.append(picture)
        self._something.set()

    def lose(self) -> None:
        """It has lost its place and goes on with the next key picture."""
        self._pictures.clear()
        self._lost = True

    def play(self, data: bytes) -> None:
        """The next sound."""
        self._sounds.append(data)
        self._something.set()

    def put_text(self, text: str) -> None:
        """Something to read, JSON."""
        self._words.append(text)
        self._something.set()

    async def next(self) -> str | bytes:
        """What is sent next: words before sounds before pictures."""
        while not (self._words or self._sounds or self._pictures):
            self._something.clear()
            await self._something.wait()
        if self._words:
            return self._words.popleft()
        return self._sounds.popleft() if self._sounds else self._pictures.popleft().data
