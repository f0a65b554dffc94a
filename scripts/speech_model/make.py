"""Makes the acoustic model from nothing: `make speech-model`. See docs/explanation/speech.md.

Speaks the corpus, trains a first net on the first packs of the voices whose times are known, finds with it the times of
espeak-ng's speech, and trains the final net on all, each round in other rooms and noises. Everything is drawn from one
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

from scripts.speech_model import corpus, voice_file, voices
from scripts.speech_model.align import aligned
from scripts.speech_model.frames import Session, session
from scripts.speech_model.rooms import Noises, level
from scripts.speech_model.training import Frames, fresh, train
from scripts.speech_model.voices import Spoken
from vistel.arrays import F32
from vistel.speech.acoustic import FILE, STATES, AcousticModel, load, save, state_of
from vistel.speech.features import FRAME_S, LogMel
from vistel.speech.phones import PHONES


def speak(folder: Path, alike: Path, seed: int) -> None:
    alike.mkdir(parents=True, exist_ok=True)
    for name in corpus.HTS_MIXED:
        voice_file.alike(voices.hts_voices()[name], alike / f"{name}.htsvoice")
    for voice, number in corpus.packs():
        path = corpus.pack_file(folder, voice, number)
        if not path.is_file():
            began = time.time()
            corpus.save_pack(path, corpus.say_pack(voice, number, seed, alike))
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
    """Round after round, every utterance beside others of its pack, each time somewhere else. While one round is
    trained on, another process makes the next."""
    with ProcessPoolExecutor(1, initializer=_begin, initargs=(said, start_mean, seed)) as pool:
        coming = deque(pool.submit(_round, number) for number in range(min(rounds, _AHEAD)))
        for number in range(rounds):
            made = coming.popleft().result()
            if number + _AHEAD < rounds:
                coming.append(pool.submit(_round, number + _AHEAD))
            yield Frames(made)


_AHEAD = 2
_said: dict[str, list[Spoken]] = {}
_start_mean: list[F32] = []
_seed: list[int] = []


def _begin(said: dict[str, list[Spoken]], start_mean: F32, seed: int) -> None:
    os.nice(5)
    _said.update(said)
    _start_mean.append(start_mean)
    _seed.append(seed)


def _round(number: int) -> list[Session]:
    speech = [each.sound for some in _said.values() for each in some[number % 10 :: 10]]
    noises = Noises(corpus.seeded(_seed[0], "noises", number), speech)
    made: list[Session] = []
    for voice, some in _said.items():
        random = corpus.seeded(_seed[0], "session", voice, number)
        order = random.permutation(len(some))
        for k in range(0, len(order), 3):
            made.append(session(random, [some[i] for i in order[k : k + 3]], noises, _start_mean[0]))
    return made


def spoken(folder: Path) -> dict[str, list[Spoken]]:
    """By voice and pack, so that a list is of one voice where its pack is."""
    files = [corpus.pack_file(folder, voice, number) for voice, number in corpus.packs()]
    return {path.stem: list(corpus.load_pack(path)) for path in files}


def trained(said: dict[str, list[Spoken]], rounds: int, share: float, seed: int) -> AcousticModel:
    """A net that begins with random weights and has heard everything in so many places."""
    said = dict(sorted(said.items()))
    everything = [each for some in said.values() for each in some]
    start_mean = usual_mean(everything[::10])
    source = heard(said, start_mean, rounds, seed)
    first = next(source)
    print(f"training on {rounds} rounds of {len(first.known) * FRAME_S / 3600.0:.1f} hours", flush=True)
    random = corpus.seeded(seed, "net")
    model = fresh(random, first, start_mean, stays(everything))
    return train(random, model, chain([first], source), rounds, share, lambda line: print(line, flush=True))


FIRST_ROUNDS, FIRST_SHARE = 8, 0.6


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("out/speech-model"), help="where speech and first net are kept")
    parser.add_argument("--out", type=Path, default=FILE)
    parser.add_argument("--seed", type=int, default=9)
    parser.add_argument("--rounds", type=int, default=26, help="how often each utterance is heard, each time somewhere else")
    parser.add_argument("--share", type=float, default=0.75, help="of the frames of a round that are learnt from")
    given = parser.parse_args()
    reason = voices.missing()
    lacking = sorted(set(corpus.HTS_MIXED) - set(voices.hts_voices()))
    if reason or lacking:
        print(reason or f"voices not found: {', '.join(lacking)}; name their folders in VISTEL_VOICES", file=sys.stderr)
        return 1
    given.folder.mkdir(parents=True, exist_ok=True)
    speak(given.folder / "clean", given.folder / "alike", given.seed)
    said = spoken(given.folder / "clean")
    first_file = given.folder / "first.npz"
    if not first_file.is_file():
        some = {name: said[name] for name in said if name.endswith(".0") and not name.startswith(("espeak", "mixed"))}
        save(trained(some, FIRST_ROUNDS, FIRST_SHARE, given.seed), first_file)
    first = load(first_file)
    for name in [name for name in said if name.startswith("espeak")]:
        found = [timed for each in said[name] if (timed := aligned(first, each)) is not None]
        print(f"aligned: {name}, {len(found)} of {len(said[name])} utterances", flush=True)
        said[name] = found
    save(trained(said, given.rounds, given.share, given.seed + 1), given.out)
    print(f"written: {given.out}, {given.out.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
