"""Makes the acoustic model of a language from nothing: `make speech-model`. See docs/explanation/speech.md.

Speaks the corpus, trains a first net on voices whose synthesiser tells the times of sounds, finds with it the times of the others'
speech, and trains the final net on all, each round in other rooms and noises. Everything is drawn from one
seed; speech that is on disk already is not made again. With `--gpu MINUTES` the final net is trained by PyTorch for so long, on
more speech (`gpu_training.py`).
"""

import argparse
import os
import sys
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import chain, count, islice, takewhile
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np

from scripts.speech_model import corpus, gpu_training
from scripts.speech_model.align import aligned
from scripts.speech_model.corpus import Corpus, Net
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


def speak(language: Corpus, packs: Sequence[tuple[str, int]], folder: Path, alike: Path, seed: int, processes: int) -> None:
    alike.mkdir(parents=True, exist_ok=True)
    language.prepare(alike)
    with ProcessPoolExecutor(processes) as pool:
        jobs = [pool.submit(_speak_pack, language.name, voice, number, folder, alike, seed) for voice, number in packs]
        for job in as_completed(jobs):
            job.result()


def _speak_pack(language: str, voice: str, number: int, folder: Path, alike: Path, seed: int) -> None:
    path, of = corpus.pack_file(folder, voice, number), CORPORA[language]
    if not path.is_file():
        began = time.time()
        corpus.save_pack(path, of.say(voice, number, seed, alike), of.phones)
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


@dataclass(frozen=True)
class _Source:
    """What rounds are made of. said: by voice and pack; parts: how many rounds hold about as much as was said."""

    net: Net
    said: dict[str, list[Spoken]]
    start_mean: F32
    seed: int
    parts: int


def heard(source: _Source, processes: int) -> Iterator[Frames]:
    """Endless: round after round, every utterance beside others of its pack, each time somewhere else. While one round is
    trained on, other processes make the next."""
    with ProcessPoolExecutor(processes, initializer=_begin, initargs=(source,)) as pool:
        coming = deque(pool.submit(_round, number) for number in range(processes + 1))
        try:
            for number in count(processes + 1):
                made = coming.popleft().result()
                coming.append(pool.submit(_round, number))
                yield Frames(made)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


_source: list[_Source] = []


def _begin(source: _Source) -> None:
    os.nice(5)
    _source.append(source)


