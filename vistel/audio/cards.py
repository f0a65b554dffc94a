"""Sound cards, by PortAudio.

PortAudio finds cards only when it is initialised, and that ends every open stream. So it is initialised anew whenever a card
is opened while no other is open; while others are, seldom, and only if the wanted card is missing. The others then reopen.

All of this may take seconds, so cards are found, opened and closed on one thread, `thread`. `CardOpener` hands an opened card
to the loop that captures and plays.
"""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any, Generic, TypeVar

from vistel.audio.capture import SoundDeviceError

log = logging.getLogger("vistel.audio")

_SEARCH_NS = 15_000_000_000
"""Least time between searches that interrupt open cards."""


class Card:
    """A stream of a sound card."""

    about = ""

    def __init__(self, kind: str) -> None:
        """kind: "microphone" or "loudspeaker"."""
        self._kind = kind
        self._stream_lock = threading.Lock()  # never held while PortAudio may wait
        self._stream: Any = None

    def open_with(self, open_it: Callable[[], None], now_ns: int) -> None:
        """Call `open_it`; if that fails, search for cards and call it once more. On `thread`. Raises SoundDeviceError."""
        if not _open:
            search_cards(now_ns)
            open_it()
        else:
            try:
                open_it()
            except SoundDeviceError:
                if not search_cards(now_ns):
                    raise
                open_it()
        _open.append(self)

    def check(self) -> None:
        """Raises SoundDeviceError if the card is gone."""
        with self._stream_lock:
            if self._stream is None or not self._stream.active:
                raise SoundDeviceError(f"{self.about}: the {self._kind} is gone")

    def close(self) -> None:
        """Have it closed on `thread`."""
        thread.submit(self.release)

    def release(self) -> None:
        """Close it now. On `thread`."""
        if self in _open:
            _open.remove(self)
        with self._stream_lock:
            stream, self._stream = self._stream, None
        if stream is None:
            return
        try:
            stream.close()
        except Exception as e:
            log.debug("event=%s_close reason=%r", self._kind, str(e))


C = TypeVar("C", bound=Card)

thread: Executor = ThreadPoolExecutor(1, "sound cards")
"""Where PortAudio is used. The thread starts with the first use, so that forked processes have it too."""


class CardOpener(Generic[C]):
    """Opens a card on `thread`."""

    def __init__(self, open_card: Callable[[], C]) -> None:
        """open_card: makes the object; raises SoundDeviceError."""
        self._open_card = open_card
        self._opening: Future[C] | None = None

    def poll(self) -> C | None:
        """The card, once; None while it is being opened. Raises SoundDeviceError if it cannot be opened. Never waits."""
        if self._opening is None:
            self._opening = thread.submit(self._open_card)
        if not self._opening.done():
            return None
        opening, self._opening = self._opening, None
        return opening.result()

    def close(self) -> None:
        """A card that is still being opened is closed afterwards."""
        if self._opening is not None:
            self._opening.add_done_callback(_release)
            self._opening = None


def _release(opening: Future[Any]) -> None:
    with contextlib.suppress(SoundDeviceError):
        opening.result().close()


_open: list[Card] = []
_searched_ns: list[int] = []


def sound_cards() -> Any:
    """The `sounddevice` module. Raises SoundDeviceError if it or PortAudio is missing."""
    try:
        import sounddevice  # noqa: PLC0415  PortAudio is looked for when it is loaded
    except ImportError as e:
        raise SoundDeviceError("no sound card can be used: sounddevice is not installed (pip install 'vistel[audio]')") from e
    except OSError as e:
        raise SoundDeviceError("no sound card can be used: PortAudio is missing (apt-get install libportaudio2)") from e
    return sounddevice


def find_card(name: str, direction: str) -> int | None:
    """Index in PortAudio; None: the system's choice. name: or a part; direction: "input" or "output". Raises SoundDeviceError."""
    cards = sound_cards()
    try:
        able = [d for d in cards.query_devices() if d[f"max_{direction}_channels"] > 0]
    except Exception as e:  # PortAudio's errors have no common ancestor over its versions
        raise SoundDeviceError(f"sound cards cannot be listed: {e}") from e
    if not able:
        raise SoundDeviceError(f"no sound card with {direction}s is attached")
    if name in ("default", "auto"):
        return None
    for device in able:
        if name.lower() in device["name"].lower():
            return int(device["index"])
    raise SoundDeviceError(
        f"{name}: no sound card with {direction}s has this name; attached: " + ", ".join(d["name"] for d in able)
    )


def search_cards(now_ns: int) -> bool:
    """Have PortAudio search for cards. False: not done, since open cards were interrupted lately."""
    if _open:
        if _searched_ns and now_ns - _searched_ns[0] < _SEARCH_NS:
            return False
        log.info("event=sound_cards_looked_for interrupted=%d", len(_open))
        for other in list(_open):
            other.release()
    _searched_ns[:] = [now_ns]
    cards = sound_cards()
    cards._terminate()
    cards._initialize()
    return True
