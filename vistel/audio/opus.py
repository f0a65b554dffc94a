"""Opus (RFC 6716) by the reference library: that in PyAV's wheel, or else the system's.

It is called directly, since FFmpeg's wrapper neither conceals a lost frame nor reads the copy in the next packet.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import importlib.util
from functools import cache
from pathlib import Path

import numpy as np

from vistel.arrays import F32

RATE = 48_000
"""Sample rate of all sound between capture and playback [Hz]."""
FRAME = 960
"""Samples of a frame."""
FRAME_NS = 20_000_000

_MOST_BYTES = 1500
# Of opus_defines.h: kinds of sound, and requests to an encoder.
_VOIP = 2048  # OPUS_APPLICATION_VOIP: speech
_AUDIO = 2049  # OPUS_APPLICATION_AUDIO: any sound
_SET_BITRATE = 4002  # bits per second
_SET_COMPLEXITY = 4010  # 0 to 10
_SET_FEC = 4012  # 1: packets repeat the one before, for a receiver that lost it
_SET_LOSS = 4014  # expected share of lost packets [%]
_SET_DTX = 4016  # 1: silence is not sent
_GET_LOOKAHEAD = 4027  # samples by which the encoder delays


class OpusError(RuntimeError):
    """The codec is missing or refuses its input; one line."""


@cache
def library() -> ctypes.CDLL:
    """The loaded library. Raises OpusError where it is missing."""
    for path in _candidates():
        try:
            found = ctypes.CDLL(path)
        except OSError:
            continue
        found.opus_encoder_create.restype = ctypes.c_void_p
        found.opus_decoder_create.restype = ctypes.c_void_p
        found.opus_get_version_string.restype = ctypes.c_char_p
        for name in ("opus_encoder_destroy", "opus_decoder_destroy"):
            getattr(found, name).argtypes = [ctypes.c_void_p]
        return found
    raise OpusError("libopus is missing: pip install av, or install the system's libopus")


def _candidates() -> list[str]:
    spec = importlib.util.find_spec("av")
    folder = Path(spec.origin).parent if spec is not None and spec.origin else None
    out: list[str] = []
    if folder is not None:
        for place in (folder.parent / "av.libs", folder / ".dylibs"):
            out += sorted(str(p) for p in place.glob("*opus*"))
    system = ctypes.util.find_library("opus")
    return [*out, system] if system else out


def version() -> str:
    """The library's version, such as "libopus 1.6.1". Raises OpusError."""
    return str(library().opus_get_version_string().decode("ascii"))


class Encoder:
    """Encodes one stream. voice: tuned for speech, with a coarse copy of each frame in the next packet (in-band FEC)."""

    def __init__(
        self,
        channels: int = 1,
        bitrate: int = 24_000,
        *,
        voice: bool = True,
        complexity: int = 2,
        expected_loss_percent: int = 10,
        dtx: bool = True,
    ) -> None:
        self._lib = library()
        error = ctypes.c_int()
        handle = self._lib.opus_encoder_create(RATE, channels, _VOIP if voice else _AUDIO, ctypes.byref(error))
        if not handle:
            raise OpusError(f"opus: no encoder for {channels} channels (error {error.value})")
        self._handle = ctypes.c_void_p(handle)
        self._channels = channels
        self._packet = ctypes.create_string_buffer(_MOST_BYTES)
        settings = [(_SET_BITRATE, bitrate), (_SET_COMPLEXITY, complexity), (_SET_DTX, int(dtx))]
        if voice:
            settings += [(_SET_FEC, 1), (_SET_LOSS, expected_loss_percent)]
        for request, value in settings:
            if self._lib.opus_encoder_ctl(self._handle, request, ctypes.c_int(value)) != 0:
                raise OpusError(f"opus: the encoder refused setting {request} = {value}")
        lookahead = ctypes.c_int()
        self._lib.opus_encoder_ctl(self._handle, _GET_LOOKAHEAD, ctypes.byref(lookahead))
        self.lookahead_ns = lookahead.value * 1_000_000_000 // RATE
        """The first decoded sample of a packet is this much earlier than the first sample of its frame."""

    def __del__(self) -> None:
        if hasattr(self, "_handle"):
            self._lib.opus_encoder_destroy(self._handle)

    def set_bitrate(self, bitrate: int) -> None:
        """Bits a second from the next frame on."""
        if self._lib.opus_encoder_ctl(self._handle, _SET_BITRATE, ctypes.c_int(bitrate)) != 0:
            raise OpusError(f"opus: the encoder refused setting {_SET_BITRATE} = {bitrate}")

    def encode(self, pcm: F32) -> bytes:
        """The packet of a frame: (FRAME,) or (FRAME, channels), -1 to 1. One of at most two bytes is silence."""
        frame = np.ascontiguousarray(pcm, np.float32)
        if frame.size != FRAME * self._channels:
            raise ValueError(f"opus: expected {FRAME} samples of {self._channels} channels, got {frame.shape}")
        size = self._lib.opus_encode_float(self._handle, frame.ctypes.data_as(ctypes.c_void_p), FRAME, self._packet, _MOST_BYTES)
        if size < 0:
            raise OpusError(f"opus: a frame could not be encoded (error {size})")
        return self._packet.raw[:size]


class Decoder:
    """Decodes one stream, packet by packet; lost ones are recovered or concealed."""

    def __init__(self, channels: int = 1) -> None:
        self._lib = library()
        error = ctypes.c_int()
        handle = self._lib.opus_decoder_create(RATE, channels, ctypes.byref(error))
        if not handle:
            raise OpusError(f"opus: no decoder for {channels} channels (error {error.value})")
        self._handle = ctypes.c_void_p(handle)
        self._shape = (FRAME,) if channels == 1 else (FRAME, channels)

    def __del__(self) -> None:
        if hasattr(self, "_handle"):
            self._lib.opus_decoder_destroy(self._handle)

    def decode(self, packet: bytes) -> F32:
        """The frame of a packet. Raises OpusError for bytes that are no packet of 20 ms."""
        return self._decode(packet, 0)

    def recover(self, following: bytes) -> F32:
        """A lost frame from the copy in the packet after it; where that has none, as `conceal`."""
        return self._decode(following, 1)

    def carries_previous(self, packet: bytes) -> bool:
        """Whether a packet has a copy of the frame before it; False if the library is too old to know."""
        look = getattr(self._lib, "opus_packet_has_lbrr", None)
        return look is not None and look(packet, len(packet)) == 1

    def conceal(self) -> F32:
        """A synthetic frame in place of a lost one."""
        return self._decode(b"", 0)

    def _decode(self, packet: bytes, fec: int) -> F32:
        out = np.zeros(self._shape, np.float32)
        count = self._lib.opus_decode_float(
            self._handle, packet or None, len(packet), out.ctypes.data_as(ctypes.c_void_p), FRAME, fec
        )
        if count != FRAME:
            raise OpusError(f"opus: a packet of {len(packet)} bytes is no frame of 20 ms ({count})")
        return out
