"""How well mouths follow voices that no net was made with: `python -m scripts.viseme_model.judge choose`, one JSON object a voice.

Each sentence goes through what a microphone's voice goes through, in packets of 20 ms, to the mouth of a figure that follows it.
That is compared with the mouth that the same rules make at once of what the synthesiser says was said; so is the mouth that knows
the loudness alone.
"""

import argparse
import json
from collections import defaultdict
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from scripts.speech_model.rooms import level
from scripts.speech_model.voices import RATE, Spoken, resampled
from scripts.viseme_model.corpus import held_out
from vistel.arrays import F32, F64
from vistel.audio.heard_voices import HeardVoices, Speech
from vistel.audio.levels import Meter
from vistel.audio.opus import FRAME, FRAME_NS
from vistel.audio.opus import RATE as VOICE_RATE
from vistel.audio.visemes import VISEMES, to_bytes
from vistel.figure.face.countenance import Countenance
from vistel.figure.face.intensities import by_visemes
from vistel.figure.face.marks import MARK_INDEX
from vistel.figure.face.rules import builtin_rules
from vistel.figure.posture.posture import Posture
from vistel.speech.acoustic import load, model_file
from vistel.speech.visemes.reader import VisemeReader
from vistel.v1.audio_pb2 import Voice

STEP_NS = 10_000_000
_LAGS = range(-12, 13)
"""Steps by which two mouths are moved against each other."""
_SHUT_M = 0.0015
"""Between lips that look shut."""
_NEAR = 3
"""Steps round a p, b or m in which lips that shut, shut for it."""
_RULES = builtin_rules()
_PARTS = np.array([u.pattern[MARK_INDEX["upper_lip"], 1] - u.pattern[MARK_INDEX["lower_lip"], 1] for u in _RULES.units])
"""By how much each unit parts the lips [m]."""
_VOWELS = ("aa", "E", "ih", "oh", "ou")


def score(spoken: Spoken, model: Path) -> dict[str, float]:
    """Of one sentence, in quiet. right: frames with the right viseme; correlation: of both mouths' opening; late_ms: of the one
    that was read, where they agree most; shut: of the p, b and m, how many shut the lips; shut_wrongly: of vowels."""
    voices, sound = HeardVoices(), spoken.sound * np.float32(0.05 / level(spoken.sound))
    for message in messages(sound, model):
        voices.receive("", message)
    times = range(0, int(len(sound) / RATE * 1e9), STEP_NS)
    heard = [voices.at("", 1 + t_ns) for t_ns in times]
    true = [said(spoken, t_ns) for t_ns in times]
    loud = [h.level_db if h else -50.0 for h in heard]
    told = [Speech(db, np.eye(len(VISEMES))[VISEMES.index(v)]) for db, v in zip(loud, true, strict=True)]
    best = [VISEMES[0] if h is None or h.visemes is None else VISEMES[int(h.visemes.argmax())] for h in heard]
    mouth, true_mouth = openings(heard), np.array([_apart(by_visemes(_RULES, each)) for each in told])
    correlation, late_ms = agreement(mouth, true_mouth)
    by_loudness = openings([h and Speech(h.level_db) for h in heard])
    return {
        "right": float(np.mean([a == b for a, b in zip(best, true, strict=True)])),
        "correlation": correlation,
        "late_ms": late_ms,
        "correlation_by_loudness": agreement(by_loudness, true_mouth)[0],
        "shut": _shut(mouth, true),
        "shut_wrongly": float(np.mean(mouth[_within_vowels(true)] < _SHUT_M)),
    }


def messages(sound: F32, model: Path) -> list[Voice]:
    """What a microphone that hears the sound sends."""
    at_48k, reader, meter = resampled(sound, RATE / VOICE_RATE), VisemeReader(load(model)), Meter()
    out: list[Voice] = []
    for n in range(len(at_48k) // FRAME):
        samples = at_48k[n * FRAME : (n + 1) * FRAME]
        heard = meter.measure(samples)
        out.append(Voice(level_db=heard.rms_db, talking=heard.talking, visemes=to_bytes(reader.feed(samples))))
        out[-1].header.t_ns = 1 + n * FRAME_NS
    return out


def said(spoken: Spoken, t_ns: int) -> str:
    """The viseme of what is said then."""
    assert spoken.ends_s is not None
    at = int(np.searchsorted(spoken.ends_s, t_ns * 1e-9, side="right"))
    return spoken.phones[at] if at < len(spoken.phones) else VISEMES[0]


def openings(speech: Sequence[Speech | None]) -> F64:
    """How far apart the lips of a figure that follows are at each step [m]."""
    face = Countenance()
    return np.array([_apart(face.step(Posture(), n * STEP_NS, now).expression.intensity) for n, now in enumerate(speech)])


def _apart(intensity: F64) -> float:
    return float(intensity @ _PARTS)


def agreement(mouth: F64, true: F64) -> tuple[float, float]:
    """The largest correlation of two mouths, and how much later the first one is then [ms]."""
    most = max(_LAGS)
    middle = true[most : len(true) - most]
    found = [float(np.corrcoef(mouth[most + lag : len(mouth) - most + lag], middle)[0, 1]) for lag in _LAGS]
    best = int(np.nanargmax(found))
    return found[best], _LAGS[best] * STEP_NS * 1e-6


def _shut(mouth: F64, true: list[str]) -> float:
    at, shut = 0, list[bool]()
    for viseme, run in groupby(true):
        length = len(list(run))
        if viseme == "PP":
            shut.append(bool(mouth[max(0, at - _NEAR) : at + length + _NEAR].min() < _SHUT_M))
        at += length
    return float(np.mean(shut)) if shut else np.nan


def _within_vowels(true: list[str]) -> list[int]:
    """Steps with the same vowel before and after them."""
    near = range(-_NEAR, _NEAR + 1)
    return [n for n in range(_NEAR, len(true) - _NEAR) if true[n] in _VOWELS and all(true[n + k] in _VOWELS for k in near)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", choices=("choose", "report"))
    parser.add_argument("--model", type=Path, default=model_file("visemes"), help="default: that of the package")
    given = parser.parse_args()
    found: dict[str, list[dict[str, float]]] = defaultdict(list)
    for voice, spoken in held_out(given.set):
        found[voice].append(score(spoken, given.model))
    for voice, rows in found.items():
        mean = {key: round(float(np.nanmean([row[key] for row in rows])), 3) for key in rows[0]}
        worst = max(abs(row["late_ms"]) for row in rows)
        print(json.dumps({"voice": voice, "sentences": len(rows), **mean, "most_late_ms": worst}))
    return 0


if __name__ == "__main__":
    main()
