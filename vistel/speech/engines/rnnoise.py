"""RNNoise (Valin 2018, BSD): a small recurrent net that takes noise out of speech. Its library and weights are inside the package
pyrnnoise (Apache-2.0); nothing else of that package is used, nor what it depends on.
"""

import ctypes
import importlib.util
import sys
import weakref
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F32
from vistel.speech.engines.engine import EngineError

PACKAGE = "pyrnnoise==0.4.3"
FRAME = 160
"""Samples at 16 kHz that it takes at a time: 10 ms."""
_FULL = 32768.0
_TIMES = 3
"""RNNoise hears at 48 kHz."""
_HALF = 24
"""Samples at 48 kHz on either side that a sample is interpolated from."""
_NAMES = {"linux": "librnnoise.so", "darwin": "librnnoise.dylib", "win32": "rnnoise.dll"}
_Floats = ctypes.POINTER(ctypes.c_float)


def _low_pass() -> F32:
    at = np.arange(-_HALF, _HALF + 1)
    return np.asarray(np.sinc(0.95 * at / _TIMES) * np.kaiser(len(at), 6.0) * 0.95 / _TIMES, np.float32)


_FILTER = _low_pass()


@cache
def library() -> Any:
    """Raises EngineError where the package is not installed or holds no library for this machine."""
    found = importlib.util.find_spec("pyrnnoise")  # not imported: its own imports are many
    if found is None or found.origin is None:
        raise EngineError(f"RNNoise is not installed; noise is taken out less well; pip install --no-deps {PACKAGE}")
    path = Path(found.origin).with_name(_NAMES.get(sys.platform, "librnnoise.so"))
    try:
        loaded = ctypes.CDLL(str(path))
        loaded.rnnoise_create.restype, loaded.rnnoise_create.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
        loaded.rnnoise_destroy.restype, loaded.rnnoise_destroy.argtypes = None, [ctypes.c_void_p]
        loaded.rnnoise_process_frame.restype = ctypes.c_float
        loaded.rnnoise_process_frame.argtypes = [ctypes.c_void_p, _Floats, _Floats]
    except (OSError, AttributeError) as e:
        raise EngineError(f"RNNoise cannot be loaded: {e}; pip install --no-deps {PACKAGE}") from e
    if loaded.rnnoise_get_frame_size() != _TIMES * FRAME:
        raise EngineError(f"RNNoise takes frames of another length; pip install --no-deps {PACKAGE}")
    return loaded


class RnNoise:
    """A stream at 16 kHz without its noise, some 20 ms late. Raises EngineError."""

    def __init__(self) -> None:
        self._library = library()
        self._state = self._library.rnnoise_create(None)
        weakref.finalize(self, self._library.rnnoise_destroy, self._state)
        self._in = np.zeros(2 * _HALF, np.float32)
        self._out = np.zeros(2 * _HALF, np.float32)

    def feed(self, sound: F32) -> F32:
        """(n,) -> (n,); n is a multiple of FRAME."""
        wide = np.zeros(_TIMES * len(sound), np.float32)
        wide[::_TIMES] = _TIMES * _FULL * sound
        wide, self._in = _filtered(wide, self._in)
        for at in range(0, len(wide), _TIMES * FRAME):
            frame = wide[at:].ctypes.data_as(_Floats)
            self._library.rnnoise_process_frame(self._state, frame, frame)
        wide, self._out = _filtered(wide, self._out)
        return np.asarray(wide[::_TIMES] / np.float32(_FULL), np.float32)


def _filtered(sound: F32, before: F32) -> tuple[F32, F32]:
    """Through the low pass; what must be known of it next time."""
    whole = np.concatenate([before, sound])
    return np.asarray(np.convolve(whole, _FILTER, "valid"), np.float32), whole[len(sound) :]
