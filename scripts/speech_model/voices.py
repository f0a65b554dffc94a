"""Synthetic voices: Open JTalk with voices found in folders, espeak-ng, flite, SVOX Pico.

Voices are looked for, never shipped: `VISTEL_VOICES` names folders with *.htsvoice (colon between them); Debian's
/usr/share/hts-voice and the voice inside the Python package pyopenjtalk-plus are found without it.
"""

import importlib
import importlib.util
import os
import shutil
import subprocess
import tempfile
import wave
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.speech.phones import label_phones

RATE = 16000
_DICTIONARIES = (Path("/var/lib/mecab/dic/open-jtalk/naist-jdic"), Path("/usr/share/open_jtalk/dic"))


@dataclass(frozen=True)
class Spoken:
    """sound: (n,) float32 at 16 kHz, full scale 1; phones: names; ends_s: (phones,) where each ends [s], or None."""

    sound: F32
    phones: tuple[str, ...]
    ends_s: NDArray[np.float64] | None


@dataclass(frozen=True)
class Manner:
    """How a voice speaks. rate: times the usual; semitones: pitch; warp: all-pass constant less the voice's own
    (above 0 a longer throat); liveliness: of the melody and of the spectrum; breath: 0.5 is usual, above it less is voiced,
    1 is a whisper; edge: 0 to 1, how far peaks of the spectrum are made sharper."""

    rate: float = 1.0
    semitones: float = 0.0
    warp: float = 0.0
    liveliness: float = 1.0
    breath: float = 0.5
    edge: float = 0.0

    def options(self) -> list[str]:
        """As both open_jtalk and hts_engine take them."""
        lively = f"-jm {0.5 + 0.5 * self.liveliness:.3f} -jf {self.liveliness:.3f}"
        voice = f"-a {0.55 + self.warp:.3f} -fm {self.semitones:.2f} -r {self.rate:.3f} -u {self.breath:.3f} -b {self.edge:.3f}"
        return f"{voice} {lively}".split()


def drawn(random: np.random.Generator) -> Manner:
    return Manner(
        float(random.uniform(0.75, 1.3)),
        float(random.uniform(-5.0, 6.0)),
        float(random.uniform(-0.07, 0.07)),
        float(random.uniform(0.4, 1.3)),
        1.0 if random.random() < 0.04 else float(random.uniform(0.3, 0.85)),
        float(random.uniform(0.0, 0.4)),
    )


@cache
def hts_voices() -> dict[str, Path]:
    """Voice files by name."""
    folders = [Path(each) for each in os.environ.get("VISTEL_VOICES", "").split(":") if each]
    folders.append(Path("/usr/share/hts-voice"))
    package = importlib.util.find_spec("pyopenjtalk")
    if package is not None and package.origin is not None:
        folders.append(Path(package.origin).parent)
    found: dict[str, Path] = {}
    for folder in folders:
        for path in sorted(folder.rglob("*.htsvoice")):
            found.setdefault(path.stem, path)
    return found


def missing() -> str | None:
    """Why Japanese cannot be synthesised here, in one line; None where it can."""
    if shutil.which("open_jtalk") is None or _dictionary() is None:
        return "no Open JTalk here; install it with: apt install open-jtalk open-jtalk-mecab-naist-jdic"
    if not hts_voices():
        return "no Open JTalk voice here; name a folder with *.htsvoice in VISTEL_VOICES, or pip install pyopenjtalk-plus"
    return None


def _dictionary() -> Path | None:
    return next((path for path in _DICTIONARIES if path.is_dir()), None)


def open_jtalk(text: str, voice: Path, manner: Manner) -> Spoken:
    """Open JTalk's speech with the times of its phones. Raises RuntimeError that names what it would not say."""
    with tempfile.TemporaryDirectory() as folder:
        wav, trace = Path(folder) / "speech.wav", Path(folder) / "trace"
        command = ["open_jtalk", "-x", str(_dictionary()), "-m", str(voice), "-ow", str(wav), "-ot", str(trace), *manner.options()]
        _run(command, text, wav)
        listing = trace.read_text(errors="replace").split("[Output label]")[1].split("\n\n")[0]
        return Spoken(_read(wav), *_timed(listing))


