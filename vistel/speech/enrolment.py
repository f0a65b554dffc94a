"""A user's voice learnt from some minutes of reading: a transform of its frames before the net (`Adaptation`).

One matrix and one shift for all frames are found so that the unchanged net gives the sounds that were read the highest probability:
a linear input layer, regularised towards the identity. Five minutes of speech are enough for that and for no more. Each language
has a net of its own, so what is learnt of a voice is learnt in one language."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.speech.acoustic import Acoustic, AcousticModel, Adaptation
from vistel.speech.alignment import align, chain_of
from vistel.speech.features import BANDS, LogMel, Normaliser, as_float
from vistel.speech.grammar import LANGUAGES, Language
from vistel.speech.phones import PAUSE
from vistel.speech.recognition import Samples

VERSION = 2
_FIRST_VERSION = 1
"""Its voices do not say of which language they are: it was Japanese."""
_ROUNDS = 3
"""Rounds of forced alignment, each with the transform learnt so far."""
_PASSES = 3
_BATCH = 256
_RATE = 2e-3
_HOLD = 2e-3
"""Weight of the regularisation towards the identity."""
_WORST = -5.0
"""Mean log posterior of a frame below which a recording does not fit its text."""


@dataclass(frozen=True, eq=False)
class Voice:
    """What was learnt of somebody's voice in a language."""

    language: Language
    adaptation: Adaptation


def adapt(
    model: AcousticModel,
    recordings: Iterable[tuple[Samples, Sequence[str]]],
    seed: int = 1,
    tell: Callable[[str], None] | None = None,
) -> Adaptation:
    """The transform that makes the model fit the voice of `recordings`: (sound at 16 kHz, phones of the text read), one sentence
    each.

    Raises ValueError, one line, where none of the recordings holds its text.
    """
    random = np.random.default_rng(seed)
    normaliser = Normaliser(model.start_mean)
    chains: list[tuple[F32, NDArray[np.int32]]] = []
    for sound, phones in recordings:
        frames = normaliser.feed(LogMel().feed(as_float(sound)))
        chains.append((frames, chain_of((PAUSE, *phones, PAUSE), model.phones)[0]))
    turn, shift = np.eye(BANDS, dtype=np.float32), np.zeros(BANDS, np.float32)
    for number in range(_ROUNDS):
        windows, states = _aligned(model, Adaptation(turn, shift), chains)
        if tell is not None:
            tell(f"enrolment: round {number + 1} of {_ROUNDS}, {len(states) / 100.0:.0f} s of speech that fits its text")
        turn, shift = _descend(random, model, windows, states, turn, shift)
    return Adaptation(turn, shift)


def _aligned(
    model: AcousticModel, so_far: Adaptation, chains: list[tuple[F32, NDArray[np.int32]]]
) -> tuple[F32, NDArray[np.int32]]:
    """(n, window, BANDS) scaled frames, and the state each window's own frame belongs to."""
    windows: list[F32] = []
    states: list[NDArray[np.int32]] = []
    for frames, chain in chains:
        path, fit = align(Acoustic(model, so_far).feed_all(frames), chain)
        if fit > _WORST:
            states.append(chain[path])
            quiet = frames.min(0, keepdims=True)
            scaled = np.concatenate([np.repeat(quiet, model.past, 0), frames, np.repeat(quiet, model.future, 0)]) * model.scale
            windows.append(model.windows(scaled, np.arange(model.past, model.past + len(frames))))
    if not states:
        raise ValueError("enrolment: no recording holds the text that goes with it; check microphone and texts, and read anew")
    return np.concatenate(windows), np.concatenate(states)


def _descend(
    random: np.random.Generator, model: AcousticModel, windows: F32, states: NDArray[np.int32], turn: F32, shift: F32
) -> tuple[F32, F32]:
    """Adam on the cross entropy of the states."""
    values = [turn.copy(), shift.copy()]
    first = [np.zeros_like(v) for v in values]
    second = [np.zeros_like(v) for v in values]
    step = 0
    for _ in range(_PASSES):
        order = random.permutation(len(states))
        for begin in range(0, len(order) - _BATCH + 1, _BATCH):
            at = order[begin : begin + _BATCH]
            step += 1
            gradient = _gradient(model, windows[at], states[at], values[0], values[1])
            gradient[0] += np.float32(_HOLD) * (values[0] - np.eye(BANDS, dtype=np.float32))
            gradient[1] += np.float32(_HOLD) * values[1]
            for k, g in enumerate(gradient):
                first[k] += np.float32(0.1) * (g - first[k])
                second[k] += np.float32(0.01) * (g * g - second[k])
                spread = np.sqrt(second[k] / np.float32(1 - 0.99**step)) + np.float32(1e-8)
                values[k] -= np.float32(_RATE / (1 - 0.9**step)) * first[k] / spread
    return values[0], values[1]


def _gradient(model: AcousticModel, windows: F32, states: NDArray[np.int32], turn: F32, shift: F32) -> list[F32]:
    count = len(windows)
    inputs = [np.asarray((windows @ turn + shift).reshape(count, -1), np.float32)]
    for weight, bias in zip(model.weights[:-1], model.biases[:-1], strict=True):
        inputs.append(np.asarray(np.maximum(inputs[-1] @ weight + bias, 0.0), np.float32))
    y = inputs[-1] @ model.weights[-1] + model.biases[-1]
    y = np.exp(y - y.max(1, keepdims=True))
    y /= y.sum(1, keepdims=True)
    y[np.arange(count), states] -= 1.0
    y /= np.float32(count)
    for k in reversed(range(1, len(model.weights))):
        y = (y @ model.weights[k].T) * (inputs[k] > 0)
    y = (y @ model.weights[0].T).reshape(windows.shape)
    of_turn = windows.reshape(-1, BANDS).T @ y.reshape(-1, BANDS)
    return [np.asarray(of_turn, np.float32), np.asarray(y.sum((0, 1)), np.float32)]


def save(voice: Voice, path: Path) -> None:
    """Writes a voice's file (under 10 kB)."""
    learnt = voice.adaptation
    with path.open("wb") as file:
        np.savez_compressed(
            file, version=np.array(VERSION), language=np.array(voice.language), turn=learnt.turn, shift=learnt.shift
        )


def load(path: Path) -> Voice:
    """Raises ValueError, one line, where the file is not a voice of this version or the one before."""
    anew = "make it anew with: vistel speech enrol"
    try:
        with np.load(path) as data:
            version, turn, shift = int(data["version"]), data["turn"], data["shift"]
            told = "ja" if version == _FIRST_VERSION else str(data["language"])
    except (OSError, ValueError, EOFError, KeyError) as error:
        raise ValueError(f"voice {path}: cannot be read ({error}); {anew}") from None
    if not _FIRST_VERSION <= version <= VERSION or turn.shape != (BANDS, BANDS) or shift.shape != (BANDS,):
        raise ValueError(f"voice {path}: is of version {version}, expected {VERSION}; {anew}")
    language: Language | None = next((known for known in LANGUAGES if known == told), None)
    if language is None:
        raise ValueError(f"voice {path}: is of the language {told!r}, expected one of {', '.join(LANGUAGES)}; {anew}")
    return Voice(language, Adaptation(turn.astype(np.float32), shift.astype(np.float32)))
