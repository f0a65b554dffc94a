"""`vistel speech`: tests and scores spoken commands, checks grammars and trains on a voice."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, is_dataclass
from enum import Enum
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from vistel_cli.avatar.files import busy
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import ARRAYS, FILM, FOLDER, GRAMMAR, SOUND
from vistel_cli.terminal import FAILED, USAGE, fail, out, print_error

if TYPE_CHECKING:  # they load recognisers and the mathematics, which `vistel --help` need not
    import random

    from vistel.arrays import F32
    from vistel.speech.grammar import Grammar, Language, Sentence
    from vistel.speech.recognition import Hypothesis, Recogniser
    from vistel_services.audio.inputs import CardInput

app = typer.Typer(no_args_is_help=True)

_LOADING_S = 60.0
"""Longest time of a new recogniser for its first sentence. Sound that arrives meanwhile is kept."""

_DRAWS = 100
"""So many sentences are drawn for one that is good English: a third are, but a grammar of somebody's own may have none."""
_LETTER_S = {"ja": 0.25, "en": 0.1}
"""Longest time that a letter of a sentence takes to be read, kana or Latin."""
SOUNDS = (".wav", ".flac", ".ogg", ".opus", ".mp3", ".m4a")

Extra = Annotated[
    list[Path] | None, Takes(GRAMMAR), typer.Option("--grammar", help="File of further words and sentences; may be repeated.")
]
Tongue = Annotated[str, typer.Option(help="ja or en.")]
Voice = Annotated[Path | None, Takes(ARRAYS), typer.Option(help="Voice file that `vistel speech enrol` wrote.")]
Engine = Annotated[str, typer.Option(help="own, pocketsphinx, vosk, sherpa, whisper or julius; the last four need --model.")]
Model = Annotated[Path | None, typer.Option(help="Folder or file of the engine's model.")]
Accept = Annotated[float, typer.Option(help="Least confidence of an accepted sentence.", min=0.0, max=1.0)]


@app.command()
def grammar(
    files: Annotated[list[Path] | None, Takes(GRAMMAR), typer.Argument(help="Files of further words and sentences.")] = None,
    language: Tongue = "",
    read: Annotated[str | None, typer.Option(help="Show the meaning of this sentence.")] = None,
    jsgf: Annotated[bool, typer.Option("--jsgf", help="Print it in Java Speech Grammar Format.")] = False,
    examples: Annotated[int, typer.Option(help="Print this many example sentences.", min=0)] = 0,
) -> None:
    """Print and check the grammar. Faults of a file are listed, with exit code 1.

    [bold]Examples[/bold]

      vistel speech grammar

      vistel speech grammar --read 赤い箱を右に動かして

      vistel speech grammar own.toml --language en --examples 10
    """
    import random

    from vistel.speech.grammar_file import phrase_table
    from vistel.speech.recognisers import NAMES, checked_grammar

    known, faults = checked_grammar(*(files or ()))
    for fault in faults:
        print_error(str(fault))
    tongues: list[Language] = [_language(language)] if language else list(known.languages)
    if read is not None:
        _show_meaning(known, read)
    elif jsgf:
        for tongue in tongues:
            print(known.jsgf(tongue))
    elif examples:
        rng = random.Random(1)
        for tongue in tongues:
            for _ in range(examples):
                out.print(_example(known, tongue, rng).text)
    else:
        for tongue in tongues:
            count = len(known.by_language[tongue])
            out.print(Text.assemble((NAMES[tongue], "bold"), f": {len(known.words(tongue))} words, {count} patterns"))
            for name, words in phrase_table(known, tongue).items():
                out.print(f"  {name:10} {' · '.join(w.written for w in words)}", soft_wrap=True)
    if faults:
        raise typer.Exit(FAILED)


def _example(known: Grammar, tongue: Language, rng: random.Random) -> Sentence:
    """A sentence at random, as people would write it where there is one."""
    from vistel_cli.voice.good_english import is_good_english

    drawn = (known.pick(tongue, rng) for _ in range(_DRAWS))
    first = next(drawn)
    return first if tongue != "en" or is_good_english(first) else next(filter(is_good_english, drawn), first)


def _show_meaning(known: Grammar, text: str) -> None:
    from vistel.speech.meaning import MeaningError, asked_for

    sentence = known.read(text)
    if sentence is None:
        fail(f"{text}: no sentence of the grammar", FAILED)
    try:
        wanted: Any = asked_for(sentence.means)
    except MeaningError as e:
        fail(f"{text}: {e}", FAILED)
    out.print(sentence.text if sentence.spoken == sentence.text else f"{sentence.text}  ({sentence.spoken})")
    out.print(", ".join(f"{k} = {v}" for k, v in sentence.means.items()))
    out.print(f"{type(wanted).__name__}: {', '.join(f'{f.name} {_in_words(getattr(wanted, f.name))}' for f in fields(wanted))}")


