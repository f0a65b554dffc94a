"""Cuts a stream of sound into utterances: WebRTC's voice activity detector, behind a filter that removes steady noise.

For engines that take an utterance at a time. `SpeechStage` explains the stages.
"""

import math
from collections import deque
from collections.abc import Iterator
from enum import Enum

import numpy as np

from vistel.arrays import I16
from vistel.speech.engines.denoise import STEP, Denoiser
from vistel.speech.engines.sphinx import sphinx
from vistel.speech.features import as_float
from vistel.speech.recognition import SAMPLE_RATE, Samples

FRAME = 480
"""Samples of a stage of an utterance, but for its beginning."""
FRAME_S = FRAME / SAMPLE_RATE
_LONGEST_S = 10.0
_WINDOW_S = 0.24
"""Length of the window of recent sound in which beginnings and ends of utterances are found."""
_SHARE = 0.85
"""Share of that window's frames that is speech where an utterance begins, and silence where it ends."""
_STRICT = 2
"""Aggressiveness of WebRTC's detector, 0 to 3."""
_FAINT = 0.04
"""Frames softer than this share of the loudest frame of an utterance count as silence."""
_EARLY = 4
"""Silent frames after which an utterance may be over."""
_LEAD = 3
"""Frames before the detected beginning that belong to the utterance."""


class SpeechStage(Enum):
    """BEGIN: the first sound of an utterance, with what came shortly before; SPEECH, SILENCE: the next frame of it; PAUSE: as
    SILENCE, and the utterance may be over, so that it can be recognised already; END: the last frame."""

    BEGIN = "begin"
    SPEECH = "speech"
    SILENCE = "silence"
    PAUSE = "pause"
    END = "end"


class Segmenter:
    """clean: whether the returned sound has passed the filter. Raises `engines.engine.EngineError`."""

    def __init__(self, *, clean: bool) -> None:
        self._clean = clean
        self._vad = sphinx().Vad(_STRICT, SAMPLE_RATE, FRAME_S)
        self._denoiser = Denoiser()
        self._count = round(_WINDOW_S / FRAME_S)
        self._needed = math.ceil(_SHARE * self._count)
        self._recent: deque[tuple[bool, I16]] = deque(maxlen=self._count + _LEAD)
        self._rest = np.zeros((2, 0), np.int16)
        self._late = np.zeros(STEP, np.float32)
        self._frames = 0
        self._silent = 0
        self._loudest = 0.0
        self.speaking = False
        self.start_s = 0.0
        """Where the utterance began, from the first sample fed."""

    def feed(self, samples: Samples) -> Iterator[tuple[SpeechStage, I16]]:
        """Any number of samples -> stages of utterances with their sound; nothing where nobody speaks."""
        sound = np.nan_to_num(as_float(samples), posinf=0.0, neginf=0.0)
        late = np.concatenate([self._late, sound])
        self._late = late[len(sound) :]
        both = np.stack([self._denoiser.feed(sound), late[: len(sound)]])
        pcm = np.concatenate([self._rest, np.asarray(np.rint(np.clip(both, -1.0, 1.0) * 32767.0), np.int16)], axis=1)
        whole = pcm.shape[1] // FRAME * FRAME
        self._rest = pcm[:, whole:]
        for at in range(0, whole, FRAME):
            found = self._frame(pcm[0, at : at + FRAME], pcm[0 if self._clean else 1, at : at + FRAME])
            if found is not None:
                yield found

    def flush(self) -> bool:
        """Ends the utterance that is under way; False where there was none."""
        was = self.speaking
        self._end()
        self._rest = np.zeros((2, 0), np.int16)
        return was

    def _frame(self, heard: I16, frame: I16) -> tuple[SpeechStage, I16] | None:
        self._frames += 1
        level = float(np.sqrt(np.mean(heard.astype(np.float32) ** 2)))
        speech = bool(self._vad.is_speech(heard.tobytes())) and level >= _FAINT * self._loudest
        self._recent.append((speech, frame))
        spoken = sum(speech for speech, _ in list(self._recent)[-self._count :])
        if not self.speaking:
            return self._begin() if spoken >= self._needed else None
        self._loudest = max(self._loudest, level)
        self._silent = 0 if speech else self._silent + 1
        if spoken <= self._count - self._needed or self._frames * FRAME_S - self.start_s >= _LONGEST_S:
            self._end()
            return SpeechStage.END, frame
        if self._silent == _EARLY:
            return SpeechStage.PAUSE, frame
        return SpeechStage.SPEECH if speech else SpeechStage.SILENCE, frame

    def _begin(self) -> tuple[SpeechStage, I16]:
        self.speaking = True
        self.start_s = (self._frames - len(self._recent)) * FRAME_S
        self._silent, self._loudest = 0, 0.0
        return SpeechStage.BEGIN, np.concatenate([frame for _, frame in self._recent])

    def _end(self) -> None:
        self.speaking = False
        self._loudest = 0.0
        self._recent.clear()