def mixed(text: str, shares: dict[str, float], folder: Path, manner: Manner) -> Spoken:
    """The speech of somebody between the voices named, by their shares; `folder` holds them made alike (`voice_file.py`)."""
    with tempfile.TemporaryDirectory() as scratch:
        wav, trace, labels, timed = (Path(scratch) / name for name in ("speech.wav", "trace", "labels", "timed"))
        voices = [folder / f"{name}.htsvoice" for name in shares]
        fast = ["-r", "20"]
        read = ["open_jtalk", "-x", str(_dictionary()), "-m", str(voices[0]), "-ow", str(wav), "-ot", str(trace), *fast]
        _run(read, text, wav)
        listing = trace.read_text(errors="replace").split("[Output label]")[1].split("\n\n")[0]
        labels.write_text("".join(f"{line.split()[2]}\n" for line in listing.split("\n") if len(line.split()) == 3))
        named = [word for voice in voices for word in ("-m", str(voice))]
        weights = [f"{share:.4f}" for share in shares.values()]
        speak = ["hts_engine", *named, "-i", str(len(shares)), *weights, "-ow", str(wav), "-od", str(timed), *manner.options()]
        wav.unlink()
        _run([*speak, str(labels)], text, wav)
        return Spoken(_read(wav), *_timed(timed.read_text()))


def _run(command: list[str], text: str, wav: Path) -> str:
    done = subprocess.run(command, input=text.encode(), capture_output=True, check=False)
    if done.returncode != 0 or not wav.is_file():
        raise RuntimeError(f"{command[0]} said nothing for {text!r}: {done.stderr.decode(errors='replace').strip()}")
    return done.stdout.decode(errors="replace")


def _timed(listing: str) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Phones of labels with times, and where each ends [s]."""
    phones: list[str] = []
    ends: list[float] = []
    for line in listing.split("\n"):
        fields = line.split()
        if len(fields) == 3:
            begin, end = int(fields[0]) * 1e-7, int(fields[1]) * 1e-7
            said = label_phones(fields[2].split("-", 1)[1].split("+", 1)[0])
            for k, phone in enumerate(said):
                phones.append(phone)
                ends.append(begin + (end - begin) * (k + 1) / len(said))
    return tuple(phones), np.array(ends)


def espeak(text: str, voice: str, words_per_minute: int, pitch: int) -> F32:
    """espeak-ng's speech for English text, or Japanese in kana; voice: as "ja+m1", language and variant."""
    with tempfile.TemporaryDirectory() as folder:
        wav = Path(folder) / "speech.wav"
        command = ["espeak-ng", "-v", voice, "-s", str(words_per_minute), "-p", str(pitch), "-w", str(wav), text]
        _run(command, text, wav)
        return _read(wav)


def flite(text: str, voice: str, slowness: float) -> F32:
    """Speech of a voice of flite, so many times slower than it is by itself."""
    with tempfile.TemporaryDirectory() as folder:
        wav = Path(folder) / "speech.wav"
        command = ["flite", "-voice", voice, "--setf", f"duration_stretch={slowness:.3f}", "-t", text, "-o", str(wav)]
        _run(command, text, wav)
        return _read(wav)


def flite_timed(text: str, voice: str, slowness: float) -> tuple[F32, list[tuple[str, float]]]:
    """As `flite`, and its own names of the phones with where each ends [s]."""
    with tempfile.TemporaryDirectory() as folder:
        wav = Path(folder) / "speech.wav"
        command = ["flite", "-voice", voice, "--setf", f"duration_stretch={slowness:.3f}", "-psdur", "-t", text, "-o", str(wav)]
        listing = _run(command, text, wav)
        ends = [each.split(":") for each in listing.split()]
        return _read(wav), [(name, float(end)) for name, end in ends]


def pico(text: str, language: str, speed: float, pitch: float) -> F32:
    """English by SVOX Pico, language "en-US" or "en-GB", a woman each; raises ImportError without the package py-nanotts."""
    sound = importlib.import_module("py_nanotts").NanoTTS().speak(text, voice=language, speed=speed, pitch=pitch)
    return np.frombuffer(sound, np.int16).astype(np.float32) / np.float32(32768.0)


def _read(path: Path) -> F32:
    with wave.open(str(path)) as file:
        sound = np.frombuffer(file.readframes(file.getnframes()), np.int16).astype(np.float32) / 32768.0
        return resampled(sound, file.getframerate() / RATE)


def resampled(sound: F32, step: float) -> F32:
    """`sound` read `step` of its samples apart (to 0.1 %): above 1 it gets shorter, and higher if played as before."""
    if step == 1.0:
        return sound
    count = int(len(sound) / step)
    length = 3 << max(9, ((len(sound) + 512) // 3).bit_length())
    target = 256 * round(length / step / 256)
    spectrum = np.fft.rfft(sound, length)
    short = np.zeros(target // 2 + 1, np.complex64)
    bins = min(len(spectrum), len(short))
    short[:bins] = spectrum[:bins]
    return (np.fft.irfft(short, target)[:count] * np.float32(target / length)).astype(np.float32)
