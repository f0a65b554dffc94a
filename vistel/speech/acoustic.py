"""The probability of each sound of a language at a moment: a small feed-forward net over a window of frames.

The weights of a language are one file in the package (`data/japanese.npz`; `data/japanese.md` beside it says how they were made).
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.speech.features import BANDS

VERSION = 3
"""Version of the weight file; it changes when its arrays or their meaning do."""


def state_of(phone: int, part: float) -> int:
    """State of a phone (an index, the pause is 0) when `part` of it, 0 to 1, has passed: the pause has one, every other two."""
    return 0 if phone == 0 else 2 * phone - 1 + (part >= 0.5)


@dataclass(frozen=True)
class AcousticModel:
    """A trained net and what the decoder needs beside it.

    phones: names, the pause first. offsets: (window,) frames that are the net's input, relative to the one it classifies, rising;
    the last is how far it looks ahead. start_mean, scale: (BANDS,) mean of the frames at the start of a stream, and one over their
    spread once it is subtracted.
    weights, biases: of the layers; all but the last are followed by max(0, x). (in, out) and (out,) float32. log_prior: (STATES,)
    logarithm of how often each state was trained on. stay: (STATES,) probability that a state lasts another frame. belief:
    (FEATURES,) weights of what `confidence.py` makes a confidence of."""

    phones: tuple[str, ...]
    offsets: tuple[int, ...]
    start_mean: F32
    scale: F32
    weights: tuple[F32, ...]
    biases: tuple[F32, ...]
    log_prior: F32
    stay: F32
    belief: F32

    @property
    def states(self) -> int:
        """How many there are, called STATES elsewhere."""
        return 2 * len(self.phones) - 1

    @property
    def past(self) -> int:
        """Frames before the one it classifies that the net needs."""
        return -self.offsets[0]

    @property
    def future(self) -> int:
        """Frames after the one it classifies that the net needs."""
        return self.offsets[-1]

    def windows(self, frames: F32, at: NDArray[np.int64]) -> F32:
        """(n, len(offsets), BANDS) the net's input for the frames `at`, of normalised and scaled ones."""
        return frames[at[:, None] + np.array(self.offsets)]

    def log_posteriors(self, windows: F32) -> F32:
        """(n, STATES) for (n, len(offsets) * BANDS) normalised and scaled frames, oldest first."""
        x = windows
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.maximum(x @ weight + bias, 0.0)
        x = x @ self.weights[-1] + self.biases[-1]
        x -= x.max(1, keepdims=True)
        return x - np.log(np.exp(x).sum(1, keepdims=True))


def save(model: AcousticModel, path: Path) -> None:
    """Writes a model; weights become bytes with a scale for each output (about 1 MB)."""
    arrays: dict[str, NDArray[np.generic]] = {
        "version": np.array(VERSION),
        "phones": np.array(model.phones),
        "offsets": np.array(model.offsets, np.int16),
        "start_mean": model.start_mean,
        "scale": model.scale,
        "log_prior": model.log_prior,
        "stay": model.stay,
        "belief": model.belief,
    }
    for k, (weight, bias) in enumerate(zip(model.weights, model.biases, strict=True)):
        step = np.maximum(np.abs(weight).max(0), 1e-12) / 127.0
        arrays[f"weight{k}"] = np.rint(weight / step).astype(np.int8)
        arrays[f"step{k}"] = step.astype(np.float32)
        arrays[f"bias{k}"] = bias.astype(np.float32)
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType]


def load(path: Path) -> AcousticModel:
    """Raises ValueError, one line, where the file is not a model of this version."""
    try:
        with np.load(path) as data:
            arrays = dict(data)
    except (OSError, ValueError, EOFError) as error:
        raise ValueError(f"speech model {path}: cannot be read ({error}); make it anew with: make speech-model") from None
    version = int(arrays.get("version", np.array(0)))
    if version != VERSION:
        raise ValueError(f"speech model {path}: is of version {version}, expected {VERSION}; make it anew with: make speech-model")
    phones = tuple(str(name) for name in arrays["phones"])
    layers = range(sum(name.startswith("weight") for name in arrays))
    weights = tuple(arrays[f"weight{k}"].astype(np.float32) * arrays[f"step{k}"] for k in layers)
    offsets = tuple(int(each) for each in arrays["offsets"])
    widths = [len(offsets) * BANDS, *(w.shape[1] for w in weights)]
    if [w.shape[0] for w in weights] != widths[:-1] or widths[-1] != 2 * len(phones) - 1:
        raise ValueError(f"speech model {path}: layers of {widths} do not fit; make it anew with: make speech-model")
    biases = tuple(arrays[f"bias{k}"] for k in layers)
    start_mean, scale = arrays["start_mean"], arrays["scale"]
    log_prior, stay, belief = arrays["log_prior"], arrays["stay"], arrays["belief"]
    return AcousticModel(phones, offsets, start_mean, scale, weights, biases, log_prior, stay, belief)


def model_file(name: str) -> Path:
    """Of a model of this package: "japanese"."""
    return Path(__file__).with_name("data") / f"{name}.npz"


@cache
def packaged(name: str) -> AcousticModel:
    """A model of this package, loaded once. Raises ValueError as `load`."""
    return load(model_file(name))


@dataclass(frozen=True)
class Adaptation:
    """A voice's transform of scaled frames before the net: frames @ turn + shift, both (BANDS, ...)."""

    turn: F32
    shift: F32


class Acoustic:
    """The net over a stream of normalised frames. Its output lags `model.future` frames behind them."""

    def __init__(self, model: AcousticModel, adaptation: Adaptation | None = None) -> None:
        self._model = model
        self._adaptation = adaptation
        self._kept = np.zeros((model.past, BANDS), np.float32)

    def feed_all(self, frames: F32) -> F32:
        """(n, STATES) log posteriors of all n frames of a whole recording; after its end there is quiet."""
        return self.feed(np.concatenate([frames, np.repeat(frames.min(0, keepdims=True), self._model.future, 0)]))

    def feed(self, frames: F32) -> F32:
        """(m, STATES) log posteriors of the next m frames of the stream; before its beginning there is quiet."""
        scaled = frames * self._model.scale
        if self._adaptation is not None:
            scaled = scaled @ self._adaptation.turn + self._adaptation.shift
        scaled = np.asarray(np.concatenate([self._kept, scaled]), np.float32)
        past = self._model.past
        count = max(0, len(scaled) - past - self._model.future)
        self._kept = scaled[count:].copy()
        if count == 0:
            return np.zeros((0, self._model.states), np.float32)
        windows = self._model.windows(scaled, np.arange(past, past + count))
        return self._model.log_posteriors(windows.reshape(count, -1))
