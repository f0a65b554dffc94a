"""Times for the speech of a synthesiser that tells none."""

import numpy as np

from scripts.speech_model.rooms import level
from scripts.speech_model.voices import RATE, Spoken
from vistel.speech.acoustic import Acoustic, AcousticModel
from vistel.speech.alignment import align, chain_of
from vistel.speech.features import FRAME_S, LogMel, Normaliser

_WORST = -2.2
"""Mean log posterior under which an alignment is not believed."""


def aligned(model: AcousticModel, spoken: Spoken) -> Spoken | None:
    """The utterance with times, quiet added around it; None where it does not fit well."""
    pad = np.zeros(RATE // 5, np.float32)
    sound = np.concatenate([pad, spoken.sound * np.float32(0.05 / level(spoken.sound)), pad])
    frames = Normaliser(model.start_mean).feed(LogMel().feed(sound))
    scores = Acoustic(model).feed_all(frames)
    states, owner = chain_of(spoken.phones, model.phones)
    path, fit = align(scores, states)
    if not fit > _WORST:
        return None
    ends = np.searchsorted(owner[path], np.arange(len(spoken.phones)), side="right")
    return Spoken(sound, spoken.phones, np.minimum((ends + 0.75) * FRAME_S, len(sound) / RATE))
