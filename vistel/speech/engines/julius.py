"""Julius, a program: its model is a jconf file that names a Japanese acoustic model (-h, -hlist), as hmm_ptm.jconf of the
grammar kit. It is given the grammar itself, as an automaton and a dictionary, and runs beside VISTEL as a process.
"""

import contextlib
import os
import re
import select
import shutil
import subprocess
import tempfile
import wave
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np

from vistel.speech.engines.engine import I16, EngineError, Transcript
from vistel.speech.grammar import Grammar, Language, SentencePattern
from vistel.speech.phones import kana_phones
from vistel.speech.recognition import SAMPLE_RATE
from vistel.speech.word_graph import word_graph

_QUIET = np.zeros(SAMPLE_RATE // 5, np.int16)
"""Before and after an utterance: Julius has models of silence there."""
_ASKS = b"enter filename->"
_PATIENCE_S = 10.0
_MOST = "5"
_SAME = {"cl": "q"}
_VOWELS = "aiueo"


def make(grammar: Grammar, language: Language, model: Path) -> "Julius":
    """Raises EngineError."""
    program = shutil.which("julius")
    if program is None:
        raise EngineError("julius: the program julius is not installed, or not in PATH (github.com/julius-speech/julius)")
    if language != "ja":
        raise EngineError("julius: hears Japanese only; choose another engine for English")
    if not model.is_file():
        raise EngineError(f"julius: model {model}: is no file; name a .jconf that names the acoustic model")
    return Julius(program, model, grammar)


def automaton(grammar: Grammar) -> tuple[str, str]:
    """The Japanese sentences as Julius reads them: .dfa, which goes from their end to their beginning, and .dict."""
    backward = tuple(SentencePattern(tuple(reversed(s.places)), s.means) for s in grammar.by_language.get("ja", ()))
    graph = word_graph(replace(grammar, by_language={"ja": backward}), "ja")
    words = sorted({word for _, _, word in graph.arcs})
    number = {word: n + 2 for n, word in enumerate(words)}  # 0 and 1: silence at the end, at the beginning
    last = graph.states + 1
    lines = ["0 0 1 0 1", *(f"{a + 1} {number[word]} {b + 1} 0 0" for a, b, word in graph.arcs)]
    lines += [f"{end + 1} 1 {last} 0 0" for end in graph.ends]
    lines.append(f"{last} -1 -1 1 0")
    entries = ["0 [</s>] silE", "1 [<s>] silB"]
    entries += [f"{number[word]} [{word}] {' '.join(julius_phones(word))}" for word in words]
    return "\n".join(lines) + "\n", "\n".join(entries) + "\n"


def julius_phones(kana: str) -> list[str]:
    """As Japanese acoustic models of Julius name them: long vowels in one, a: i: u: e: o:."""
    out: list[str] = []
    for phone in kana_phones(kana):
        if phone in _VOWELS and out and out[-1] == phone:
            out[-1] = phone + ":"
        else:
            out.append(_SAME.get(phone, phone))
    return out


class Julius:
    """Recognises an utterance when it has ended. The process ends with this object."""

    def __init__(self, program: str, model: Path, grammar: Grammar) -> None:
        self._model = model
        self._folder = tempfile.TemporaryDirectory(prefix="vistel-julius-")
        self._sound = Path(self._folder.name) / "said.wav"
        self._samples: list[I16] = []
        at = Path(self._folder.name) / "commands"
        dfa, words = automaton(grammar)
        at.with_suffix(".dfa").write_text(dfa)
        at.with_suffix(".dict").write_text(words, "utf-8")
        arguments = ["-C", str(model), "-gram", str(at), "-input", "rawfile", "-n", _MOST, "-output", _MOST, "-nolog"]
        self._command = [program, *arguments]
        self._started: subprocess.Popen[bytes] | None = None
        self._process()

    def begin(self) -> None:
        """As `Engine`."""
        self._samples = []

    def feed(self, samples: I16) -> None:
        """As `Engine`."""
        self._samples.append(samples)

    def finish(self) -> list[Transcript]:
        """As `Engine`. Raises EngineError where the process has ended or does not answer; the next utterance starts it anew."""
        with wave.open(str(self._sound), "wb") as file:
            file.setparams((1, 2, SAMPLE_RATE, 0, "NONE", "not compressed"))
            file.writeframes(np.concatenate([_QUIET, *self._samples, _QUIET]).tobytes())
        self._samples = []
        process = self._process()
        with contextlib.suppress(OSError):  # its output before it ended is read below
            if process.stdin is not None:
                process.stdin.write(f"{self._sound}\n".encode())
        return transcripts(self._answer(process))

    def _process(self) -> subprocess.Popen[bytes]:
        """Start the process and wait until it asks for a file."""
        if self._started is None:
            process = subprocess.Popen(
                self._command, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
            )
            weakref.finalize(self, _end, process)
            self._answer(process)
            self._started = process
        return self._started

    def _answer(self, process: subprocess.Popen[bytes]) -> str:
        """Its output until it asks for the next file."""
        out = process.stdout
        output = b""
        while out is not None and not output.endswith(_ASKS):
            ready, _, _ = select.select([out], [], [], _PATIENCE_S)
            more = os.read(out.fileno(), 65536) if ready else b""
            output += more
            if not more:
                why = output.decode("utf-8", "replace").strip().splitlines()
                fault = next((line for line in why if "ERROR" in line or "Error" in line), why[-1] if why else "")
                self._started = None
                _end(process)
                what = "has ended" if ready else f"does not answer after {_PATIENCE_S:.0f} s"
                raise EngineError(f"julius: model {self._model}: {what}: {fault}")
        return output.decode("utf-8", "replace")


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


def transcripts(output: str) -> list[Transcript]:
    """Of what Julius prints for an utterance; a sentence's confidence is the mean of its words' measures."""
    texts: dict[str, str] = dict(re.findall(r"^sentence(\d+):(.*)$", output, re.MULTILINE))
    sure = {n: [float(x) for x in values.split()] for n, values in re.findall(r"^cmscore(\d+):(.*)$", output, re.MULTILINE)}
    out: list[Transcript] = []
    last = 1.0
    for n, words in texts.items():
        values = sure.get(n, [])[1:-1]  # less the silence at both ends
        last = min(last, sum(values) / len(values) if values else 0.0)  # the order is by likelihood, which is more reliable
        text = "".join(word for word in words.split() if not word.startswith("<"))
        if text:
            out.append(Transcript(text, last))
    return out
