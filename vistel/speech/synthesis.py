"""Speech from text, by the synthesisers a machine has: espeak-ng, flite. For replies, simulated talkers and measurements."""

import re
import shutil
import subprocess
import tempfile
import wave
from functools import lru_cache
from pathlib import Path

import numpy as np

from vistel.arrays import F32
from vistel.speech.grammar import Language

_PATIENCE_S = 20.0
PLAIN: dict[Language, str] = {"ja": "espeak-ng:ja", "en": "espeak-ng:en-us"}
"""The voice of a language where no other is named."""
_KANJI = re.compile("[\u4e00-\u9fff]")


class SynthesisError(RuntimeError):
    """A text cannot be synthesised here; one line."""


@lru_cache
def voices() -> frozenset[str]:
    """The synthesisers that are installed; of flite also its voices."""
    found = {name for name in ("espeak-ng", "flite") if shutil.which(name)}
    if "flite" in found:
        listed = subprocess.run(["flite", "-lv"], capture_output=True, text=True, check=False, timeout=_PATIENCE_S).stdout
        found |= {f"flite:{name}" for name in listed.partition(":")[2].split()}
    return frozenset(found)


def synthesise(text: str, voice: str, *, words_per_minute: int = 160) -> tuple[F32, float]:
    """(n,) sound of a text, -1 to 1, and its rate [Hz]. voice: "espeak-ng:VOICE" or "flite:VOICE". Raises SynthesisError."""
    program, _, name = voice.partition(":")
    path = shutil.which(program) if program in ("espeak-ng", "flite") else None
    if path is None:
        raise SynthesisError(f"{voice}: {program} is not installed (apt-get install {program})")
    if program == "espeak-ng" and name.startswith("ja") and _KANJI.search(text):
        raise SynthesisError(f"{text!r}: espeak-ng reads kana, no kanji")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "said.wav"
        arguments = {
            "espeak-ng": ["-v", name, "-s", str(words_per_minute), "-w", str(out), "--", text],
            "flite": ["-voice", name, "-t", text, "-o", str(out)],
        }[program]
        try:
            done = subprocess.run([path, *arguments], capture_output=True, text=True, check=False, timeout=_PATIENCE_S)
        except (OSError, subprocess.TimeoutExpired) as e:
            raise SynthesisError(f"{voice}: {e}") from e
        if done.returncode or not out.is_file():
            raise SynthesisError(f"{voice}: {done.stderr.strip() or 'nothing was said'}")
        with wave.open(str(out)) as w:
            pcm = np.frombuffer(w.readframes(w.getnframes()), "<i2").astype(np.float32) / 32768.0
            return pcm, float(w.getframerate())
