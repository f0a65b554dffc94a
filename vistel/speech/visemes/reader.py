"""Reads visemes from a voice as it is captured: a small net over the features that commands are understood from.

How its weights were made stands in `data/visemes.md`.
"""

import numpy as np

from vistel.arrays import F32, F64
from vistel.audio.opus import RATE
from vistel.audio.visemes import VISEMES
from vistel.speech.acoustic import Acoustic, AcousticModel, packaged
from vistel.speech.features import BANDS, LogMel, Normaliser, Resampler


class VisemeReader:
    """Of one voice. It hears 32 ms more than the middle of the frame that it tells of."""

    def __init__(self, model: AcousticModel | None = None) -> None:
        """model: default: that of the package."""
        model = packaged("visemes") if model is None else model
        self._down, self._frames = Resampler(RATE), LogMel()
        self._normal, self._net = Normaliser(model.start_mean), Acoustic(model)
        self._weights: F64 = np.eye(len(VISEMES))[0]
        Normaliser(model.start_mean).feed(np.zeros((1, BANDS), np.float32))  # else its kernel would load at the first word

    def feed(self, samples: F32) -> F64:
        """The next 20 ms at 48 kHz -> (15,) weights of the visemes `SPEECH_BEFORE_NS` before them, sum 1."""
        states = np.exp(self._net.feed(self._normal.feed(self._frames.feed(self._down.feed(samples)))))
        if len(states):
            mean = states.mean(0)
            self._weights = np.array([mean[0], *(mean[1::2] + mean[2::2])], np.float64)
        return self._weights
