"""A voice of a log as sound, in time with the log."""

from __future__ import annotations

import wave
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vistel.arrays import F32
from vistel.audio.opus import FRAME, RATE, Decoder, OpusError

if TYPE_CHECKING:
    from vistel.log import Log

MOST_SILENCE_S = 3600.0
"""A longer silence between two frames is no pause: the sender's clock was wrong [s]."""


def write_wav(log: Log, participant: str, path: Path, begin: float = 0.0, end: float | None = None) -> float:
    """Write a participant's voice from `begin` to `end` [s], 16 bits, mono, 48 kHz; silence where nothing was said. Returns its
    length [s]. Raises ValueError, one line, where there is no voice."""
    log.check_participant(participant)
    frames = voice(log, participant, begin, end)
    first = next(frames, None)
    if first is None:
        raise ValueError(f"{log.path}: no voice of {participant} in that time; sites with [sites.audio] record voices")
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        written = 0
        for t, frame in (first, *frames):
            at = round((t - begin) * RATE)
            missing = at - written
            if not -FRAME < missing < MOST_SILENCE_S * RATE:
                continue
            if missing > FRAME // 2:  # less is the jitter of the sender's clock
                file.writeframes(bytes(2 * missing))
                written += missing
            file.writeframes((np.clip(frame, -1.0, 1.0) * 32767.0).astype("<i2").tobytes())
            written += FRAME
    return written / RATE


def voice(log: Log, participant: str, begin: float = 0.0, end: float | None = None) -> Iterator[tuple[float, F32]]:
    """Frames of a voice, each 20 ms: when it was captured [s], and its samples (FRAME,), -1 to 1. What is no sound is left out."""
    decoder = Decoder()
    for found in log.messages("voice", begin=begin, end=end, participant=participant):
        if not found.message.opus:
            continue
        try:
            yield (found.message.header.t_ns - log.begin_ns) * 1e-9, decoder.decode(found.message.opus)
        except OpusError:
            continue
