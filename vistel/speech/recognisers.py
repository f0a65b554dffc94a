"""The recogniser of a language, from a grammar."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from vistel.speech.automaton import Pattern
from vistel.speech.engines.choice import Chosen
from vistel.speech.engines.engine import EngineError
from vistel.speech.grammar import Grammar, Language
from vistel.speech.grammar_file import GrammarFault, load_grammar
from vistel.speech.phones import PHONES, kana_phones, kana_ways
from vistel.speech.recognition import Recogniser

if TYPE_CHECKING:
    from vistel.speech.acoustic import Adaptation
    from vistel.speech.hybrid import HybridRecogniser

log = logging.getLogger("vistel.speech")

Maker = Callable[[Grammar, Path | None], Recogniser]


class RecogniserError(RuntimeError):
    """A language cannot be recognised here; one line that says why and how to mend it."""


def recogniser(language: Language, grammar: Grammar, voice: Path | None = None, chosen: Chosen | None = None) -> Recogniser:
    """The recogniser of `language`. voice: what `vistel speech enrol` learnt about the speaker; chosen: another engine than the
    language's own. Raises RecogniserError."""
    if not grammar.by_language.get(language):
        raise RecogniserError(f"the grammar has no sentence in {NAMES[language]}")
    try:
        if chosen is None or chosen.name == "own":
            return MAKERS[language](grammar, voice)
        if chosen.name == "pocketsphinx":
            return pocketsphinx(language, grammar)
        from vistel.speech.engines.adapter import made  # others are used by few

        return made(chosen, grammar, language)
    except EngineError as e:
        raise RecogniserError(str(e)) from e


def unrecognisable(language: Language, text: str) -> str | None:
    """Why a word of a grammar cannot be recognised; None where it can."""
    if language == "ja":
        try:
            kana_phones(text)
        except ValueError as e:
            return str(e)
        return None
    # Loads pocketsphinx, which Japanese does without.
    from vistel.speech.engines.sphinx import unknown_word

    try:
        return unknown_word(text)
    except EngineError:
        return None


def checked_grammar(*extra: Path) -> tuple[Grammar, list[GrammarFault]]:
    """The room's grammar and `extra`, without words that no recogniser here can recognise."""
    return load_grammar(*extra, known=unrecognisable)


def text_phones(language: Language, text: str) -> tuple[str, ...]:
    """The sounds of a text as it is usually said. text: kana in Japanese. Raises ValueError, one line, where a word has none that
    are known, and EngineError."""
    if language == "ja":
        return tuple(kana_phones(text))
    from vistel.speech.engines.sphinx import phrase_phones, unknown_word

    if fault := unknown_word(text):
        raise ValueError(fault)
    return phrase_phones(text)[0]


def _hybrid(language: Language, patterns: list[Pattern], phones: tuple[str, ...], voice: Path | None) -> HybridRecogniser:
    from vistel.speech import acoustic
    from vistel.speech.automaton import compile_automaton
    from vistel.speech.hybrid import HybridRecogniser

    try:
        model = acoustic.packaged(NAMES[language].lower())
        return HybridRecogniser(compile_automaton(patterns, phones), model, _learnt(voice, language))
    except (OSError, ValueError) as e:
        raise RecogniserError(f"{NAMES[language]} cannot be recognised: {e}; `make speech-model` makes its model") from e


def _learnt(voice: Path | None, language: Language) -> Adaptation | None:
    """What a voice's file holds for that language. Raises ValueError."""
    from vistel.speech import enrolment

    if voice is None:
        return None
    found = enrolment.load(voice)
    if found.language == language:
        return found.adaptation
    log.warning(
        "event=voice_of_another_language voice=%s language=%s effect=%r",
        voice,
        found.language,
        f"it is not used: {NAMES[language]} is listened for; vistel speech enrol --language {language} learns it",
    )
    return None


def _japanese(grammar: Grammar, voice: Path | None) -> Recogniser:
    return _hybrid("ja", grammar.patterns("ja", kana_ways), PHONES, voice)


_DOUBT = 1.0
"""Log odds taken off what pocketsphinx alone believes: of the set `choose` half of that is wrong."""


def _english(grammar: Grammar, voice: Path | None) -> Recogniser:
    from vistel.speech.combined import CombinedRecogniser, Trust
    from vistel.speech.engines import sphinx
    from vistel.speech.filtered import Filtered

    patterns = grammar.patterns("en", sphinx.phrase_phones)
    net, of_filtered = (_hybrid("en", patterns, sphinx.PHONES, voice) for _ in range(2))
    try:
        filtered = Filtered((of_filtered, pocketsphinx("en", grammar)), lambda: net.pending_frames > 0)
    except EngineError as e:
        log.warning("event=no_noise_filter reason=%r effect=%r", str(e), "English is understood less well in noise")
        filtered = None
    trust = Trust("net"), Trust("pocketsphinx", _DOUBT)
    return CombinedRecogniser((net, pocketsphinx("en", grammar)), trust * 2, filtered)


def pocketsphinx(language: Language, grammar: Grammar) -> Recogniser:
    """English with pocketsphinx's own models. Raises EngineError."""
    if language != "en":
        raise EngineError('pocketsphinx: its package holds a model of English only; language = "en" takes it')
    from vistel.speech.engines.pocketsphinx import PocketsphinxRecogniser

    return PocketsphinxRecogniser(grammar)


NAMES: Mapping[Language, str] = {"ja": "Japanese", "en": "English"}
MAKERS: dict[Language, Maker] = {"ja": _japanese, "en": _english}
"""Of the package's own recognisers."""