def _in_words(value: Any) -> str:
    """A value of an action. Of which things are meant: what is said of them, in brackets."""
    if not is_dataclass(value):
        return str(value.value if isinstance(value, Enum) else value)
    parts = [f"{f.name} {_in_words(v)}" for f in fields(value) if (v := getattr(value, f.name)) != f.default]
    return f"({', '.join(parts) or 'this'})"


@app.command("try")
def try_(
    sound: Annotated[
        str,
        Takes(SOUND, FILM, names=True),
        typer.Argument(help='A recording, "default" for the microphone, or a part of its name.'),
    ] = "default",
    language: Tongue = "ja",
    extra: Extra = None,
    voice: Voice = None,
    accept: Accept = 0.5,
    engine: Engine = "own",
    model: Model = None,
    seconds: Annotated[float, typer.Option(help="How long to listen to a microphone; 0: until Ctrl-C.", min=0.0)] = 0.0,
) -> None:
    """Listen, and show the recognised sentences.

    [bold]Examples[/bold]

      vistel speech try

      vistel speech try said.wav --language en
    """
    with busy("loading the recogniser", True):
        known, hears, tongue = _prepared(language, extra, voice, engine, model)
    count = 0
    if Path(sound).suffix.lower() in SOUNDS:
        with busy(f"listening to {sound}", True):
            understood = list(_understood(Path(sound), hears))
        for heard in understood:
            count += 1
            _show(known, tongue, heard, accept)
    else:
        for heard in _live(sound, hears, seconds):
            count += 1
            _show(known, tongue, heard, accept)
    if not count:
        out.print("no speech was heard")


def _show(known: Grammar, tongue: Language, heard: tuple[Hypothesis, ...], accept: float) -> None:
    best = heard[0]
    sentence = known.sentence(best.words, tongue) if best.words else None
    when = f"{best.start_s:6.2f}–{best.end_s:.2f} s"
    if sentence is None:
        out.print(Text.assemble(f"{when}  ", ("no command", "yellow")))
        return
    mark = ("✓", "green") if best.confidence >= accept else ("?", "yellow")
    means = ", ".join(f"{k} = {v}" for k, v in sentence.means.items())
    out.print(Text.assemble(f"{when}  ", mark, " ", (sentence.text, "bold"), f"  {best.confidence:.2f}  ", (means, "dim")))
    for other in heard[1:3]:
        also = known.sentence(other.words, tongue)
        if also is not None:
            out.print(f"{'':16}  or {also.text}  {other.confidence:.2f}", style="dim")


