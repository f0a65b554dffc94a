"""PortAudio's sound cards, and who of this process has one open.

PortAudio looks at what is plugged in only when it begins, and beginning anew ends every open stream. So it does that
freely while none is open, and else now and then, when a card that is wanted is not there: the others open theirs again.

All of that may take seconds, so it is done on one thread, `thread`: cards are looked for, opened and closed there, one after
the other, and nothing else waits for it. `CardOpener` brings what was opened to the loop that captures and plays.
"""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any, Generic, TypeVar

from vistel.audio.capture import InputError

log = logging.getLogger("vistel.audio")

_LOOK_NS = 15_000_000_000
"""As seldom are others' cards interrupted to look for one."""


class Card:
    """A stream of a sound card."""

    about = ""

    def __init__(self, kind: str) -> None:
        """kind: "microphone" or "loudspeaker"."""
        self._kind = kind
        self._stream_lock = threading.Lock()  # never held while PortAudio may wait
        self._stream: Any = None

    def open_with(self, open_it: Callable[[], None], now_ns: int) -> None:
        """Open it; where that fails, look again at what is plugged in and try once more. On `thread`. Raises InputError."""
        if not _open:
            look_again(now_ns)
            open_it()
        else:
            try:
                open_it()
            except InputError:
                if not look_again(now_ns):
                    raise
                open_it()
        _open.append(self)

    def check(self) -> None:
        """Raises InputError where the card is gone."""
        with self._stream_lock:
            if self._stream is None or not self._stream.active:
                raise InputError(f"{self.about}: the {self._kind} is gone")

    def close(self) -> None:
        """Use it no more; it is let go of on `thread`."""
        thread.submit(self.release)

    def release(self) -> None:
        """Let go of it at once. On `thread`."""
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
"""Where PortAudio is used. It begins at the first use, so a process that is forked before has it too."""


class CardOpener(Generic[C]):
    """Opens a card on `thread`."""

    def __init__(self, open_card: Callable[[], C]) -> None:
        """open_card: makes the object; raises InputError."""
        self._open_card = open_card
        self._opening: Future[C] | None = None

    def poll(self) -> C | None:
        """The card, once; None while it is being opened. Raises InputError where it cannot be opened. Never waits."""
        if self._opening is None:
            self._opening = thread.submit(self._open_card)
        if not self._opening.done():
            return None
        opening, self._opening = self._opening, None
        return opening.result()

    def close(self) -> None:
        """A card that is still being opened is let go of when that is done."""
        if self._opening is not None:
            self._opening.add_done_callback(_release)
            self._opening = None


def _release(opening: Future[Any]) -> None:
    with contextlib.suppress(InputError):
        opening.result().close()


_open: list[Card] = []
_looked_ns: list[int] = []


def sound_cards() -> Any:
    """The `sounddevice` module. Raises InputError where this machine has no PortAudio."""
    try:
        import sounddevice  # noqa: PLC0415  PortAudio is looked for when it is loaded
    except ImportError as e:
        raise InputError("no sound card can be used: sounddevice is not installed (pip install 'vistel[audio]')") from e
    except OSError as e:
        raise InputError("no sound card can be used: PortAudio is missing (apt-get install libportaudio2)") from e
    return sounddevice


def find_card(name: str, direction: str) -> int | None:
    """Its number in PortAudio, None for the system's own choice. direction: "input" or "output". Raises InputError."""
    cards = sound_cards()
    try:
        able = [d for d in cards.query_devices() if d[f"max_{direction}_channels"] > 0]
    except Exception as e:  # PortAudio's errors have no common ancestor over its versions
        raise InputError(f"sound cards cannot be listed: {e}") from e
    if not able:
        raise InputError(f"no sound card with {direction}s is attached")
    if name in ("default", "auto"):
        return None
    for device in able:
        if name.lower() in device["name"].lower():
            return int(device["index"])
    raise InputError(f"{name}: no sound card with {direction}s is called so; there are " + ", ".join(d["name"] for d in able))


def look_again(now_ns: int) -> bool:
    """Have PortAudio look at what is plugged in now. False: not now, others have cards open and were interrupted lately."""
    if _open:
        if _looked_ns and now_ns - _looked_ns[0] < _LOOK_NS:
            return False
        log.info("event=sound_cards_looked_for interrupted=%d", len(_open))
        for other in list(_open):
            other.release()
    _looked_ns[:] = [now_ns]
    cards = sound_cards()
    cards._terminate()
    cards._initialize()
    return True
