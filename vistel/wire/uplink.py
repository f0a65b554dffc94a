"""Sharing an uplink that is too thin for all that a site has to send: motion comes first, then voices, then frames of devices.

Each process asks the hub's clock how long its questions take to get there. What they take beyond the shortest of ten minutes is a
queue before the thinnest part of the link (LEDBAT, RFC 6817). What is less important gives way at a shorter queue and comes back
later, so that processes which know nothing of each other share the link in that order. The hub's answers travel the other way: a
queue there counts for nothing.
"""

import logging
import math
from collections.abc import Sequence

log = logging.getLogger("vistel.uplink")

SETTLE_NS = 1_000_000_000
"""After a change its effect is awaited for so long beyond the queue, and then for as long as the queue becomes shorter."""
ONE_AT_A_TIME_NS = 2_000_000_000
"""From one attempt at more, of whichever kind, to the next: who was too much is then known."""
FULL = 4.0
"""Where the queue is longer than what a kind of messages bears by this factor, as little of it is sent as can be."""
TRIED_NS = 5_000_000_000
"""A queue that grows within this time after a share rose came from that."""
SOON_S = 0.040
"""Within that time a shorter queue suffices to take back what was tried ... [s]"""
SOON = 2
"""... and the shortest of fewer queues: motion must not wait for the proof."""
LATER = 4
"""A level that proved too much is tried again after so many times the patience, and so on, LATEST times."""
LATEST = 2
QUIET_NS = 2_000_000_000
"""Without a voice for so long, its place may be used: pauses between words are shorter."""
LONGER_S = 0.5
"""No other way takes so much longer; a full queue does [s]."""
CLEAR_S = 0.005
"""A queue as short as this for CLEAR_NS shows that the link has become wider: what was too much is forgotten [s]."""
CLEAR_NS = 8_000_000_000
EARLY_NS = 5_000_000
"""A frame may come so much earlier than its rate says: captures are no exact sixtieths of a second apart."""


class Share:
    """How much of one kind of messages is sent. `level` 0: all; each further level is less."""

    def __init__(self, most: int, queue_s: float, patience_s: float) -> None:
        """most: the last level; queue_s: above this queue less is sent; patience_s: below half of it for so long, more is tried."""
        self.level = 0
        self._most, self._queue_s, self._patience_ns = most, queue_s, round(patience_s * 1e9)
        self._last_queue_s = 0.0
        self._settles_ns: int | None = None
        self._calm_since_ns: int | None = None
        self._clear_since_ns: int | None = None
        self._rose_ns: int | None = None
        self._failed: tuple[int, int] | None = None
        """The level that proved too much, and how often in a row."""

    def follow(self, queue_s: float, now_ns: int, *, may_rise: bool = True) -> bool:
        """Choose the level for a queue that was measured at `now_ns` of a steady clock. Whether more is tried."""
        self._calm_since_ns = _since(self._calm_since_ns, queue_s < self._queue_s / 2, now_ns)
        self._clear_since_ns = _since(self._clear_since_ns, queue_s < CLEAR_S, now_ns)
        if self._clear_since_ns is not None and now_ns - self._clear_since_ns >= CLEAR_NS:
            self._failed = None
        if queue_s > self._queue_s:
            self._less(queue_s, now_ns)
            return False
        self._settles_ns = None
        calm_ns = now_ns - self._calm_since_ns if self._calm_since_ns is not None else 0
        if not (self.level and may_rise and calm_ns >= self._wait_ns(self.level - 1)):
            return False
        self.level -= 1
        self._calm_since_ns = self._rose_ns = now_ns
        return True

    def _wait_ns(self, level: int) -> int:
        """How long the queue is short before `level` is tried."""
        if self._failed is None or level > self._failed[0]:
            return self._patience_ns
        return LATER ** min(self._failed[1], LATEST) * self._patience_ns

    def _less(self, queue_s: float, now_ns: int) -> None:
        full = queue_s > FULL * self._queue_s
        settles = self._settles_ns is not None and now_ns < self._settles_ns
        if settles and not (full and queue_s > 2.0 * self._last_queue_s):
            return
        shrinks = self._settles_ns is not None and queue_s < self._last_queue_s
        self.settle(queue_s, now_ns)
        if shrinks or self.level == self._most:
            return
        # What was sent before the last attempt at more had room.
        if self.tries(now_ns):
            self.take_back()
        else:
            self.level = self._most if full else self.level + 1

    def tries(self, now_ns: int) -> bool:
        """Whether it sends more since a moment ago."""
        return self._rose_ns is not None and now_ns - self._rose_ns < TRIED_NS

    def take_back(self) -> None:
        """The last attempt at more proved too much."""
        again = self._failed is not None and self._failed[0] == self.level
        self._failed = self.level, self._failed[1] + 1 if again and self._failed is not None else 1
        self._rose_ns = self._calm_since_ns = None
        self.level += 1

    def settle(self, queue_s: float, now_ns: int) -> None:
        """A queue that is there comes from something else, and is being seen to."""
        self._settles_ns, self._last_queue_s = now_ns + SETTLE_NS + round(queue_s * 1e9), queue_s


def _since(since_ns: int | None, holds: bool, now_ns: int) -> int | None:
    """Since when something holds that held since `since_ns`."""
    return None if not holds else now_ns if since_ns is None else since_ns


MOST_BITS = 510_000
"""The highest rate of Opus [bit/s]: the voice goes as the conference file says."""
MOST_FRAMES = 3
"""Of a voice, in one message."""