def _live(name: str, hears: Recogniser, seconds: float) -> Iterator[tuple[Hypothesis, ...]]:
    import numpy as np

    from vistel.audio.capture import SoundDeviceError
    from vistel.speech.features import Resampler
    from vistel.wire.clock import SystemClock
    from vistel_services.audio.inputs import CardInput

    stopped = False

    def stop(number: int, frame: FrameType | None) -> None:
        nonlocal stopped
        stopped = True

    before = {s: signal.signal(s, stop) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        microphone = CardInput(name, SystemClock(), keep_s=_LOADING_S)
        resampler = Resampler(microphone.rate_hz)
        until = time.monotonic() + seconds if seconds else float("inf")
        with contextlib.closing(microphone):
            out.print("listening; Ctrl-C ends it", style="dim")
            while not stopped and time.monotonic() < until:
                if parts := microphone.take():
                    yield from hears.feed(resampler.feed(np.concatenate([samples for samples, _ in parts])))
                time.sleep(0.02)
            yield from hears.flush()
    except SoundDeviceError as e:
        fail(str(e), FAILED)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _understood(path: Path, hears: Recogniser) -> list[tuple[Hypothesis, ...]]:
    """The utterances of a recording."""
    hears.reset()
    sound = _sound_of(path)
    found: list[tuple[Hypothesis, ...]] = []
    for at in range(0, len(sound), 1600):
        found += hears.feed(sound[at : at + 1600])
    return found + hears.flush()


@dataclass(frozen=True)
class Score:
    """Result for one recording: its text, the recognised text, whether both mean the same, and whether it is accepted."""

    file: str
    said: str
    understood: str
    confidence: float
    right: bool
    accepted: bool


@app.command("test")
def test_(
    folder: Annotated[
        Path, Takes(FOLDER), typer.Argument(help="Recordings; the text of NAME.wav is in NAME.txt, else it is the name itself.")
    ],
    language: Tongue = "ja",
    extra: Extra = None,
    voice: Voice = None,
    accept: Accept = 0.5,
    engine: Engine = "own",
    model: Model = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per recording, and one for all.")] = False,
) -> None:
    """Score a folder of recordings: right, and right and accepted.

    A text outside the grammar counts as other talk. It is right when nothing of it is accepted.

    [bold]Example[/bold]

      vistel speech test recordings --language en
    """
    known, hears, tongue = _prepared(language, extra, voice, engine, model)
    files = sorted(p for p in folder.glob("*") if p.suffix.lower() in SOUNDS) if folder.is_dir() else []
    if not files:
        fail(f"{folder}: holds no recordings ({', '.join(SOUNDS)})")
    scores = [_scored(path, known, hears, tongue, accept) for path in files]
    commands = [s for s in scores if s.said]
    others = [s for s in scores if not s.said]
    total = {
        "commands": len(commands),
        "right": sum(s.right for s in commands),
        "right_and_accepted": sum(s.right and s.accepted for s in commands),
        "other_talk": len(others),
        "false_accepts": sum(s.accepted for s in others),
    }
    if as_json:
        for s in scores:
            print(json.dumps(asdict(s), ensure_ascii=False))
        print(json.dumps(total))
        return
    for s in scores:
        mark = ("✓", "green") if s.right else ("✗", "red")
        believed = f"{s.confidence:.2f}" + ("" if s.accepted else " not accepted")
        heard = s.understood if s.understood != s.said else ""
        file = f" {s.file:24} {s.said or '(other talk)'}  "
        out.print(Text.assemble(mark, file, (believed, "dim"), f" {heard and '→ ' + heard}"))
    out.print(
        f"{total['right']} of {len(commands)} commands right, {total['right_and_accepted']} right and accepted; "
        f"{total['false_accepts']} of {len(others)} others accepted"
    )


def _scored(path: Path, known: Grammar, hears: Recogniser, tongue: Language, accept: float) -> Score:
    from vistel.speech.meaning import asked_for

    text = _text_of(path)
    meant = known.read(text) or known.read(re.sub(r"[ 0-9]+$", "", text))
    heard = max(_understood(path, hears), key=lambda h: h[0].confidence, default=None)
    best = heard[0] if heard else None
    understood = known.sentence(best.words, tongue) if best and best.words else None
    confidence = best.confidence if best and understood else 0.0
    accepted = confidence >= accept
    same = understood is not None and meant is not None and asked_for(understood.means) == asked_for(meant.means)
    right = same if meant is not None else not accepted
    return Score(
        path.name, meant.text if meant else "", understood.text if understood else "", round(confidence, 3), right, accepted
    )


@app.command()
def enrol(
    result: Annotated[Path, typer.Argument(help="Voice file to write: voices/NAME.npz.")],
    recordings: Annotated[
        Path | None,
        Takes(FOLDER),
        typer.Option("--recordings", help="Folder of recordings, each with its text as for `test`, instead of reading."),
    ] = None,
    microphone: Annotated[str, typer.Option(help='"default", or a part of its name.')] = "default",
    sentences: Annotated[int, typer.Option(help="How many to read; 60 take five minutes.", min=5)] = 60,
    language: Tongue = "ja",
) -> None:
    """Train the recogniser on a voice. The speaker reads sentences aloud for some minutes.

    [bold]Examples[/bold]

      vistel speech enrol voices/aiko.npz

      vistel speech enrol voices/ben.npz --language en

      vistel speech enrol voices/aiko.npz --recordings recordings
    """
    from vistel.speech import acoustic, enrolment
    from vistel.speech.engines.engine import EngineError
    from vistel.speech.recognisers import NAMES, checked_grammar, text_phones

    tongue = _language(language)
    known, _ = checked_grammar()
    spoken = _recorded(recordings, known, tongue) if recordings is not None else _read_aloud(known, tongue, microphone, sentences)
    try:
        model = acoustic.packaged(NAMES[tongue].lower())
        with_phones = [(sound, text_phones(tongue, text)) for sound, text in spoken]
        learnt = enrolment.adapt(model, with_phones, tell=lambda line: out.print(line, style="dim"))
        result.parent.mkdir(parents=True, exist_ok=True)
        enrolment.save(enrolment.Voice(tongue, learnt), result)
    except (OSError, ValueError, EngineError) as e:
        fail(str(e), FAILED)
    out.print(f"{result}: learnt from {len(spoken)} recordings")


def _recorded(folder: Path, known: Grammar, tongue: Language) -> list[tuple[F32, str]]:
    """Sounds at 16 kHz with their texts, in kana or English. Recordings with another text are listed and left out."""
    from vistel.speech.recognisers import NAMES

    spoken: list[tuple[F32, str]] = []
    for path in sorted(p for p in folder.glob("*") if p.suffix.lower() in SOUNDS) if folder.is_dir() else []:
        text = _text_of(path)
        read = known.read(text)
        if read is None or read.language != tongue:
            fault = f"{path.name}: {text!r} is no {NAMES[tongue]} sentence of the grammar; left out"
            out.print(fault, style="yellow", soft_wrap=True)
            continue
        spoken.append((_sound_of(path), read.spoken))
    if not spoken:
        fail(f"{folder}: holds no recordings of {NAMES[tongue]} sentences ({', '.join(SOUNDS)})")
    return spoken


def _read_aloud(known: Grammar, tongue: Language, microphone: str, count: int) -> list[tuple[F32, str]]:
    """Shows sentences, and records each."""
    import random

    from vistel.audio.capture import SoundDeviceError
    from vistel.wire.clock import SystemClock
    from vistel_services.audio.inputs import CardInput

    rng = random.Random(1)
    spoken: list[tuple[F32, str]] = []
    try:
        with contextlib.closing(CardInput(microphone, SystemClock())) as card:  # open all the time: opening takes a second
            for n in range(count):
                sentence = _example(known, tongue, rng)
                as_kana = sentence.spoken if tongue == "ja" else ""
                out.print(Text.assemble(f"{n + 1:3}/{count}  ", (sentence.text, "bold"), "  ", (as_kana, "dim")))
                typer.prompt("     Enter, then read", default="", show_default=False, prompt_suffix=" ")
                spoken.append((_recorded_for(card, 1.5 + _LETTER_S[tongue] * len(sentence.spoken)), sentence.spoken))
    except SoundDeviceError as e:
        fail(str(e), FAILED)
    return spoken


def _recorded_for(card: CardInput, seconds: float) -> F32:
    """(n,) sound at 16 kHz from now on. Raises SoundDeviceError."""
    import numpy as np

    from vistel.audio.capture import SoundDeviceError
    from vistel.speech.features import Resampler

    card.take()  # drop earlier sound
    parts: list[F32] = []
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        parts += [samples for samples, _ in card.take()]
        time.sleep(0.02)
    if not parts:
        raise SoundDeviceError(f"{card.about}: no samples arrive")
    return Resampler(card.rate_hz).feed(np.concatenate(parts))


def _text_of(path: Path) -> str:
    beside = path.with_suffix(".txt")
    return beside.read_text("utf-8").strip() if beside.is_file() else re.sub(r"[-_]+", " ", path.stem)


def _sound_of(path: Path) -> F32:
    """(n,) at 16 kHz, with quiet before and after."""
    import numpy as np

    from vistel.audio.capture import SoundDeviceError
    from vistel.audio.recording import read_recording
    from vistel.speech.features import Resampler

    try:
        samples, rate = read_recording(path)
        quiet = 1e-4 * np.random.default_rng(1).standard_normal(int(0.5 * rate)).astype(np.float32)
        return Resampler(rate).feed(np.concatenate([quiet, samples, quiet, quiet]))
    except (SoundDeviceError, ValueError) as e:
        fail(f"{path.name}: {e}", FAILED)


def _prepared(
    language: str, extra: list[Path] | None, voice: Path | None, engine: str, model: Path | None
) -> tuple[Grammar, Recogniser, Language]:
    from vistel.speech.engines.choice import ENGINES, Chosen
    from vistel.speech.recognisers import RecogniserError, checked_grammar, recogniser

    tongue = _language(language)
    known, faults = checked_grammar(*(extra or ()))
    for fault in faults:
        out.print(str(fault), style="yellow", soft_wrap=True)
    try:
        chosen = next((Chosen(name, model) for name in ENGINES if name == engine), None)
        if chosen is None:
            fail(f"--engine {engine}: expected one of {', '.join(ENGINES)}", USAGE)
        return known, recogniser(tongue, known, voice, chosen), tongue
    except RecogniserError as e:
        fail(str(e), FAILED)


def _language(text: str) -> Language:
    if text == "ja":
        return "ja"
    if text == "en":
        return "en"
    fail(f"--language {text}: expected ja or en", USAGE)
