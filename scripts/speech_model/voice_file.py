"""Voice files of HTS made alike, so that `hts_engine` can speak with any mixture of them.

Voices of several makers differ in how finely they describe the spectrum and in whether they hold what is needed to keep
its variance ("global variance"). The finer ones are cut to the coarsest and the variance is left out.
"""

import re
from pathlib import Path

import numpy as np

ORDER = 35
"""Mel-cepstral coefficients that are kept."""
_WINDOWS = 3
_STATES = 5
_KEPT = ("DURATION_PDF", "DURATION_TREE", "STREAM_WIN", "STREAM_PDF", "STREAM_TREE")
_STREAMS = ("MCP", "LF0", "LPF")


def alike(source: Path, target: Path) -> None:
    """Writes the voice anew with ORDER coefficients and without global variance. Raises ValueError, one line, where the
    file is no voice of this kind."""
    head, _, data = source.read_bytes().partition(b"[DATA]\n")
    text = head.decode("ascii", errors="replace")
    found = re.search(r"VECTOR_LENGTH\[(MCP|MGC)\]:(\d+)", text)
    if found is None or int(found[2]) < ORDER or f"NUM_STATES:{_STATES}\n" not in text or "ALPHA=0.55" not in text:
        raise ValueError(f"voice {source}: expected {_STATES} states and {ORDER} or more mel-cepstral coefficients at 0.55")
    spectrum, length = found[1], int(found[2])
    positions: list[str] = []
    parts: list[bytes] = []
    at = 0
    for name in _KEPT:
        for stream in ("",) if name.startswith("DURATION") else _STREAMS:
            here = f"[{spectrum if stream == 'MCP' else stream}]" if stream else ""
            line = re.search(rf"^{re.escape(name + here)}:(.*)$", text, re.MULTILINE)
            if line is None:
                raise ValueError(f"voice {source}: lacks {name}{here}")
            spans = [tuple(map(int, span.split("-"))) for span in line[1].split(",")]
            some = [data[begin : end + 1] for begin, end in spans]
            if (name, stream) == ("STREAM_PDF", "MCP"):
                some = [_cut(some[0], length)]
            places: list[str] = []
            for part in some:
                places.append(f"{at}-{at + len(part) - 1}")
                parts.append(part)
                at += len(part)
            positions.append(f"{name}{f'[{stream}]' if stream else ''}:{','.join(places)}\n")
    target.write_bytes((_HEAD + "".join(positions) + "[DATA]\n").encode() + b"".join(parts))


def _cut(pdfs: bytes, length: int) -> bytes:
    """Distributions of the spectrum with only the first ORDER coefficients: counts by state, then means and variances."""
    counts = pdfs[: 4 * _STATES]
    values = np.frombuffer(pdfs, np.float32, offset=4 * _STATES).reshape(-1, 2, _WINDOWS, length)
    return counts + values[..., :ORDER].tobytes()


_HEAD = f"""[GLOBAL]
HTS_VOICE_VERSION:1.0
SAMPLING_FREQUENCY:48000
FRAME_PERIOD:240
NUM_STATES:{_STATES}
NUM_STREAMS:3
STREAM_TYPE:MCP,LF0,LPF
FULLCONTEXT_FORMAT:HTS_TTS_JPN
FULLCONTEXT_VERSION:1.0
GV_OFF_CONTEXT:
COMMENT:
[STREAM]
VECTOR_LENGTH[MCP]:{ORDER}
VECTOR_LENGTH[LF0]:1
VECTOR_LENGTH[LPF]:31
IS_MSD[MCP]:0
IS_MSD[LF0]:1
IS_MSD[LPF]:0
NUM_WINDOWS[MCP]:{_WINDOWS}
NUM_WINDOWS[LF0]:3
NUM_WINDOWS[LPF]:1
USE_GV[MCP]:0
USE_GV[LF0]:0
USE_GV[LPF]:0
OPTION[MCP]:ALPHA=0.55
OPTION[LF0]:
OPTION[LPF]:
[POSITION]
"""