def _round(number: int) -> list[Session]:
    source = _source[0]
    net, said = source.net, source.said
    speech = [each.sound for some in said.values() for each in some[number % 10 :: 10]]
    noises = Noises(corpus.seeded(source.seed, "noises", number), speech)
    made: list[Session] = []
    for voice, some in said.items():
        random = corpus.seeded(source.seed, "session", voice, number)
        order = random.permutation(len(some))[: max(3, len(some) // source.parts)]
        for k in range(0, len(order), 3):
            utterances = [some[i] for i in order[k : k + 3]]
            made.append(session(random, utterances, noises, source.start_mean, net.phones, throats=net.throats))
    return made


def spoken(language: Corpus, packs: Sequence[tuple[str, int]], folder: Path) -> dict[str, list[Spoken]]:
    """By voice and pack, so that a list is of one voice where its pack is."""
    files = [corpus.pack_file(folder, voice, number) for voice, number in packs]
    return {path.stem: list(corpus.load_pack(path, language.phones)) for path in files}


def timed(
    language: Corpus, first_file: Path, folder: Path, said: dict[str, list[Spoken]], processes: int
) -> dict[str, list[Spoken]]:
    """What was said, with the times that the first net finds where the synthesiser tells none, without what it does not find."""
    names = [name for name in said if name.rpartition(".")[0] in language.aligned]
    with ProcessPoolExecutor(processes) as pool:
        jobs = [pool.submit(_timed, language.name, first_file, folder / f"{name}.npz") for name in names]
        for name, job in zip(names, jobs, strict=True):
            print(f"aligned: {name}, {len(job.result())} of {len(said[name])} utterances", flush=True)
    return {**said, **{name: job.result() for name, job in zip(names, jobs, strict=True)}}


def _timed(language: str, first_file: Path, pack: Path) -> list[Spoken]:
    first = load(first_file)
    return [found for each in corpus.load_pack(pack, CORPORA[language].phones) if (found := aligned(first, each)) is not None]


def trained(net: Net, said: dict[str, list[Spoken]], rounds: int, share: float, seed: int) -> AcousticModel:
    """A net that begins with random weights and has heard everything in so many places."""
    model, random, source = _begun(net, said, seed, 1, 1)
    print(f"training on {rounds} rounds", flush=True)
    return train(random, model, islice(source, rounds), rounds, share, _tell)


def trained_on_gpu(net: Net, said: dict[str, list[Spoken]], minutes: float, processes: int, seed: int) -> AcousticModel:
    """As `trained`, for so long, with the processor's other cores for what is heard."""
    model, random, source = _begun(net, said, seed, processes, _PARTS)
    until = time.monotonic() + 60.0 * minutes

    def done(_: int) -> float:
        return 1.0 - (until - time.monotonic()) / (60.0 * minutes)

    return gpu_training.train(random, model, takewhile(lambda _: time.monotonic() < until, source), done, _PASSES, _tell)


def _begun(
    net: Net, said: dict[str, list[Spoken]], seed: int, processes: int, parts: int
) -> tuple[AcousticModel, np.random.Generator, Iterator[Frames]]:
    """A net of random weights, what its training draws from, and rounds of what it hears."""
    said = dict(sorted(said.items()))
    everything = [each for some in said.values() for each in some]
    start_mean = usual_mean(everything[::10])
    source = heard(_Source(net, said, start_mean, seed, parts), processes)
    first = next(source)
    print(f"{len(first.known) * FRAME_S / 3600.0:.1f} hours in a round", flush=True)
    random = corpus.seeded(seed, "net")
    model = fresh(random, first, start_mean, stays(everything, net.phones), net.phones, net.offsets, net.hidden)
    return model, random, chain([first], source)


def _tell(line: str) -> None:
    print(line, flush=True)


def _more(packs: Sequence[tuple[str, int]]) -> list[tuple[str, int]]:
    """Three further packs for each."""
    counts = Counter(voice for voice, _ in packs)
    return [(voice, k) for voice, some in counts.items() for k in range(some, 4 * some)]


FIRST_ROUNDS, FIRST_SHARE = 8, 0.6
_PARTS, _PASSES = 4, 2
"""On a GPU: of how many rounds everything is heard once, and how often each round is learnt from."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("language", choices=CORPORA)
    parser.add_argument("--folder", type=Path, default=Path("out/speech-model"), help="where speech and first net are kept")
    parser.add_argument("--out", type=Path, help="the file in the package, where it is not given")
    parser.add_argument("--seed", type=int, default=9)
    parser.add_argument("--processes", type=int, default=1, help="that speak, find times and hear")
    parser.add_argument(
        "--gpu", type=float, metavar="MINUTES", help="train the final net for so long on a GPU, on four times the speech"
    )
    given = parser.parse_args()
    language = CORPORA[given.language]
    if (reason := language.lacking()) is not None:
        print(reason, file=sys.stderr)
        return 1
    folder, out = given.folder / language.name, given.out or model_file(language.name)
    packs = language.packs if given.gpu is None else [*language.packs, *_more(language.packs)]
    speak(language, packs, folder / "clean", folder / "alike", given.seed, given.processes)
    said = spoken(language, packs, folder / "clean")
    first_file = folder / "first.npz"
    if not first_file.is_file():
        save(trained(language, {name: said[name] for name in language.first}, FIRST_ROUNDS, FIRST_SHARE, given.seed), first_file)
    said = timed(language, first_file, folder / "clean", said, given.processes)
    if given.gpu is None:
        made = trained(language, said, language.rounds, language.share, given.seed + 1)
    else:
        made = trained_on_gpu(language, said, given.gpu, given.processes, given.seed + 1)
    save(made, out)
    print(f"written: {out}, {out.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