class Uplink:
    """What a process may send: everything, as long as nobody measures (`vistel.wire.link.probe`)."""

    MOTION_HZ: Sequence[float] = (math.inf, 30.0, 20.0, 15.0, 10.0)
    """Frames of each person's motion a second, at most, by level."""
    VOICE: Sequence[tuple[int, int]] = (
        (1, MOST_BITS),
        (2, MOST_BITS),
        (2, 16_000),
        (MOST_FRAMES, 12_000),
        (MOST_FRAMES, 8_000),
        (MOST_FRAMES, 6_000),
    )
    """Frames of 20 ms in a message, and bits of sound a second, at most, by level."""
    FRAMES_HZ: Sequence[float] = (math.inf, 30.0, 10.0, 3.0, 0.0)
    """Frames of each device a second that leave the process, at most, by level."""

    def __init__(self) -> None:
        self.frames_give_way = True
        """False: another process of the site needs the frames of devices that this one sends."""
        self._speaking = set[str]()
        self._spoke_ns = -QUIET_NS
        self.begin_anew()

    def begin_anew(self) -> None:
        """Send everything: what was taken for a queue was none, so nothing is known of the link."""
        self.queue_s = 0.0
        self._rose_ns = -ONE_AT_A_TIME_NS
        self._voice = Share(len(self.VOICE) - 1, 0.080, 4.0)
        self._silent, self._spoken = self._shares(), self._shares()
        """Of motion and of frames: beside no voice, and beside one. Who begins to speak finds what had room beside a voice."""
        self._now = self._spoken if self._speaking else self._silent

    def _shares(self) -> tuple[Share, Share]:
        return Share(len(self.MOTION_HZ) - 1, 0.110, 3.0), Share(len(self.FRAMES_HZ) - 1, 0.060, 10.0)

    @property
    def motion_hz(self) -> float:
        """Frames of each person's motion a second, at most."""
        return self.MOTION_HZ[self._now[0].level]

    @property
    def voice(self) -> tuple[int, int]:
        """Frames in a message, bits a second."""
        return self.VOICE[self._voice.level]

    @property
    def frames_hz(self) -> float:
        """Frames of each device a second, at most, that leave the process."""
        return self.FRAMES_HZ[self._now[1].level] if self.frames_give_way else math.inf

    @property
    def raw(self) -> bool:
        """Whether the bytes of devices leave the process."""
        return self._now[1].level == 0

    @property
    def levels(self) -> dict[str, int]:
        """By kind; 0: nothing gives way."""
        return {"motion": self._now[0].level, "voice": self._voice.level, "frames": self._now[1].level}

    @property
    def in_vain(self) -> bool:
        """Whether something gives way and yet messages take longer than before, by no more than another way may."""
        return SOON_S < self.queue_s < LONGER_S and any(self.levels.values())

    def speaks(self, participant: str, whether: bool) -> None:
        """The voice of `participant` is being sent, or is no more."""
        if whether:
            self._speaking.add(participant)
            self._now = self._spoken
        else:
            self._speaking.discard(participant)

    def tries(self, now_ns: int) -> bool:
        """Whether more is sent since a moment ago: whether it is too much should be known soon."""
        return now_ns - self._rose_ns < ONE_AT_A_TIME_NS

    def follow(self, queue_s: float, now_ns: int) -> None:
        """Choose anew for a queue that was measured at `now_ns` of a steady clock."""
        before, self.queue_s = self.levels, queue_s
        if self._speaking:
            self._spoke_ns = now_ns
        spoken = now_ns - self._spoke_ns < QUIET_NS
        self._now = self._spoken if spoken else self._silent
        shares = self._now[0], self._voice, self._now[1]
        settled = [(share, share.level) for share in self._now if not share.tries(now_ns)]
        tried = [share for share in shares if queue_s > SOON_S and share.tries(now_ns)]
        for share in tried:
            share.take_back()
        for share in shares:
            may_rise = now_ns - self._rose_ns >= ONE_AT_A_TIME_NS and (spoken or share is not self._voice)
            if tried:
                share.settle(queue_s, now_ns)
            elif share.follow(queue_s, now_ns, may_rise=may_rise):
                self._rose_ns = now_ns
        self._compare(spoken, thinner=any(share.level > level for share, level in settled))
        if self.levels != before:
            voice_bits = self.voice[1]
            log.info(
                "uplink %s queue_ms=%.0f motion_hz=%g voice_bits_per_s=%d device_frames_hz=%g",
                "thin" if any(self.levels.values()) else "wide",
                queue_s * 1e3,
                self.motion_hz,
                voice_bits,
                self.frames_hz,
            )

    def _compare(self, spoken: bool, thinner: bool) -> None:
        """What has room beside a voice has room beside none; what has none beside none has none beside one. thinner: what had room
        is too much now, so what had room beside none says nothing any more."""
        for beside_none, beside_voice in zip(self._silent, self._spoken, strict=True):
            if spoken and thinner:
                beside_none.level = beside_voice.level
            elif spoken:
                beside_none.level = min(beside_none.level, beside_voice.level)
            else:
                beside_voice.level = max(beside_none.level, beside_voice.level)
        if not spoken and not any(share.level for share in self._silent):  # the link is wide
            for share in (self._voice, *self._spoken):
                share.level = 0


class Pacer:
    """Which frames of a stream go, at a rate that may change."""

    def __init__(self) -> None:
        self._last_ns = 0

    def due(self, t_ns: int, hz: float) -> bool:
        """Whether the frame of `t_ns` goes, at `hz` frames a second at most. Where time goes back it begins anew."""
        if hz <= 0.0 or 0 <= t_ns - self._last_ns < 1e9 / hz - EARLY_NS:
            return False
        self._last_ns = t_ns
        return True
