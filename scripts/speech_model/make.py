"""Makes the acoustic model of a language from nothing: `make speech-model`. See docs/explanation/speech.md.

Speaks the corpus, trains a first net on voices whose synthesiser tells the times of sounds, finds with it the times of the others'
speech, and trains the final net on all, each round in other rooms and noises. Everything is drawn from one
seed; speech that is on disk already is not made again.
"""

import argparse
import os
import sys
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import chain
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np

from scripts.speech_model import corpus
from scripts.speech_model.align import aligned
from scripts.speech_model.corpus import Corpus
from scripts.speech_model.english import ENGLISH
from scripts.speech_model.frames import Session, session
from scripts.speech_model.japanese import JAPANESE
from scripts.speech_model.rooms import Noises, level
from scripts.speech_model.training import Frames, fresh, train
from scripts.speech_model.voices import Spoken
from vistel.arrays import F32
from vistel.speech.acoustic import AcousticModel, load, model_file, save, state_of
from vistel.speech.features import FRAME_S, LogMel

CORPORA = {each.name: each for each in (JAPANESE, ENGLISH)}


def speak(language: Corpus, folder: Path, alike: Path, seed: int) -> None:
    alike.mkdir(parents=True, exist_ok=True)
    language.prepare(alike)
    for voice, number in language.packs:
        path = corpus.pack_file(folder, voice, number)
        if not path.is_file():
            began = time.time()
            corpus.save_pack(path, language.say(voice, number, seed, alike), language.phones)
            print(f"spoken: {path.name}, {time.time() - began:.0f} s", flush=True)


def usual_mean(said: list[Spoken]) -> F32:
    """(BANDS,) mean frame of speech at a usual level: what a recogniser starts from."""
    frames = np.concatenate([LogMel().feed(each.sound * np.float32(0.05 / level(each.sound))) for each in said])
    loudness = frames.mean(1)
    return frames[loudness > np.quantile(loudness, 0.4)].mean(0)


def stays(said: list[Spoken], phones: tuple[str, ...]) -> F32:
    """(STATES,) from the mean length of each phone."""
    total, count = np.zeros((2, 2 * len(phones) - 1))
    for each in said:
        if each.ends_s is not None:
            for phone, seconds in zip(each.phones, np.diff(each.ends_s, prepend=0.0), strict=True):
                for half in (0.0, 0.5):
                    state = state_of(phones.index(phone), half)
                    total[state] += seconds / 2.0
                    count[state] += 1.0
    frames = total / np.maximum(count, 1.0) / FRAME_S
    stay = np.clip(1.0 - 1.0 / np.maximum(frames, 1.2), 0.3, 0.95)
    stay[0] = 0.95
    return stay.astype(np.float32)


def heard(language: Corpus, said: dict[str, list[Spoken]], start_mean: F32, rounds: int, seed: int) -> Iterator[Frames]:
    """Round after round, every utterance beside others of its pack, each time somewhere else. While one round is
    trained on, another process makes the next."""
    with ProcessPoolExecutor(1, initializer=_begin, initargs=(language.name, said, start_mean, seed)) as pool:
        coming = deque(pool.submit(_round, number) for number in range(min(rounds, _AHEAD)))
        for number in range(rounds):
            made = coming.popleft().result()
            if number + _AHEAD < rounds:
                coming.append(pool.submit(_round, number + _AHEAD))
            yield Frames(made)


_AHEAD = 2
_language: list[Corpus] = []
_said: dict[str, list[Spoken]] = {}
_start_mean: list[F32] = []
_seed: list[int] = []


def _begin(language: str, said: dict[str, list[Spoken]], start_mean: F32, seed: int) -> None:
    os.nice(5)
    _language.append(CORPORA[language])
    _said.update(said)
    _start_mean.append(start_mean)
    _seed.append(seed)


def _round(number: int) -> list[Session]:
    language = _language[0]
    speech = [each.sound for some in _said.values() for each in some[number % 10 :: 10]]
    noises = Noises(corpus.seeded(_seed[0], "noises", number), speech)
    made: list[Session] = []
    for voice, some in _said.items():
        random = corpus.seeded(_seed[0], "session", voice, number)
        order = random.permutation(len(some))
        for k in range(0, len(order), 3):
            utterances = [some[i] for i in order[k : k + 3]]
            made.append(session(random, utterances, noises, _start_mean[0], language.phones, throats=language.throats))
    return made


def spoken(language: Corpus, folder: Path) -> dict[str, list[Spoken]]:
    """By voice and pack, so that a list is of one voice where its pack is."""
    files = [corpus.pack_file(folder, voice, number) for voice, number in language.packs]
    return {path.stem: list(corpus.load_pack(path, language.phones)) for path in files}


def trained(language: Corpus, said: dict[str, list[Spoken]], rounds: int, share: float, seed: int) -> AcousticModel:
    """A net that begins with random weights and has heard everything in so many places."""
    said = dict(sorted(said.items()))
    everything = [each for some in said.values() for each in some]
    start_mean = usual_mean(everything[::10])
    source = heard(language, said, start_mean, rounds, seed)
    first = next(source)
    print(f"training on {rounds} rounds of {len(first.known) * FRAME_S / 3600.0:.1f} hours", flush=True)
    random = corpus.seeded(seed, "net")
    model = fresh(random, first, start_mean, stays(everything, language.phones), language.phones)
    return train(random, model, chain([first], source), rounds, share, lambda line: print(line, flush=True))


FIRST_ROUNDS, FIRST_SHARE = 8, 0.6


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("language", choices=CORPORA)
    parser.add_argument("--folder", type=Path, default=Path("out/speech-model"), help="where speech and first net are kept")
    parser.add_argument("--out", type=Path, help="the file in the package, where it is not given")
    parser.add_argument("--seed", type=int, default=9)
    given = parser.parse_args()
    language = CORPORA[given.language]
    if (reason := language.lacking()) is not None:
        print(reason, file=sys.stderr)
        return 1
    folder, out = given.folder / language.name, given.out or model_file(language.name)
    speak(language, folder / "clean", folder / "alike", given.seed)
    said = spoken(language, folder / "clean")
    first_file = folder / "first.npz"
    if not first_file.is_file():
        some = {name: said[name] for name in language.first}
        save(trained(language, some, FIRST_ROUNDS, FIRST_SHARE, given.seed), first_file)
    first = load(first_file)
    for name in [name for name in said if name.rpartition(".")[0] in language.aligned]:
        found = [timed for each in said[name] if (timed := aligned(first, each)) is not None]
        print(f"aligned: {name}, {len(found)} of {len(said[name])} utterances", flush=True)
        said[name] = found
    save(trained(language, said, language.rounds, language.share, given.seed + 1), out)
    print(f"written: {out}, {out.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
