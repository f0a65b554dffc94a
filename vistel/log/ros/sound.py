"""The sound of a bag as a voice: messages of audio_common, samples or MP3, to Opus frames of 20 ms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from vistel.arrays import F32
from vistel.audio.levels import Meter
from vistel.audio.opus import FRAME, RATE, Encoder
from vistel.audio.visemes import to_bytes
from vistel.log.ros.bag import Sound
from vistel.log.sensors import SensorError
from vistel.speech.visemes.reader import VisemeReader
from vistel.v1.audio_pb2 import Voice

APART_S = 0.1
"""Sound that comes so much later or earlier than what came before it lets expect begins anew: something was lost [s]."""
RATES_HZ = (4_000, 192_000)
_FORMATS = {"U8": "u1", "S16LE": "<i2", "S32LE": "<i4", "F32LE": "<f4"}
"""GStreamer's names of samples, which recorders of ROS use."""


def voice_of(path: object, sound: Sound) -> Iterator[Voice]:
    """The frames of a voice; `header.t_ns` counts in the bag's time. path: for errors. Raises SensorError for sound that cannot be
    read. A message's time is that of its last sample, since it is made when that is there."""
    source = f"{path}: {sound.topic}"
    if sound.coding.lower() == "mp3" or (not sound.coding and _is_mp3(sound.messages[0][1])):
        pieces = _of_mp3(source, sound.messages)
    else:
        pieces = _of_samples(source, sound)
    try:
        for begin_s, samples in _segments(pieces):
            yield from _frames(begin_s, samples)
    except ImportError as e:
        raise SensorError(f"{source}: sound needs PyAV: pip install 'vistel[ros]'") from e


Piece = tuple[float, F32]
"""When the last sample was captured [s], and samples (n,) at RATE, -1 to 1."""


def _is_mp3(data: bytes) -> bool:
    return data[:3] == b"ID3" or (len(data) > 1 and data[0] == 0xFF and data[1] & 0xE0 == 0xE0)


def _of_samples(source: str, sound: Sound) -> Iterator[Piece]:
    if not sound.rate:
        raise SensorError(
            f"{source}: nothing says how it is sampled; expected a topic of type audio_common_msgs/msg/AudioInfo beside it"
        )
    kind = _FORMATS.get(sound.sample_format.upper())
    if kind is None or sound.coding.lower() not in ("", "wave", "wav", "raw", "pcm"):
        raise SensorError(f"{source}: is {sound.coding} of {sound.sample_format}; expected wave of {', '.join(_FORMATS)}, or mp3")
    if not RATES_HZ[0] <= sound.rate <= RATES_HZ[1] or not 1 <= sound.channels <= 8:
        raise SensorError(
            f"{source}: has {sound.channels} channels at {sound.rate} Hz; expected 1 to 8, at {RATES_HZ[0]} to {RATES_HZ[1]}"
        )
    convert = _Converter()
    whole = np.dtype(kind).itemsize * sound.channels
    for t, data in sound.messages:
        raw = np.frombuffer(data[: len(data) // whole * whole], kind).reshape(-1, sound.channels)
        mono = (raw.astype(np.float32) - (128.0 if kind == "u1" else 0.0)).mean(axis=1)
        scale = 1.0 if kind == "<f4" else float(1 << (8 * np.dtype(kind).itemsize - 1))
        yield t, convert(np.nan_to_num(mono / np.float32(scale)), sound.rate)


def _of_mp3(source: str, messages: Sequence[tuple[float, bytes]]) -> Iterator[Piece]:
    import av
    from av.error import FFmpegError

    codec: Any = av.CodecContext.create("mp3float", "r")
    convert, heard = _Converter(), False
    for t, data in messages:
        parts: list[F32] = []
        try:
            for frame in (f for packet in codec.parse(data) for f in codec.decode(packet)):
                parts.append(convert(frame.to_ndarray().mean(axis=0), frame.sample_rate))
        except FFmpegError:
            continue  # a piece that was lost; the next begins anew
        if parts:
            heard = True
            yield t, np.concatenate(parts)
    if not heard:
        raise SensorError(f"{source}: cannot be read as MP3")


class _Converter:
    """From a rate to RATE, piece by piece."""

    def __init__(self) -> None:
        self._resampler: Any = None

    def __call__(self, samples: F32, rate: int) -> F32:
        import av

        if rate == RATE or not len(samples):
            return np.asarray(samples, np.float32)
        self._resampler = self._resampler or av.AudioResampler(format="flt", layout="mono", rate=RATE)
        frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(samples, np.float32)[None], format="flt", layout="mono")
        frame.sample_rate = rate
        out = [f.to_ndarray()[0] for f in self._resampler.resample(frame)]
        return np.concatenate(out) if out else np.zeros(0, np.float32)


def _segments(pieces: Iterator[Piece]) -> Iterator[tuple[float, F32]]:
    """Sound without gaps: when its first sample was captured [s], and all of it. The clock of the sound card counts within it, the
    times of messages, which come irregularly, only for where it begins: as early as all its messages allow."""
    begun: list[float] = []
    held: list[F32] = []
    count = 0
    for t, samples in pieces:
        begin = t - (count + len(samples)) / RATE
        if held and abs(begin - float(np.median(begun[-50:]))) > APART_S:
            yield min(begun), np.concatenate(held)
            begun, held, count = [], [], 0
            begin = t - len(samples) / RATE
        begun.append(begin)
        held.append(samples)
        count += len(samples)
    if held:
        yield min(begun), np.concatenate(held)


def _frames(begin_s: float, samples: F32) -> Iterator[Voice]:
    encoder, meter, reader = Encoder(dtx=False), Meter(), VisemeReader()
    for at in range(0, len(samples) - FRAME + 1, FRAME):
        frame = samples[at : at + FRAME]
        level = meter.measure(frame)
        message = Voice(opus=encoder.encode(frame), level_db=level.rms_db, clipped=level.clipped, talking=level.talking)
        message.visemes = to_bytes(reader.feed(frame))
        message.header.t_ns = round((begin_s + at / RATE) * 1e9) - encoder.lookahead_ns
        yield message
