"""Reads sound from files."""

import logging
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError

from vistel.arrays import F32
from vistel.audio.capture import SoundDeviceError

log = logging.getLogger("vistel.audio")

_LOWEST = 8_000
"""Samples per second below which a recording is refused."""
_HIGHEST = 96_000
"""Samples per second above which a recording is refused."""
_LONGEST_S = 900.0


def read_recording(path: Path) -> tuple[F32, float]:
    """(n,) samples, mono, and their rate. Raises SoundDeviceError."""
    try:
        with av.open(str(path)) as container:
            if not container.streams.audio:
                raise SoundDeviceError(f"{path}: has no sound")
            rate = container.streams.audio[0].rate
            if not _LOWEST <= rate <= _HIGHEST:
                raise SoundDeviceError(f"{path}: expected 8000 to 96000 samples per second, got {rate}; convert it")
            convert = av.AudioResampler(format="flt", layout="mono", rate=rate)
            parts: list[F32] = []
            length = 0
            for frame in container.decode(audio=0):
                for out in convert.resample(frame):
                    parts.append(out.to_ndarray().reshape(-1).astype(np.float32))
                    length += len(parts[-1])
                if length > _LONGEST_S * rate:
                    log.warning("event=recording_cut path=%s after_s=%.0f", path, _LONGEST_S)
                    break
    except (FFmpegError, OSError) as e:
        raise SoundDeviceError(f"{path}: cannot be read as sound: {e}") from e
    if not length:
        raise SoundDeviceError(f"{path}: has no samples")
    return np.concatenate(parts), float(rate)
