"""Makes the acoustic model from nothing: `make speech-model`. See docs/explanation/speech.md.

Speaks the corpus, takes it through rooms and noises, trains a first net on the voices whose times are known, finds with
it the times of espeak-ng's speech, and trains the final net on all. Everything is drawn from one seed; what is on disk
already is not made again.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import chain
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

from scripts.speech_model import corpus, voices  # noqa: E402
from scripts.speech_model.align import aligned  # noqa: E402
from scripts.speech_model.frames import F32, Session, session  # noqa: E402
from scripts.speech_model.rooms import Noises, level  # noqa: E402
from scripts.speech_model.training import RATE, Frames, fresh, train  # noqa: E402
from scripts.speech_model.voices import Spoken  # noqa: E402
from vistel.speech.acoustic import FILE, STATES, Model, load, save, state_of  # noqa: E402
from vistel.speech.features import FRAME_S, LogMel  # noqa: E402
from vistel.speech.phones import PHONES  # noqa: E402


def speak(folder: Path, seed: int) -> None:
    for voice, number in corpus.packs():
        path = corpus.pack_file(folder, voice, number)
        if not path.is_file():
            began = time.time()
            corpus.save_pack(path, corpus.say_pack(voice, number, seed))
            print(f"spoken: {path.name}, {time.time() - began:.0f} s", flush=True)


def usual_mean(said: list[Spoken]) -> F32:
    """(BANDS,) mean frame of speech at a usual level: what a recogniser starts from."""
    frames = np.concatenate([LogMel().feed(each.sound * np.float32(0.05 / level(each.sound))) for each in said])
    loudness = frames.mean(1)
    return frames[loudness > np.quantile(loudness, 0.4)].mean(0)


def stays(said: list[Spoken]) -> F32:
    """(STATES,) from the mean length of each phone."""
    total, count = np.zeros(STATES), np.zeros(STATES)
    for each in said:
        if each.ends_s is not None:
            for phone, seconds in zip(each.phones, np.diff(each.ends_s, prepend=0.0), strict=True):
                for half in (0.0, 0.5):
                    state = state_of(PHONES.index(phone), half)
                    total[state] += seconds / 2.0
                    count[state] += 1.0
    frames = total / np.maximum(count, 1.0) / FRAME_S
    stay = np.clip(1.0 - 1.0 / np.maximum(frames, 1.2), 0.3, 0.95)
    stay[0] = 0.95
    return stay.astype(np.float32)


def heard(said: dict[str, list[Spoken]], start_mean: F32, rounds: int, seed: int) -> Iterator[Frames]:
    """Round after round, every utterance beside others of its voice, each time somewhere else. While one round is
    trained on, another process makes the next."""
    with ProcessPoolExecutor(1, initializer=_begin, initargs=(said, start_mean, seed)) as pool:
        coming = [pool.submit(_round, number) for number in range(rounds)]
        for number in range(rounds):
            made = coming[number].result()
            coming[number].cancel()
            yield Frames(made)


_said: dict[str, list[Spoken]] = {}
_start_mean: list[F32] = []
_noises: list[Noises] = []
_seed: list[int] = []


def _begin(said: dict[str, list[Spoken]], start_mean: F32, seed: int) -> None:
    _said.update(said)
    _start_mean.append(start_mean)
    _seed.append(seed)
    _noises.append(Noises(corpus.seeded(seed, "noises"), [each.sound for some in said.values() for each in some[:60]]))


def _round(number: int) -> list[Session]:
    made: list[Session] = []
    for voice, some in _said.items():
        random = corpus.seeded(_seed[0], "session", voice, number)
        order = random.permutation(len(some))
        for k in range(0, len(order), 3):
            made.append(session(random, [some[i] for i in order[k : k + 3]], _noises[0], _start_mean[0]))
    return made


def spoken(folder: Path, most: int) -> dict[str, list[Spoken]]:
    """By voice and pack, so that every list is of one voice."""
    return {path.stem: list(corpus.load_pack(path)) for path in corpus.first(folder, most)}


def trained(said: dict[str, list[Spoken]], begin: Model | None, rounds: int, seed: int) -> Model:
    """The net after so many rounds; it goes on from `begin`, or from random weights."""
    everything = [each for some in said.values() for each in some]
    start_mean = usual_mean(everything[::10]) if begin is None else begin.start_mean
    random = corpus.seeded(seed, "net", begin is None)
    source = heard(said, start_mean, rounds, seed + (begin is not None))
    first = next(source)
    print(f"training on {rounds} rounds of {len(first.known) * FRAME_S / 3600.0:.1f} hours", flush=True)
    model = begin or fresh(random, first, start_mean, stays(everything))
    rate = RATE if begin is None else 0.6 * RATE
    return train(random, model, chain([first], source), rounds, lambda line: print(line, flush=True), rate)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("out/speech-model"), help="where speech and first net are kept")
    parser.add_argument("--out", type=Path, default=FILE)
    parser.add_argument("--seed", type=int, default=9)
    parser.add_argument("--packs", type=int, default=1000, help="use only the first so many packs")
    parser.add_argument("--rounds", type=int, default=10, help="how often each utterance is heard, each time somewhere else")
    parser.add_argument("--first", action="store_true", help="stop after the first net")
    given = parser.parse_args()
    reason = voices.missing()
    lacking = sorted(set(corpus.HTS_TRAINING) - set(voices.hts_voices()))
    if reason or lacking:
        print(reason or f"voices not found: {', '.join(lacking)}; name their folders in VISTEL_VOICES", file=sys.stderr)
        return 1
    given.folder.mkdir(parents=True, exist_ok=True)
    first_file = given.folder / "first.npz"
    if not given.first:
        speak(given.folder / "clean", given.seed)
    said = spoken(given.folder / "clean", given.packs)
    timed = {name: some for name, some in said.items() if not name.startswith("espeak")}
    if given.first or not first_file.is_file():
        save(trained(timed, None, min(given.rounds, 4), given.seed), first_file)
    if given.first:
        return 0
    first = load(first_file)
    for name in sorted(said.keys() - timed.keys()):
        timed[name] = [found for each in said[name] if (found := aligned(first, each)) is not None]
        print(f"aligned: {name}, {len(timed[name])} of {len(said[name])} utterances", flush=True)
    save(trained(dict(sorted(timed.items())), first, given.rounds, given.seed), given.out)
    print(f"written: {given.out}, {given.out.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
